//! Pictures of the same instant side by side, each with its name above it.

use std::path::Path;

use frameless::Size;
use image::RgbImage;

use super::text::draw_text;
use crate::error::EvalError;

/// Width and height of a row of `count` pictures (at least one) with their names.
pub(crate) fn strip_size(panel: Size, count: usize) -> Size {
    let count = count as u32;
    // H.264 with 4:2:0 chroma needs even sides.
    let even = |n: u32| n.next_multiple_of(2);
    Size::new(even(count * panel.width + (count - 1) * GAP_PX), even(BAR_PX + panel.height))
}

/// The layout of a row of pictures.
pub(crate) struct Strip {
    panel: Size,
    /// Everything but the pictures: background and names.
    blank: RgbImage,
}

const BAR_PX: u32 = 28;
const GAP_PX: u32 = 4;
const BACKGROUND: [u8; 3] = [24, 24, 27];

impl Strip {
    pub(crate) fn new(panel: Size, names: &[String]) -> Strip {
        let Size { width, height } = strip_size(panel, names.len());
        let mut blank = RgbImage::from_pixel(width, height, BACKGROUND.into());
        for (i, name) in names.iter().enumerate() {
            draw_text(&mut blank, name, i as u32 * (panel.width + GAP_PX) + 6, 5, 18);
        }
        Strip { panel, blank }
    }

    pub(crate) fn size(&self) -> Size {
        Size::new(self.blank.width(), self.blank.height())
    }

    /// The pictures (8-bit sRGB, row-major) in their places.
    pub(crate) fn assemble(&self, panels: &[Vec<[u8; 3]>]) -> RgbImage {
        let mut image = self.blank.clone();
        for (i, panel) in panels.iter().enumerate() {
            let x0 = i as u32 * (self.panel.width + GAP_PX);
            for (pixel, &rgb) in panel.iter().enumerate() {
                let (x, y) = self.panel.xy(pixel as u32);
                image.put_pixel(x0 + x, BAR_PX + y, rgb.into());
            }
        }
        image
    }
}

/// A PNG of one instant.
pub(crate) fn write_still(
    path: &Path,
    strip: &Strip,
    panels: &[Vec<[u8; 3]>],
) -> Result<(), EvalError> {
    strip.assemble(panels).save(path).map_err(|e| EvalError::unwritable(path, e))
}
