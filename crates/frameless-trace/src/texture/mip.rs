//! Smaller and smaller copies of a picture, for where a pixel sees many of its texels (Williams 1983, "Pyramidal Parametrics").
//!
//! Each copy has half the columns and rows of the one before, rounded down, to a single texel. A texel is the mean of those that it
//! covers, in linear light:
//!
//! ```text
//! n' = max(1, ⌊n/2⌋) texels over n: texel i covers [i, i + 1) · n/n'        two of them, or three in part where n is odd
//! ```

use frameless_scene::{Image, Scene};
use glam::Vec4;
use rayon::prelude::*;

use super::Encoding;

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
        let next = half(last, encoding);
        copies.push(next);
    }
}

fn half(image: &Image, encoding: Encoding) -> Image {
    let table = encoding.table();
    let decode = |[r, g, b, a]: [u8; 4]| {
        let [r, g, b] = [r, g, b].map(|code| table[usize::from(code)]);
        Vec4::new(r, g, b, f32::from(a) / 255.0)
    };
    let (columns, rows) = (taps(image.width), taps(image.height));
    let width = image.width as usize;
    let mut rgba = vec![[0; 4]; columns.len() * rows.len()];
    rgba.par_chunks_mut(columns.len()).zip(&rows).for_each(|(half, row)| {
        if image.width.is_multiple_of(2) && image.height.is_multiple_of(2) {
            // The same four quarters, to the last bit.
            let [above, below] = [row[0].0, row[1].0].map(|y| &image.rgba[y as usize * width..]);
            for (texel, (above, below)) in
                half.iter_mut().zip(above.chunks_exact(2).zip(below.chunks_exact(2)))
            {
                let [a, b] = [decode(above[0]), decode(above[1])];
                let [c, d] = [decode(below[0]), decode(below[1])];
                *texel = encoding.encode(0.25 * (a + b + c + d));
            }
            return;
        }
        for (texel, column) in half.iter_mut().zip(&columns) {
            let mut sum = Vec4::ZERO;
            for &(y, weight_y) in row.iter().filter(|tap| tap.1 > 0.0) {
                for &(x, weight_x) in column.iter().filter(|tap| tap.1 > 0.0) {
                    let texel = image.rgba[y as usize * width + x as usize];
                    sum += weight_x * weight_y * decode(texel);
                }
            }
            *texel = encoding.encode(sum);
        }
    });
    Image { width: columns.len() as u32, height: rows.len() as u32, rgba }
}

/// Per texel of the half: up to three of the whole, with the part of it that each of them is. Unused ones weigh nothing.
fn taps(whole: u32) -> Vec<[(u32, f32); 3]> {
    let half = (whole / 2).max(1);
    let covers = f64::from(whole) / f64::from(half);
    let taps = (0..half).map(|i| {
        let (begin, end) = (f64::from(i) * covers, f64::from(i + 1) * covers);
        let first = begin as u32;
        [first, first + 1, first + 2].map(|texel| {
            let inside = end.min(f64::from(texel + 1)) - begin.max(f64::from(texel));
            let weight = if texel < whole { (inside / covers).max(0.0) } else { 0.0 };
            (texel, weight as f32)
        })
    });
    taps.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

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

    /// Pictures of even sizes go a way of their own.
    #[test]
    fn quarters_are_added_as_taps_are() {
        let even = image(6, 4);
        let halved = half(&even, Encoding::Color);
        let table = Encoding::Color.table();
        let decode = |x: u32, y: u32| {
            let [r, g, b, a] = even.rgba[(y * 6 + x) as usize];
            let [r, g, b] = [r, g, b].map(|code| table[usize::from(code)]);
            Vec4::new(r, g, b, f32::from(a) / 255.0)
        };
        for (texel, at) in halved.rgba.iter().zip(0u32..) {
            let (x, y) = (at % 3 * 2, at / 3 * 2);
            let four = [(x, y), (x + 1, y), (x, y + 1), (x + 1, y + 1)];
            let sum: Vec4 = four.iter().fold(Vec4::ZERO, |sum, &(x, y)| sum + 0.25 * decode(x, y));
            assert_eq!(*texel, Encoding::Color.encode(sum));
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
