//! Reconstruction `hold`: every pixel shows its newest sample until the next one.

use super::Findings;
use crate::{Canvas, Display, Kept, Reconstruction, Refresh};

/// See the module.
#[derive(Default)]
pub struct Hold {
    picture: Vec<[f32; 3]>,
}

impl Reconstruction for Hold {
    fn keep(&mut self, kept: &Kept<'_>, display: &Display, findings: &mut Findings) {
        display.changes(kept.new, kept.old, &mut findings.changes);
    }

    fn refresh(&mut self, refresh: &Refresh<'_>, canvas: &mut Canvas) {
        self.picture.clear();
        self.picture.extend(canvas.rgb().iter().map(|&rgb| refresh.display.encode(rgb)));
    }

    fn picture(&self) -> &[[f32; 3]] {
        &self.picture
    }
}

/// The picture now: sRGB-encoded RGBA, row-major from the top, alpha 255.
pub fn hold(canvas: &Canvas, display: &Display) -> Vec<[u8; 4]> {
    let mut rgba8 = Vec::new();
    hold_into(canvas, display, &mut rgba8);
    rgba8
}

/// As [`hold`], into memory that is there already.
pub fn hold_into(canvas: &Canvas, display: &Display, rgba8: &mut Vec<[u8; 4]>) {
    rgba8.clear();
    rgba8.extend(canvas.rgb().iter().map(|&rgb| display.encode_rgba8(rgb)));
}
