//! Smaller and smaller copies of a picture, for where a pixel sees many of its texels (Williams 1983, "Pyramidal Parametrics").
//!
//! Each copy has half the columns and rows of the one before ([`Image::half`]), to a single texel.

use frameless_scene::{Encoding, Image, Scene};
use rayon::prelude::*;

/// The copies of every picture of a scene, largest first; none of those that are never looked up so.
pub(crate) struct Copies {
    /// By [`Encoding`], then by picture.
    of: [Vec<Vec<Image>>; 2],
}

impl Copies {
    /// Makes them, on all cores.
    pub(crate) fn new(scene: &Scene) -> Copies {
        let of = Encoding::BOTH.map(|encoding| {
            let mut is_needed = vec![false; scene.images.len()];
            for (reference, is_color) in scene.materials.iter().flat_map(|m| m.textures()) {
                let texture = scene.textures[reference.texture as usize];
                is_needed[texture.image as usize] |=
                    Encoding::of(is_color) == encoding && texture.minify.levels.is_some();
            }
            let images = scene.images.par_iter().zip(is_needed);
            let copies = images.map(|(image, is_needed)| match is_needed {
                true => copies(image, encoding),
                false => Vec::new(),
            });
            copies.collect()
        });
        Copies { of }
    }

    #[inline]
    pub(super) fn of(&self, image: u32, encoding: Encoding) -> &[Image] {
        &self.of[encoding as usize][image as usize]
    }
}

/// Down to one texel.
fn copies(image: &Image, encoding: Encoding) -> Vec<Image> {
    let mut copies: Vec<Image> = Vec::new();
    loop {
        let last = copies.last().unwrap_or(image);
        if last.width == 1 && last.height == 1 {
            return copies;
        }
        let next = last.half(encoding);
        copies.push(next);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec4;

    fn image(width: u32, height: u32) -> Image {
        let texel = |i: u32| {
            let byte = (i.wrapping_mul(2_654_435_761) >> 24) as u8;
            [byte, 255 - byte, (i % 256) as u8, byte / 2]
        };
        Image { width, height, rgba: (0..width * height).map(texel).collect() }
    }

    fn mean(image: &Image, encoding: Encoding) -> Vec4 {
        let table = encoding.table();
        let texels = image.rgba.iter().map(|&[r, g, b, a]| {
            let [r, g, b] = [r, g, b].map(|code| table[usize::from(code)]);
            Vec4::new(r, g, b, f32::from(a) / 255.0)
        });
        texels.sum::<Vec4>() / image.rgba.len() as f32
    }

    #[test]
    fn every_copy_has_the_mean_of_the_picture() {
        for (width, height) in [(16, 16), (17, 5), (1, 9), (3, 3), (31, 64)] {
            let image = image(width, height);
            for encoding in Encoding::BOTH {
                let expected = mean(&image, encoding);
                for copy in copies(&image, encoding) {
                    let came = mean(&copy, encoding);
                    assert!((came - expected).abs().max_element() < 0.006, "{came} {expected}");
                }
            }
        }
    }

    #[test]
    fn sizes_halve_down_to_one_texel() {
        let sizes = |width, height| -> Vec<(u32, u32)> {
            let copies = copies(&image(width, height), Encoding::Number);
            copies.iter().map(|copy| (copy.width, copy.height)).collect()
        };
        assert_eq!(sizes(8, 2), [(4, 1), (2, 1), (1, 1)]);
        assert_eq!(sizes(5, 3), [(2, 1), (1, 1)]);
        assert!(sizes(1, 1).is_empty());
    }

    /// Black and white mix to half the light: sRGB 188, as a number 128.
    #[test]
    fn colours_mix_as_light_and_numbers_as_numbers() {
        let image = Image { width: 2, height: 1, rgba: vec![[0, 0, 0, 0], [255; 4]] };
        assert_eq!(copies(&image, Encoding::Color)[0].rgba, [[188, 188, 188, 128]]);
        assert_eq!(copies(&image, Encoding::Number)[0].rgba, [[128; 4]]);
    }
}
