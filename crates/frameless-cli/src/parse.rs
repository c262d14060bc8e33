//! From the text of an argument to a checked value.

use std::convert::Infallible;

use frameless::{ReconstructionKind, Size, ToneMap};
use frameless_scene::{AnimationChoice, Pick};

/// Longest side of a picture: what GPUs take as a texture.
const MAX_SIDE: u32 = 16_384;

/// Most pixels of a picture: 64 Mi pixels hold about 3 GB of samples.
const MAX_PIXELS: usize = 1 << 26;

/// `WxH` in pixels.
pub(crate) fn size(text: &str) -> Result<Size, String> {
    let (width, height) =
        two_numbers(text, 'x').ok_or("wanted WIDTHxHEIGHT in pixels, such as 512x384")?;
    if width == 0 || height == 0 || width > MAX_SIDE || height > MAX_SIDE {
        return Err(format!("each side must be between 1 and {MAX_SIDE} pixels"));
    }
    let size = Size::new(width, height);
    if size.pixels() > MAX_PIXELS {
        return Err(format!("a picture may have at most {MAX_PIXELS} pixels"));
    }
    Ok(size)
}

/// `X,Y` in pixels: column and row, counted from the top left.
pub(crate) fn pixel(text: &str) -> Result<(u32, u32), String> {
    two_numbers(text, ',')
        .ok_or_else(|| "wanted X,Y: column and row from the top left, such as 256,192".into())
}

/// A number that is neither infinite nor NaN.
pub(crate) fn finite(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(number) if number.is_finite() => Ok(number),
        _ => Err("wanted a finite number".into()),
    }
}

/// A finite number above zero.
pub(crate) fn positive(text: &str) -> Result<f64, String> {
    match finite(text) {
        Ok(number) if number > 0.0 => Ok(number),
        _ => Err("wanted a number above zero".into()),
    }
}

/// Which of a file's scenes. No name is that of every scene without one.
pub(crate) fn pick(text: &str) -> Result<Pick, String> {
    match text {
        "" => Err("wanted a number from 0, or a name".into()),
        _ => text.parse().map_err(|never: Infallible| match never {}),
    }
}

/// Which of a file's animations.
pub(crate) fn animation(text: &str) -> Result<AnimationChoice, String> {
    match text {
        "" => Err("wanted a number from 0, a name, all or none".into()),
        _ => text.parse().map_err(|never: Infallible| match never {}),
    }
}

/// A number of bytes, such as `512M`: K, M and G are powers of 1024.
pub(crate) fn bytes(text: &str) -> Result<u64, String> {
    let (number, power) = match text.char_indices().last() {
        Some((end, 'K' | 'k')) => (&text[..end], 10),
        Some((end, 'M' | 'm')) => (&text[..end], 20),
        Some((end, 'G' | 'g')) => (&text[..end], 30),
        _ => (text, 0),
    };
    let bytes = number.parse::<u64>().ok().and_then(|number| number.checked_mul(1 << power));
    bytes.ok_or_else(|| "wanted a number of bytes, such as 500000, 512M or 4G".into())
}

/// A number from 0 to 1.
pub(crate) fn fraction(text: &str) -> Result<f32, String> {
    match finite(text) {
        Ok(number) if (0.0..=1.0).contains(&number) => Ok(number as f32),
        _ => Err("wanted a number from 0 to 1".into()),
    }
}

/// A tone mapping by its name.
pub(crate) fn tone_map(text: &str) -> Result<ToneMap, String> {
    ToneMap::from_name(text).ok_or_else(|| "wanted neutral, agx, aces or none".into())
}

/// A reconstruction by its name.
pub(crate) fn reconstruction(text: &str) -> Result<ReconstructionKind, String> {
    ReconstructionKind::from_name(text).ok_or_else(|| {
        "wanted hold, filter or reproject, the last with +relight, +deep, +antialias as you like".into()
    })
}

/// A number of seconds that a person might wait: above zero, at most a day.
pub(crate) fn wait_secs(text: &str) -> Result<f64, String> {
    const DAY_SECS: f64 = 86_400.0;
    match positive(text) {
        Ok(secs) if secs <= DAY_SECS => Ok(secs),
        _ => Err("wanted seconds, above zero and at most a day".into()),
    }
}

/// Exposure in stops. 2^±64 reaches from the darkest to the brightest light there is.
pub(crate) fn stops(text: &str) -> Result<f32, String> {
    match finite(text) {
        Ok(stops) if stops.abs() <= 64.0 => Ok(stops as f32),
        _ => Err("wanted stops between -64 and 64".into()),
    }
}

fn two_numbers(text: &str, separator: char) -> Option<(u32, u32)> {
    let (first, second) = text.split_once(separator)?;
    Some((first.parse().ok()?, second.parse().ok()?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes() {
        assert_eq!(size("512x384"), Ok(Size::new(512, 384)));
        assert_eq!(size("16384x1"), Ok(Size::new(16_384, 1)));
        for bad in ["", "512", "x", "512x", "0x1", "1x0", "16385x1", "-1x5", "16384x16384", "1x1x1"]
        {
            assert!(size(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn pixels() {
        assert_eq!(pixel("3,0"), Ok((3, 0)));
        for bad in ["", "3", "3,", "-1,0", "1.5,2", "1,2,3", "99999999999,0"] {
            assert!(pixel(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn reconstructions() {
        assert_eq!(reconstruction("hold"), Ok(ReconstructionKind::Hold));
        let default = ReconstructionKind::default();
        assert_eq!(reconstruction("reproject+relight+antialias"), Ok(default));
        for bad in ["", "blur", "hold+deep", "reproject+"] {
            assert!(reconstruction(bad).is_err_and(|error| error.contains("+antialias")), "{bad}");
        }
    }

    #[test]
    fn numbers() {
        assert_eq!(finite("-2.5"), Ok(-2.5));
        assert!(["inf", "nan", "1e999", "", "x"].iter().all(|bad| finite(bad).is_err()));
        assert_eq!(positive("9e5"), Ok(9e5));
        assert!(["0", "-1", "inf", "nan"].iter().all(|bad| positive(bad).is_err()));
        assert_eq!(["0", "0.25", "1"].map(fraction), [Ok(0.0), Ok(0.25), Ok(1.0)]);
        assert!(["-0.1", "1.01", "nan", ""].iter().all(|bad| fraction(bad).is_err()));
        assert!(wait_secs("86401").is_err());
        assert_eq!(stops("-3"), Ok(-3.0));
        assert!(stops("65").is_err());
    }
}
