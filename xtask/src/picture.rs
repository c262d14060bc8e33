//! Is there something to see in a picture?

use std::collections::HashMap;
use std::fs::File;
use std::io::BufReader;
use std::path::Path;

use anyhow::{Context, Result, ensure};

/// Colours closer than this (per channel, of 255) count as the same: below it lie dithering and rounding.
const SAME: u8 = 8;

/// The part of a picture that must differ from its most frequent colour: more than a line of text on an
/// empty window would change, less than any of the built-in scenes shows.
const LEAST_DIFFERENT: f64 = 0.1;

/// Read a PNG and refuse it if it is black, of one colour, or one colour with a bit of text on it.
/// Returns its width and height.
pub(crate) fn shows_something(path: &Path) -> Result<(u32, u32)> {
    let picture = Picture::read(path).with_context(|| format!("cannot read {}", path.display()))?;
    let different = picture.different_part();
    ensure!(
        different >= LEAST_DIFFERENT,
        "{} shows next to nothing: {:.1} % of its pixels differ from its most frequent colour",
        path.display(),
        different * 100.0
    );
    Ok((picture.width, picture.height))
}

struct Picture {
    width: u32,
    height: u32,
    rgb: Vec<[u8; 3]>,
}

impl Picture {
    fn read(path: &Path) -> Result<Picture> {
        let mut decoder = png::Decoder::new(BufReader::new(File::open(path)?));
        decoder.set_transformations(png::Transformations::normalize_to_color8());
        let mut reader = decoder.read_info()?;
        let mut bytes = vec![0; reader.output_buffer_size().context("too large")?];
        let info = reader.next_frame(&mut bytes)?;
        let rgb = bytes[..info.buffer_size()]
            .chunks_exact(info.color_type.samples())
            .map(|pixel| match *pixel {
                [r, g, b] | [r, g, b, _] => [r, g, b],
                [gray, ..] => [gray; 3],
                [] => [0; 3],
            })
            .collect();
        Ok(Picture { width: info.width, height: info.height, rgb })
    }

    /// Part of the pixels that differ visibly from the most frequent colour.
    fn different_part(&self) -> f64 {
        let mut counts = HashMap::new();
        for color in &self.rgb {
            *counts.entry(*color).or_insert(0usize) += 1;
        }
        let Some((frequent, _)) = counts.iter().max_by_key(|(color, count)| (**count, **color))
        else {
            return 0.0;
        };
        let differs = |color: &[u8; 3]| (0..3).any(|k| color[k].abs_diff(frequent[k]) > SAME);
        let different: usize =
            counts.iter().filter(|(color, _)| differs(color)).map(|(_, count)| count).sum();
        different as f64 / self.rgb.len() as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 100×100 pixels of the gray value `gray(x, y)`.
    fn picture(gray: impl Fn(usize, usize) -> u8) -> Picture {
        let rgb = (0..100 * 100).map(|i| [gray(i % 100, i / 100); 3]).collect();
        Picture { width: 100, height: 100, rgb }
    }

    #[test]
    fn an_empty_window_with_a_line_of_text_shows_nothing() {
        assert_eq!(picture(|_, _| 0).different_part(), 0.0);
        let text = picture(|_, y| if y < 5 { 255 } else { 30 });
        assert!(text.different_part() < LEAST_DIFFERENT);
    }

    #[test]
    fn a_picture_of_two_halves_shows_something() {
        assert_eq!(picture(|x, _| if x < 50 { 200 } else { 30 }).different_part(), 0.5);
    }

    #[test]
    fn rounding_is_no_difference() {
        assert_eq!(picture(|x, y| 100 + ((x + y) % 5) as u8).different_part(), 0.0);
    }
}
