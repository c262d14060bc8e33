//! `results.json`: what came out, for programs. Fields are documented one by one in docs/evaluation.md.

use serde::{Deserialize, Serialize};

/// Version of the format; increased when a field changes its meaning or goes away.
pub const RESULTS_VERSION: u32 = 1;

/// The whole file.
#[derive(Clone, Debug, Deserialize, PartialEq, Serialize)]
pub struct Results {
    /// Always "frameless results".
    pub format: String,
    /// [`RESULTS_VERSION`].
    pub version: u32,
    /// The experiment's title.
    pub title: String,
    /// Refreshes at the start that are not scored.
    pub unscored_refreshes: usize,
    /// One entry per run, in the experiment's order: scenes, rates, algorithms, seeds.
    pub runs: Vec<RunResult>,
}

/// One run.
#[derive(Clone, Debug, Deserialize, PartialEq, Serialize)]
pub struct RunResult {
    /// The scene's name.
    pub scene: String,
    /// The algorithm's name.
    pub algorithm: String,
    /// Samples per second of the simulated clock.
    pub samples_per_sec: f64,
    /// The sampler's seed.
    pub seed: u64,
    /// Pixels per row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Refreshes of the display per second.
    pub display_hz: u32,
    /// Refreshes in the run, the unscored ones included.
    pub refreshes: usize,
    /// Root mean squared error against the ideal, over all pixels and channels, in sRGB [0, 1].
    pub rmse: Rmse,
    /// The same over the pixels whose ideal has changed by more than 0.04 within the last 100 ms.
    pub rmse_changed: Mean,
}

/// Error over time.
#[derive(Clone, Debug, Deserialize, PartialEq, Serialize)]
pub struct Rmse {
    /// Mean over the scored refreshes.
    pub mean: f64,
    /// 95th percentile over the scored refreshes.
    pub p95: f64,
    /// At every refresh, the unscored ones included; refresh k is at (k + 1) / display_hz seconds.
    pub curve: Vec<f64>,
}

/// A mean over those refreshes for which the value exists.
#[derive(Clone, Debug, Deserialize, PartialEq, Serialize)]
pub struct Mean {
    /// `null` if there was none.
    pub mean: Option<f64>,
}
