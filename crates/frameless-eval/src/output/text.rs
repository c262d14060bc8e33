//! Letters in pictures, drawn by the plotting library in a font that comes with the program: there may be none
//! on the machine.

use std::sync::Once;

use image::RgbImage;
use plotters::prelude::*;

const FONT: &str = "sans-serif";

/// Makes the font known to the plotting library.
pub(crate) fn register_font() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        let registered = plotters::style::register_font(
            FONT,
            FontStyle::Normal,
            epaint_default_fonts::UBUNTU_LIGHT,
        );
        assert!(registered.is_ok(), "the embedded font is a font");
    });
}

/// Writes `text` in light grey with its top-left corner at (x, y).
pub(crate) fn draw_text(image: &mut RgbImage, text: &str, x: u32, y: u32, height_px: u32) {
    register_font();
    let (width, height) = image.dimensions();
    let area = BitMapBackend::with_buffer(image, (width, height)).into_drawing_area();
    let style = TextStyle::from((FONT, height_px).into_font()).color(&RGBColor(235, 235, 235));
    let drawn = area.draw_text(text, &style, (x as i32, y as i32));
    assert!(drawn.is_ok(), "drawing into memory cannot fail");
}
