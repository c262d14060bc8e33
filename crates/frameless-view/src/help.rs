//! The keys, in the window.

use eframe::egui::{Align2, Context, Grid, RichText, Window, vec2};

use crate::theme;

const KEYS: [(&str, &str); 14] = [
    ("left drag", "orbit"),
    ("right or middle drag", "pan"),
    ("wheel", "zoom"),
    ("W A S D, Q E", "fly; with shift: fast"),
    ("double click, Home", "back to the scene's own camera"),
    ("space", "play or pause"),
    ("0", "the picture"),
    ("1 2 3", "change, source age, tile probability"),
    ("4 5 6", "sampling rate, learned rate, holes"),
    ("P", "hide or show the panels"),
    ("F12", "save the picture as PNG"),
    ("drop a .glb or .gltf", "open it"),
    ("Esc", "dismiss messages and this list"),
    ("H or ?", "this list"),
];

/// Draws the list of keys in the middle of the window.
pub(crate) fn show(context: &Context, open: &mut bool) {
    Window::new("Keys")
        .open(open)
        .collapsible(false)
        .resizable(false)
        .anchor(Align2::CENTER_CENTER, vec2(0.0, 0.0))
        .show(context, |ui| {
            Grid::new("keys").num_columns(2).spacing(vec2(24.0, 6.0)).show(ui, |ui| {
                for (key, what) in KEYS {
                    ui.label(RichText::new(key).monospace().color(theme::ACCENT));
                    ui.label(what);
                    ui.end_row();
                }
            });
        });
}
