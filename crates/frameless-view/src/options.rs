//! What the window is opened with.

use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use frameless_scene::Scene;
use frameless_session::{Opener, Settings};

/// What the window is opened with.
#[derive(Clone)]
pub struct ViewOptions {
    /// What is shown first.
    pub scene: Arc<Scene>,
    /// Where the sliders stand first.
    pub settings: Settings,
    /// How light is followed.
    pub tracing: frameless_trace::Settings,
    /// Threads that trace; 0: one per core.
    pub threads: usize,
    /// Of all random choices.
    pub seed: u64,
    /// For files that the user drops on the window or names in its panel.
    pub opener: Opener,
    /// Where F12 puts pictures.
    pub save_to: PathBuf,
    /// The window's width and height at first, in points.
    pub window: [f32; 2],
    /// Save a picture of the whole window to this file once it has been open for so long.
    pub screenshot_after: Option<(Duration, PathBuf)>,
    /// Close the window once it has been open for so long.
    pub exit_after: Option<Duration>,
}

impl ViewOptions {
    /// `scene` in a window of 1280 × 800, everything else as it is by default.
    pub fn new(scene: Arc<Scene>) -> ViewOptions {
        ViewOptions {
            scene,
            settings: Settings::default(),
            tracing: frameless_trace::Settings::default(),
            threads: 0,
            seed: 1,
            opener: Opener::default(),
            save_to: PathBuf::from("."),
            window: [1280.0, 800.0],
            screenshot_after: None,
            exit_after: None,
        }
    }
}
