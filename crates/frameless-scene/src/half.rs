//! A picture of half the size.

use glam::Vec4;
use rayon::prelude::*;

use crate::{Encoding, Image};

impl Image {
    /// Half the columns and rows, rounded down, but one at least. A texel is the mean of those that it covers, in linear light if
    /// they are colours:
    ///
    /// ```text
    /// n' = max(1, ⌊n/2⌋) texels over n: texel i covers [i, i + 1) · n/n'        two of them, or three in part where n is odd
    /// ```
    pub fn half(&self, encoding: Encoding) -> Image {
        let table = encoding.table();
        let decode = |[r, g, b, a]: [u8; 4]| {
            let [r, g, b] = [r, g, b].map(|code| table[usize::from(code)]);
            Vec4::new(r, g, b, f32::from(a) / 255.0)
        };
        let (columns, rows) = (taps(self.width), taps(self.height));
        let width = self.width as usize;
        let mut rgba = vec![[0; 4]; columns.len() * rows.len()];
        rgba.par_chunks_mut(columns.len()).zip(&rows).for_each(|(half, row)| {
            if self.width.is_multiple_of(2) && self.height.is_multiple_of(2) {
                // The same four quarters, to the last bit.
                let [above, below] = [row[0].0, row[1].0].map(|y| &self.rgba[y as usize * width..]);
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
                        let texel = self.rgba[y as usize * width + x as usize];
                        sum += weight_x * weight_y * decode(texel);
                    }
                }
                *texel = encoding.encode(sum);
            }
        });
        Image { width: columns.len() as u32, height: rows.len() as u32, rgba }
    }
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

    /// Pictures of even sizes go a way of their own.
    #[test]
    fn quarters_are_added_as_taps_are() {
        let even = image(6, 4);
        let halved = even.half(Encoding::Color);
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
}
