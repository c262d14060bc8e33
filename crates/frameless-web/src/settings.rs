//! Settings as the page shows and changes them.

use frameless::{ReconstructionKind, SamplerKind, Size, ToneMap};
use frameless_session::{Overlay, PictureSize, Settings};

use crate::wire::{Choice, SettingsChange, SettingsState};

/// The most pixels that a picture may have here: 4K. What a client's tiles take on the server grows with it.
pub const MOST_PIXELS: usize = 3840 * 2160;

// A picture in ten seconds of the smallest size, and more than any renderer traces.
const RATES: std::ops::RangeInclusive<f64> = 1.0..=1e12;
// 2^±64 reaches from the darkest to the brightest light there is.
const STOPS: std::ops::RangeInclusive<f32> = -64.0..=64.0;
const TILES: std::ops::RangeInclusive<u32> = 1..=64;

/// What the panel shows.
pub(crate) fn state(settings: &Settings) -> SettingsState {
    let (temporal, w_d, tile) = match settings.sampler {
        SamplerKind::Adaptive(options) => (Some(options.temporal), None, None),
        SamplerKind::Change { w_d, tile } => (None, Some(w_d), Some(tile)),
        SamplerKind::Random | SamplerKind::Permutation => (None, None, None),
    };
    let is_own = settings.own_sampler == Some(true);
    let (temporal, w_d, tile) = if is_own { (None, None, None) } else { (temporal, w_d, tile) };
    SettingsState {
        sampler: sampler_name(settings),
        temporal,
        w_d,
        tile,
        reconstruction: settings.reconstruction.name(),
        samples_per_sec: settings.samples_per_sec,
        exposure_stops: settings.exposure_stops,
        tone_map: settings.tone_map.name(),
        overlay: overlay_name(settings.overlay),
        picture: picture_name(settings.picture),
    }
}

/// The settings after a change.
///
/// # Errors
/// With what cannot be, for the user; then nothing is to change.
pub(crate) fn changed(settings: &Settings, change: &SettingsChange) -> Result<Settings, String> {
    let mut new = *settings;
    if let Some(name) = &change.sampler
        && *name != sampler_name(settings)
    {
        set_sampler(&mut new, name)?;
    }
    set_options(&mut new, change)?;
    if let Some(name) = &change.reconstruction {
        new.reconstruction = ReconstructionKind::from_name(name)
            .ok_or_else(|| format!("there is no reconstruction {}", quoted(name)))?;
    }
    if let Some(rate) = change.samples_per_sec {
        new.samples_per_sec = match rate {
            Some(rate) if !RATES.contains(&rate) => {
                return Err(format!("{rate} samples/s: wanted 1 to 1e12"));
            }
            rate => rate,
        };
    }
    if let Some(stops) = change.exposure_stops {
        if !STOPS.contains(&stops) {
            return Err(format!("an exposure of {stops} stops: wanted -64 to 64"));
        }
        new.exposure_stops = stops;
    }
    if let Some(name) = &change.tone_map {
        new.tone_map = ToneMap::from_name(name)
            .ok_or_else(|| format!("there is no tone mapping {}", quoted(name)))?;
    }
    if let Some(name) = &change.overlay {
        new.overlay = Overlay::ALL
            .into_iter()
            .find(|&overlay| overlay_name(overlay) == name)
            .ok_or_else(|| format!("there is no overlay {}", quoted(name)))?;
    }
    if let Some(name) = &change.picture {
        new.picture = picture(name)?;
    }
    Ok(new)
}

/// The renderer's own sampler among the others.
const OWN_SAMPLER: &str = "own";

fn sampler_name(settings: &Settings) -> &'static str {
    match settings.own_sampler {
        Some(true) => OWN_SAMPLER,
        _ => settings.sampler.name(),
    }
}

fn set_sampler(settings: &mut Settings, name: &str) -> Result<(), String> {
    let is_own = name == OWN_SAMPLER && settings.own_sampler.is_some();
    if !is_own {
        settings.sampler = SamplerKind::from_name(name)
            .ok_or_else(|| format!("there is no sampler {}", quoted(name)))?;
    }
    settings.own_sampler = settings.own_sampler.map(|_| is_own);
    Ok(())
}

