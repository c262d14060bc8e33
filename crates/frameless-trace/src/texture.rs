//! Texture look-up.

use frameless_scene::{Filter, Image, Texture, Wrap};
use glam::Vec3A;

/// Linear value of every sRGB byte (IEC 61966-2-1): c/12.92 up to 0.04045, else ((c + 0.055)/1.055)^2.4.
pub(crate) fn linear_from_srgb_table() -> [f32; 256] {
    std::array::from_fn(|byte| {
        let c = byte as f64 / 255.0;
        let linear = if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) };
        linear as f32
    })
}

/// Linear RGB at texture coordinates `uv`; (0, 0) is the top-left corner of the first texel.
///
/// Texels are decoded before they are mixed. No mip levels: samples are points, and antialiasing comes from many of them.
pub(crate) fn look_up(texture: &Texture, image: &Image, table: &[f32; 256], uv: [f32; 2]) -> Vec3A {
    let [wrap_u, wrap_v] = texture.wrap;
    let (width, height) = (image.width as i32, image.height as i32);
    let x = into_unit(uv[0], wrap_u) * width as f32;
    let y = into_unit(uv[1], wrap_v) * height as f32;
    let texel = |x: i32, y: i32| {
        let x = neighbour(x, width, wrap_u);
        let y = neighbour(y, height, wrap_v);
        let [r, g, b, _] = image.rgba[y as usize * width as usize + x as usize];
        Vec3A::new(table[r as usize], table[g as usize], table[b as usize])
    };
    match texture.filter {
        Filter::Nearest => texel(x as i32, y as i32),
        Filter::Linear => {
            // Texel centres are at half numbers.
            let (x, y) = (x - 0.5, y - 0.5);
            let (left, top) = (x.floor(), y.floor());
            let (fx, fy) = (x - left, y - top);
            let (i, j) = (left as i32, top as i32);
            let above = texel(i, j).lerp(texel(i + 1, j), fx);
            let below = texel(i, j + 1).lerp(texel(i + 1, j + 1), fx);
            above.lerp(below, fy)
        }
    }
}

/// A coordinate brought into [0, 1]; not finite becomes 0.
fn into_unit(c: f32, wrap: Wrap) -> f32 {
    if !c.is_finite() {
        return 0.0;
    }
    match wrap {
        Wrap::Repeat => c - c.floor(),
        Wrap::MirroredRepeat => {
            let in_pair = c - 2.0 * (0.5 * c).floor();
            if in_pair > 1.0 { 2.0 - in_pair } else { in_pair }
        }
        Wrap::ClampToEdge => c.clamp(0.0, 1.0),
    }
}

/// A texel index from −1 to `size` brought into the image. The mirrored image's neighbour at the border is the border
/// texel itself, as when clamped.
fn neighbour(index: i32, size: i32, wrap: Wrap) -> i32 {
    match wrap {
        Wrap::Repeat if index < 0 => size - 1,
        Wrap::Repeat if index >= size => 0,
        _ => index.clamp(0, size - 1),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Black and white beside each other.
    fn look(u: f32, wrap: Wrap, filter: Filter) -> f32 {
        let image = Image { width: 2, height: 1, rgba: vec![[0, 0, 0, 255], [255; 4]] };
        let texture = Texture { image: 0, wrap: [wrap; 2], filter };
        look_up(&texture, &image, &linear_from_srgb_table(), [u, 0.5]).x
    }

    #[test]
    fn table_has_its_known_values() {
        let table = linear_from_srgb_table();
        assert_eq!((table[0], table[255]), (0.0, 1.0));
        assert!(
            (table[188] - 0.5029).abs() < 1e-4,
            "sRGB 188 is about half the light, not {}",
            table[188]
        );
    }

    #[test]
    fn between_texel_centres_light_is_mixed_linearly() {
        for wrap in [Wrap::Repeat, Wrap::MirroredRepeat, Wrap::ClampToEdge] {
            assert_eq!(look(0.25, wrap, Filter::Linear), 0.0);
            assert_eq!(look(0.75, wrap, Filter::Linear), 1.0);
            assert_eq!(look(0.5, wrap, Filter::Linear), 0.5);
        }
    }

    #[test]
    fn outside_follows_the_wrap_mode() {
        let at = |u, wrap| look(u, wrap, Filter::Linear);
        assert_eq!(at(0.0, Wrap::Repeat), 0.5, "half the texel before, which is the last one");
        assert_eq!(at(0.0, Wrap::ClampToEdge), 0.0);
        assert_eq!(at(0.0, Wrap::MirroredRepeat), 0.0);
        assert_eq!(at(1.25, Wrap::Repeat), 0.0);
        assert_eq!(at(1.25, Wrap::ClampToEdge), 1.0);
        assert_eq!(at(1.25, Wrap::MirroredRepeat), 1.0);
        assert_eq!(at(-0.75, Wrap::MirroredRepeat), 1.0);
        assert_eq!(at(-0.75, Wrap::Repeat), 0.0);
    }

    #[test]
    fn nearest_takes_one_texel() {
        assert_eq!(look(0.49, Wrap::Repeat, Filter::Nearest), 0.0);
        assert_eq!(look(0.51, Wrap::Repeat, Filter::Nearest), 1.0);
        assert_eq!(look(1.0, Wrap::ClampToEdge, Filter::Nearest), 1.0);
    }

    #[test]
    fn absurd_coordinates_give_a_texel() {
        for u in [f32::NAN, f32::INFINITY, -1e38, 1e38, -1e-30] {
            for wrap in [Wrap::Repeat, Wrap::MirroredRepeat, Wrap::ClampToEdge] {
                for filter in [Filter::Nearest, Filter::Linear] {
                    assert!((0.0..=1.0).contains(&look(u, wrap, filter)));
                }
            }
        }
    }
}
