//! What the colours of an overlay mean: the colour bar of a heat map, or a name beside each colour.

use eframe::egui::{
    Align2, Color32, CornerRadius, FontId, Mesh, Painter, Pos2, Rect, Shape, pos2, vec2,
};

use frameless_session::heatmap::{self, Scale};
use frameless_session::{Colours, Legend};

use crate::theme;

const WIDTH: f32 = 280.0;
const BAR_HEIGHT: f32 = 10.0;
// One quad per 8 points: between them the driver interpolates, which no eye can tell from the map itself.
const COLUMNS: usize = 35;

/// Draws the legend at the bottom left of `place`.
pub(crate) fn paint(painter: &Painter, place: Rect, legend: &Legend) {
    let size = vec2(WIDTH + 32.0, 56.0);
    let corner = place.left_bottom() + vec2(10.0, -10.0 - size.y);
    let background = Rect::from_min_size(corner, size);
    painter.rect_filled(background, CornerRadius::same(4), theme::SCRIM);
    painter.text(
        corner + vec2(16.0, 6.0),
        Align2::LEFT_TOP,
        legend.title,
        FontId::proportional(12.0),
        theme::TEXT,
    );
    match &legend.colours {
        Colours::Scale(scale) => paint_scale(painter, corner + vec2(16.0, 24.0), scale),
        Colours::Names(names) => paint_names(painter, corner + vec2(16.0, 30.0), names),
    }
}

fn paint_scale(painter: &Painter, corner: Pos2, scale: &Scale) {
    let bar = Rect::from_min_size(corner, vec2(WIDTH, BAR_HEIGHT));
    painter.add(Shape::mesh(colours(bar)));
    for (at, value) in scale.ticks() {
        let below = pos2(bar.left() + at * bar.width(), bar.bottom() + 3.0);
        let align = Align2::CENTER_TOP;
        painter.text(below, align, number(value), FontId::monospace(11.0), theme::TEXT);
    }
}

fn paint_names(painter: &Painter, corner: Pos2, names: &[([u8; 4], &str)]) {
    let mut corner = corner;
    for ([r, g, b, _], name) in names {
        let swatch = Rect::from_min_size(corner, vec2(BAR_HEIGHT, BAR_HEIGHT));
        painter.rect_filled(swatch, CornerRadius::ZERO, Color32::from_rgb(*r, *g, *b));
        let beside = swatch.right_center() + vec2(5.0, 0.0);
        let font = FontId::proportional(12.0);
        let written = painter.text(beside, Align2::LEFT_CENTER, *name, font, theme::TEXT);
        corner.x = written.right() + 14.0;
    }
}

fn colours(bar: Rect) -> Mesh {
    let mut mesh = Mesh::default();
    for i in 0..=COLUMNS {
        let at = i as f32 / COLUMNS as f32;
        let [r, g, b, _] = heatmap::colour(at);
        let x = bar.left() + at * bar.width();
        mesh.colored_vertex(pos2(x, bar.top()), Color32::from_rgb(r, g, b));
        mesh.colored_vertex(pos2(x, bar.bottom()), Color32::from_rgb(r, g, b));
    }
    for i in 0..COLUMNS as u32 {
        mesh.add_triangle(2 * i, 2 * i + 1, 2 * i + 2);
        mesh.add_triangle(2 * i + 1, 2 * i + 3, 2 * i + 2);
    }
    mesh
}

/// At most three significant digits; powers of ten where plain digits would be long.
fn number(value: f32) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    if !(1e-3..1e4).contains(&value.abs()) {
        // 2.50e-4 → 2.5e-4, 1.00e-4 → 1e-4.
        let written = format!("{value:.2e}");
        let (digits, power) = written.split_once('e').unwrap_or((&written, "0"));
        let digits = digits.trim_end_matches('0').trim_end_matches('.');
        return format!("{digits}e{power}");
    }
    let decimals = (2 - value.abs().log10().floor() as i32).clamp(0, 5) as usize;
    let written = format!("{value:.decimals$}");
    match written.contains('.') {
        true => written.trim_end_matches('0').trim_end_matches('.').to_owned(),
        false => written,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short() {
        for (value, want) in [
            (0.0, "0"),
            (0.5, "0.5"),
            (1.0, "1"),
            (2.5, "2.5"),
            (12.5, "12.5"),
            (1250.0, "1250"),
            (100.0, "100"),
            (20_000.0, "2e4"),
            (1e-4, "1e-4"),
            (0.00025, "2.5e-4"),
            (0.001, "0.001"),
        ] {
            assert_eq!(number(value), want);
        }
    }
}
