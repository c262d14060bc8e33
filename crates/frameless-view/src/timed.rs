//! What the window does by itself after a while, for tests and measurements: a screenshot, closing, a summary.

use std::path::PathBuf;
use std::time::Duration;

use eframe::egui::{ColorImage, Context, ViewportCommand};
use frameless::Size;

use frameless_session::{Status, snapshot};

use crate::ViewOptions;

pub(crate) struct Timed {
    screenshot_after: Option<(Duration, PathBuf)>,
    exit_after: Option<Duration>,
    pictures: u64,
    paint_secs: f64,
    samples_per_sec: f64,
}

impl Timed {
    pub(crate) fn new(options: &ViewOptions) -> Timed {
        Timed {
            screenshot_after: options.screenshot_after.clone(),
            exit_after: options.exit_after,
            pictures: 0,
            paint_secs: 0.0,
            samples_per_sec: 0.0,
        }
    }

    /// A picture was shown; `paint_secs` is what the paint before it cost.
    pub(crate) fn shown(&mut self, status: &Status, paint_secs: f64) {
        self.pictures += 1;
        self.paint_secs += paint_secs;
        self.samples_per_sec = status.samples_per_sec;
    }

    /// Does what is due, `now_secs` after the start.
    pub(crate) fn act(&mut self, context: &Context, now_secs: f64) {
        let due = |after: Duration| now_secs >= after.as_secs_f64();
        if let Some((_, path)) = self.screenshot_after.take_if(|(after, _)| due(*after)) {
            context.request_screenshot(move |image| {
                if let Err(error) = save(&image, &path) {
                    log::error!("{error:#}");
                }
            });
        }
        if self.exit_after.is_some_and(due) {
            context.send_viewport_cmd(ViewportCommand::Close);
        }
    }

    /// Says in the log how it went.
    pub(crate) fn summarise(&self) {
        let mean_ms = 1000.0 * self.paint_secs / self.pictures.max(1) as f64;
        log::info!(
            "{} pictures shown, {mean_ms:.1} ms of painting each, {:.0} samples/s at the end",
            self.pictures,
            self.samples_per_sec
        );
    }
}

fn save(image: &ColorImage, path: &std::path::Path) -> anyhow::Result<()> {
    let [width, height] = image.size.map(|side| side as u32);
    let rgba: Vec<[u8; 4]> = image.pixels.iter().map(|colour| colour.to_array()).collect();
    snapshot::save(path, Size::new(width, height), &rgba)
}
