//! Pictures of the same instant side by side, each with its name above it.

use std::path::Path;

use frameless::Size;
use image::RgbImage;

use super::text::draw_text;
use crate::error::EvalError;

/// An 8-bit sRGB picture, row-major.
pub(crate) type Rgb8 = Vec<[u8; 3]>;

const BAR_PX: u32 = 28;
const GAP_PX: u32 = 4;
const BACKGROUND: [u8; 3] = [24, 24, 27];
/// More than this in a row are wider than most screens, and a dozen wider than H.264 allows.
const MOST_COLUMNS: usize = 4;

/// Width and height of `count` pictures (at least one) with their names, in rows of at most four.
pub(crate) fn strip_size(panel: Size, count: usize) -> Size {
    let columns = columns(count);
    let rows = count.div_ceil(columns) as u32;
    // H.264 with 4:2:0 chroma needs even sides.
    let even = |n: u32| n.next_multiple_of(2);
    let columns = columns as u32;
    Size::new(
        even(columns * panel.width + (columns - 1) * GAP_PX),
        even(rows * (BAR_PX + panel.height) + (rows - 1) * GAP_PX),
    )
}

/// As few rows as possible, and these as even as possible.
fn columns(count: usize) -> usize {
    count.div_ceil(count.div_ceil(MOST_COLUMNS))
}

/// The layout of some pictures beside each other.
pub(crate) struct Strip {
    panel: Size,
    columns: usize,
    /// Everything but the pictures: background and names.
    blank: RgbImage,
}

impl Strip {
    /// For one picture per name; at least one.
    pub(crate) fn new(panel: Size, names: &[String]) -> Strip {
        let Size { width, height } = strip_size(panel, names.len());
        let blank = RgbImage::from_pixel(width, height, BACKGROUND.into());
        let mut strip = Strip { panel, columns: columns(names.len()), blank };
        for (i, name) in names.iter().enumerate() {
            let (x, y) = strip.place(i);
            draw_text(&mut strip.blank, name, x + 6, y - BAR_PX + 5, 18);
        }
        strip
    }

    pub(crate) fn size(&self) -> Size {
        Size::new(self.blank.width(), self.blank.height())
    }

    /// The pictures in their places.
    pub(crate) fn assemble<'a>(&self, pictures: impl IntoIterator<Item = &'a Rgb8>) -> RgbImage {
        let mut image = self.blank.clone();
        for (i, picture) in pictures.into_iter().enumerate() {
            let (x0, y0) = self.place(i);
            for (pixel, &rgb) in picture.iter().enumerate() {
                let (x, y) = self.panel.xy(pixel as u32);
                image.put_pixel(x0 + x, y0 + y, rgb.into());
            }
        }
        image
    }

    /// The top-left corner of picture `i`; its name stands above it.
    fn place(&self, i: usize) -> (u32, u32) {
        let (column, row) = ((i % self.columns) as u32, (i / self.columns) as u32);
        let x = column * (self.panel.width + GAP_PX);
        (x, BAR_PX + row * (BAR_PX + self.panel.height + GAP_PX))
    }
}

/// A PNG of one instant.
pub(crate) fn write_still(path: &Path, image: &RgbImage) -> Result<(), EvalError> {
    image.save(path).map_err(|e| EvalError::unwritable(path, e))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_few_and_even_and_every_picture_fits() {
        for (count, rows_of) in [(1, 1), (3, 3), (4, 4), (5, 3), (8, 4), (9, 3), (10, 4), (13, 4)] {
            assert_eq!(columns(count), rows_of, "{count}");
            let panel = Size::new(33, 21);
            let names: Vec<String> = (0..count).map(|i| i.to_string()).collect();
            let strip = Strip::new(panel, &names);
            let white: Vec<Rgb8> = vec![vec![[255; 3]; panel.pixels()]; count];
            let image = strip.assemble(&white);
            let size = strip_size(panel, count);
            assert_eq!((image.width(), image.height()), (size.width, size.height));
            assert!(size.width.is_multiple_of(2) && size.height.is_multiple_of(2));
            let drawn = image.pixels().filter(|pixel| pixel.0 == [255; 3]).count();
            assert!(drawn >= count * panel.pixels(), "{count}: pictures cover each other");
        }
    }
}