fn set_options(settings: &mut Settings, change: &SettingsChange) -> Result<(), String> {
    let (temporal, w_d, tile) =
        (change.temporal.flatten(), change.w_d.flatten(), change.tile.flatten());
    let tells_any = temporal.is_some() || w_d.is_some() || tile.is_some();
    if settings.own_sampler == Some(true) && tells_any {
        return Err(format!("the sampler {OWN_SAMPLER} has none of temporal, w_d and tile"));
    }
    let sampler = &mut settings.sampler;
    let is_fraction = |number: f32| (0.0..=1.0).contains(&number);
    if let Some(wanted) = temporal {
        match sampler {
            SamplerKind::Adaptive(options) if is_fraction(wanted) => options.temporal = wanted,
            SamplerKind::Adaptive(_) => return Err(format!("temporal {wanted}: wanted 0 to 1")),
            other => return Err(format!("the sampler {} has no temporal", other.name())),
        }
    }
    if let Some(wanted) = w_d {
        match sampler {
            SamplerKind::Change { w_d, .. } if is_fraction(wanted) => *w_d = wanted,
            SamplerKind::Change { .. } => return Err(format!("w_d {wanted}: wanted 0 to 1")),
            other => return Err(format!("the sampler {} has no w_d", other.name())),
        }
    }
    if let Some(wanted) = tile {
        match sampler {
            SamplerKind::Change { tile, .. } if TILES.contains(&wanted) => *tile = wanted,
            SamplerKind::Change { .. } => return Err(format!("tile {wanted}: wanted 1 to 64")),
            other => return Err(format!("the sampler {} has no tile", other.name())),
        }
    }
    Ok(())
}

/// The size of the picture in a place of `place_px` device pixels, within what is allowed here.
pub(crate) fn size_in(settings: &Settings, place_px: [u32; 2]) -> Size {
    let within = match settings.picture {
        PictureSize::Window { at_most } => {
            PictureSize::Window { at_most: at_most.min(MOST_PIXELS as u32) }
        }
        fixed => fixed,
    };
    within.size_in(place_px)
}

fn picture(name: &str) -> Result<PictureSize, String> {
    match name {
        "window" => Ok(PictureSize::default()),
        "whole-window" => Ok(PictureSize::WHOLE_WINDOW),
        size => {
            let sides = size.split_once('x').and_then(|(width, height)| {
                Some((width.parse::<u32>().ok()?, height.parse::<u32>().ok()?))
            });
            match sides {
                Some(sides) => allowed(sides).map(PictureSize::Fixed).ok_or_else(|| {
                    format!(
                        "a picture of {size}: wanted sides of 1 to 65535 and at most {MOST_PIXELS} pixels"
                    )
                }),
                None => Err(format!(
                    "a picture of {}: wanted window, whole-window or a size such as 512x384",
                    quoted(size)
                )),
            }
        }
    }
}

/// That size, if a picture may have it here.
fn allowed((width, height): (u32, u32)) -> Option<Size> {
    let sides = 1..=u32::from(u16::MAX);
    let is_allowed = sides.contains(&width)
        && sides.contains(&height)
        && width as usize * height as usize <= MOST_PIXELS;
    is_allowed.then(|| Size::new(width, height))
}

fn picture_name(picture: PictureSize) -> String {
    match picture {
        PictureSize::WHOLE_WINDOW => "whole-window".to_owned(),
        PictureSize::Window { .. } => "window".to_owned(),
        PictureSize::Fixed(Size { width, height }) => format!("{width}x{height}"),
    }
}

fn overlay_name(overlay: Overlay) -> &'static str {
    match overlay {
        Overlay::None => "none",
        Overlay::Change => "change",
        Overlay::SourceAge => "source-age",
        Overlay::TileProbability => "tile-probability",
        Overlay::SamplingRate => "sampling-rate",
        Overlay::LearnedRate => "learned-rate",
        Overlay::Holes => "holes",
    }
}

/// The overlays, in the order of the keys 0 to 6.
pub(crate) fn overlays() -> Vec<Choice> {
    let choice = |overlay: Overlay| Choice {
        name: overlay_name(overlay),
        title: Some(overlay.name()),
        description: overlay.explanation(),
    };
    Overlay::ALL.into_iter().map(choice).collect()
}

/// The tone mappings.
pub(crate) fn tone_maps() -> Vec<Choice> {
    let choice = |tone_map: ToneMap| Choice {
        name: tone_map.name(),
        title: None,
        description: tone_map.explanation(),
    };
    ToneMap::ALL.into_iter().map(choice).collect()
}

/// The samplers, the best first; before them the renderer's own, if it has one.
pub(crate) fn samplers(has_own: bool) -> Vec<Choice> {
    let own = Choice {
        name: OWN_SAMPLER,
        title: None,
        description: "the sampler that the renderer has brought with it",
    };
    let choice = |kind: &SamplerKind| Choice {
        name: kind.name(),
        title: None,
        description: match kind {
            SamplerKind::Random => "any pixel, each time anew (Bishop et al. 1994)",
            SamplerKind::Permutation => "every pixel once, in random order; then again",
            SamplerKind::Change { .. } => "where colours have just changed (the sketch of 2002)",
            SamplerKind::Adaptive(_) => {
                "what has been uncovered first, then moving edges, then where change has been learned to be fast"
            }
        },
    };
    has_own.then_some(own).into_iter().chain(SamplerKind::ALL.iter().rev().map(choice)).collect()
}

