//! How much work something is, in traced samples: what the time left is estimated from.

use super::cells::Depth;
use crate::algorithm::Algorithm;
use crate::experiment::Experiment;

/// Measuring a picture's RMSE and making it from the canvas, per pixel, in traced samples.
const RMSE_PER_PIXEL: f64 = 0.1;
/// Every other metric together, per pixel and refresh.
const METRICS_PER_PIXEL: f64 = 0.3;
/// Encoding a picture as part of a video or still, per pixel.
const PICTURE_PER_PIXEL: f64 = 0.3;

/// The ideal pictures of a scene.
pub(super) fn ideals(experiment: &Experiment) -> u64 {
    (experiment.size.pixels() * experiment.refreshes) as u64
}

/// One refresh of a run.
pub(super) fn refresh(
    experiment: &Experiment,
    algorithm: &Algorithm,
    samples_per_sec: f64,
    depth: Depth,
) -> u64 {
    let per_pixel = match depth {
        Depth::OnlyRmse => RMSE_PER_PIXEL,
        Depth::Everything => RMSE_PER_PIXEL + METRICS_PER_PIXEL,
    };
    refresh_with(experiment, algorithm, samples_per_sec, per_pixel)
}

/// One refresh of one algorithm in pictures.
pub(super) fn pictured_refresh(experiment: &Experiment, algorithm: &Algorithm, rate: f64) -> u64 {
    refresh_with(experiment, algorithm, rate, PICTURE_PER_PIXEL)
}

fn refresh_with(
    experiment: &Experiment,
    algorithm: &Algorithm,
    samples_per_sec: f64,
    per_pixel: f64,
) -> u64 {
    let pixels = experiment.size.pixels() as f64;
    let mut traced = samples_per_sec / f64::from(experiment.display_hz);
    if traces_a_picture_at_most(algorithm) {
        traced = traced.min(pixels);
    }
    (traced + per_pixel * pixels) as u64
}

/// Of frames that nobody sees nothing is traced, and the oracle traces no pixel twice between refreshes.
fn traces_a_picture_at_most(algorithm: &Algorithm) -> bool {
    use Algorithm::{Framed, FramedSingle, LowRes, OracleHold};
    matches!(algorithm, Framed | FramedSingle | LowRes { .. } | OracleHold)
}
