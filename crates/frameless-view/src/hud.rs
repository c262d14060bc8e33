//! What is written over the picture: how fast, how old, and what there is to know about the scene.

use eframe::egui::{
    Align2, Color32, CornerRadius, FontId, Painter, Rect, pos2, text::LayoutJob, text::TextFormat,
    vec2,
};
use frameless::Size;
use frameless_scene::Scene;

use crate::theme;
use frameless_session::Status;

/// The lines of the HUD.
pub(crate) fn lines(status: &Status, size: Size, scene: &Scene) -> Vec<String> {
    let rate = status.samples_per_sec;
    let pixels = size.pixels();
    let mut lines = vec![
        format!("{} samples/s  {:.0} pictures/s", grouped(rate), status.pictures_per_sec),
        format!(
            "age    mean {}  max {}",
            millis(status.ages.mean_secs),
            millis(status.ages.max_secs)
        ),
        match rate > 0.0 {
            true => {
                format!("covers {}×{} in {}", size.width, size.height, millis(pixels as f64 / rate))
            }
            false => format!("{}×{}, no samples", size.width, size.height),
        },
    ];
    // Always there: a line that comes and goes would make those below it jump.
    lines.push(format!("holes  {:.1} %", 100.0 * status.ages.unknown as f64 / pixels as f64));
    lines.extend(scene.notes.iter().map(|note| shortened(note)));
    match scene.warnings.len() {
        0 => {}
        1 => lines.push("1 warning".to_owned()),
        warnings => lines.push(format!("{warnings} warnings")),
    }
    lines
}

/// Draws lines over a dark ground; returns what they cover.
pub(crate) fn paint(painter: &Painter, corner: Align2, place: Rect, text: &[Line]) -> Rect {
    const PADDING: f32 = 8.0;
    let mut job = LayoutJob::default();
    job.wrap.max_width = (place.width() - 2.0 * PADDING).max(80.0);
    for (i, line) in text.iter().enumerate() {
        let font_id = FontId::monospace(12.0);
        let format = TextFormat { font_id, color: line.colour, ..Default::default() };
        job.append(if i > 0 { "\n" } else { "" }, 0.0, format.clone());
        job.append(&line.text, 0.0, format);
    }
    let galley = painter.layout_job(job);
    let area = corner.align_size_within_rect(galley.size() + vec2(2.0, 1.5) * PADDING, place);
    painter.rect_filled(area, CornerRadius::same(4), theme::SCRIM);
    painter.galley(area.min + vec2(PADDING, 0.75 * PADDING), galley, theme::TEXT);
    area
}

/// Text and its colour.
pub(crate) struct Line {
    /// One line; wrapped where it is too long.
    pub(crate) text: String,
    /// Of all of it.
    pub(crate) colour: Color32,
}

impl Line {
    /// As most text.
    pub(crate) fn plain(text: String) -> Line {
        Line { text, colour: theme::TEXT }
    }
}

/// The area right below `above`, down to the end of `place`.
pub(crate) fn below(place: Rect, above: Rect) -> Rect {
    Rect::from_min_max(pos2(place.left(), above.bottom() + 6.0), place.max)
}

/// Whole number with thousands separated: 1,234,567. Negative or NaN: 0.
pub(crate) fn grouped(number: f64) -> String {
    let digits = (number.max(0.0).round() as u64).to_string();
    let mut written = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            written.push(',');
        }
        written.push(digit);
    }
    written
}

/// Milliseconds; seconds from ten of them on.
fn millis(secs: f64) -> String {
    match secs {
        10.0.. => format!("{} s", grouped(secs)),
        _ => format!("{} ms", grouped(1000.0 * secs)),
    }
}

// A file may say anything in its names; the HUD has room for this much.
const LONGEST_NOTE: usize = 80;

fn shortened(note: &str) -> String {
    if note.chars().count() <= LONGEST_NOTE {
        return note.to_owned();
    }
    note.chars().take(LONGEST_NOTE - 1).chain(['…']).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use frameless_session::Ages;

    #[test]
    fn thousands_are_separated() {
        for (number, want) in
            [(0.4, "0"), (999.0, "999"), (1000.0, "1,000"), (1234567.8, "1,234,568"), (-5.0, "0")]
        {
            assert_eq!(grouped(number), want);
        }
        assert_eq!(grouped(f64::NAN), "0");
    }

    #[test]
    fn the_hud_says_how_long_the_image_takes() {
        let ages = Ages { mean_secs: 0.1, max_secs: 1.5, unknown: 60 };
        let status = Status {
            scene_secs: 0.0,
            samples_per_sec: 100_000.0,
            pictures_per_sec: 60.2,
            ages,
            overlay: None,
        };
        let scene = Scene {
            notes: vec!["no light: added one".to_owned()],
            warnings: vec![String::new(); 2],
            ..Scene::default()
        };
        let lines = lines(&status, Size::new(200, 100), &scene);
        assert_eq!(
            lines,
            [
                "100,000 samples/s  60 pictures/s",
                "age    mean 100 ms  max 1,500 ms",
                "covers 200×100 in 200 ms",
                "holes  0.3 %",
                "no light: added one",
                "2 warnings"
            ]
        );
    }

    #[test]
    fn long_times_are_in_seconds() {
        assert_eq!(
            [0.0, 0.0114, 9.9, 12_345.6].map(millis),
            ["0 ms", "11 ms", "9,900 ms", "12,346 s"]
        );
    }

    #[test]
    fn long_notes_are_cut_between_characters() {
        let cut = shortened(&"ä".repeat(500));
        assert_eq!(cut.chars().count(), LONGEST_NOTE);
        assert!(cut.ends_with('…'));
    }
}