/// What a client wrote, short enough to be shown.
pub(crate) fn quoted(text: &str) -> String {
    const LONGEST: usize = 60;
    let short: String = text.chars().take(LONGEST).collect();
    format!("{short:?}")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wire::Said;

    fn change(json: &str) -> SettingsChange {
        match Said::parse(json) {
            Ok(Said::Settings(change)) => change,
            other => panic!("{json}: {other:?}"),
        }
    }

    #[test]
    fn what_is_not_named_stays() {
        let before = Settings::default();
        assert_eq!(changed(&before, &SettingsChange::default()), Ok(before));
        let brighter = change(r#"{"type": "settings", "exposure_stops": 1}"#);
        let after = changed(&before, &brighter).unwrap();
        assert_eq!(after, Settings { exposure_stops: 1.0, ..before });
    }

    #[test]
    fn an_own_sampler_is_one_among_the_others() {
        let says = |json: &str| match Said::parse(&format!("{{\"type\":\"settings\",{json}}}")) {
            Ok(Said::Settings(change)) => change,
            other => panic!("{other:?}"),
        };
        let plain = Settings::default();
        assert!(changed(&plain, &says("\"sampler\":\"own\"")).is_err(), "there is none");
        let own = Settings { own_sampler: Some(true), ..plain };
        assert_eq!(state(&own).sampler, "own");
        assert!(changed(&own, &says("\"temporal\":0.5")).is_err());
        let other = changed(&own, &says("\"sampler\":\"random\"")).unwrap();
        assert_eq!((other.own_sampler, other.sampler), (Some(false), SamplerKind::Random));
        assert_eq!(changed(&other, &says("\"sampler\":\"own\"")).unwrap().own_sampler, Some(true));
        assert_eq!((samplers(true).len(), samplers(false).len()), (5, 4));
    }

    #[test]
    fn the_state_can_be_sent_back() {
        for sampler in SamplerKind::ALL {
            for (overlay, tone_map, picture) in [
                (Overlay::Holes, ToneMap::None, PictureSize::default()),
                (Overlay::None, ToneMap::Neutral, PictureSize::WHOLE_WINDOW),
                (Overlay::Change, ToneMap::Aces, PictureSize::Fixed(Size::new(512, 384))),
            ] {
                let set = Settings { sampler, overlay, tone_map, picture, ..Settings::default() };
                let mut json = serde_json::to_value(state(&set)).unwrap();
                json["type"] = "settings".into();
                let back = changed(&Settings::default(), &change(&json.to_string()));
                assert_eq!(back, Ok(set), "{json}");
            }
        }
    }

    #[test]
    fn what_cannot_be_is_named() {
        let with = |json| changed(&Settings::default(), &change(json)).unwrap_err();
        for (json, named) in [
            (r#"{"type": "settings", "sampler": "best"}"#, "\"best\""),
            (r#"{"type": "settings", "reconstruction": "blur"}"#, "\"blur\""),
            (r#"{"type": "settings", "overlay": ""}"#, "overlay"),
            (r#"{"type": "settings", "tone_map": "film"}"#, "\"film\""),
            (r#"{"type": "settings", "samples_per_sec": 0}"#, "samples/s"),
            (r#"{"type": "settings", "exposure_stops": 1e30}"#, "stops"),
            (r#"{"type": "settings", "temporal": 2}"#, "0 to 1"),
            (r#"{"type": "settings", "w_d": 0.5}"#, "no w_d"),
            (r#"{"type": "settings", "sampler": "change", "tile": 65}"#, "1 to 64"),
            (r#"{"type": "settings", "picture": "99999x1"}"#, "65535"),
            (r#"{"type": "settings", "picture": "65535x65535"}"#, "pixels"),
            (r#"{"type": "settings", "picture": "large"}"#, "512x384"),
            (r#"{"type": "settings", "picture": "0x5"}"#, "sides"),
        ] {
            let error = with(json);
            assert!(error.contains(named), "{json}: {error}");
        }
    }

    #[test]
    fn no_place_makes_a_picture_larger_than_allowed() {
        let whole = Settings { picture: PictureSize::WHOLE_WINDOW, ..Settings::default() };
        for place in [[16_384, 16_384], [0, 0]] {
            let size = size_in(&whole, place);
            assert_eq!(allowed((size.width, size.height)), Some(size));
        }
    }
}
