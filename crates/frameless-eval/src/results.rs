//! `results.json`: what came out, for programs. Fields are documented one by one in docs/evaluation.md.

use serde::{Deserialize, Serialize};

use crate::metrics::{mean, psnr_db, quantile};

/// Version of the format; increased when a field changes its meaning or goes away.
pub const RESULTS_VERSION: u32 = 2;

/// The whole file.
#[derive(Clone, Debug, Deserialize, PartialEq, Serialize)]
#[serde(deny_unknown_fields)]
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
    /// How many times more samples per second an opponent needs to be as good; empty if the experiment does not ask.
    pub equal_quality: Vec<EqualQuality>,
}

/// One run.
#[derive(Clone, Debug, Deserialize, PartialEq, Serialize)]
#[serde(deny_unknown_fields)]
pub struct RunResult {
    /// The scene's name.
    pub scene: String,
    /// The algorithm's name.
    pub algorithm: String,
    /// Samples per second of the simulated clock.
    pub samples_per_sec: f64,
    /// The seed of whatever is random.
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
    pub rmse: Curve,
    /// Peak signal-to-noise ratio of the same, −20 log10(RMSE), in dB; `null` where the pictures are equal (infinite). `mean`
    /// is that of the mean squared error, not of the decibels, where refreshes without an error could not count.
    pub psnr_db: Curve,
    /// RMSE over the pixels whose ideal has changed by more than 0.04 within the last 100 ms; `null` where none has.
    pub rmse_changed: Curve,
    /// Structural similarity to the ideal (Wang et al. 2004), over luma, in [−1, 1], at every so many-th refresh; `null` if a side
    /// is shorter than 11 pixels.
    pub ssim: Curve,
    /// Mean FLIP difference from the ideal (Andersson et al. 2020), in [0, 1], at every so many-th refresh.
    pub flip: Curve,
    /// Mean age over the pixels, in seconds: how long ago the moment was that a pixel shows.
    pub age_secs: Curve,
    /// The oldest pixel at any scored refresh, in seconds.
    pub oldest_secs: f64,
    /// One entry per scripted event of the scene that lies within the run.
    pub events: Vec<EventResult>,
    /// After all motion has ended: RMSE against an ideal of 64 samples per pixel; `null` if something moves to the end.
    pub at_rest: Option<AtRest>,
}

/// A value over time, at some or all refreshes.
#[derive(Clone, Debug, Deserialize, PartialEq, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Curve {
    /// Mean over the scored refreshes that have a value; `null` if none has.
    pub mean: Option<f64>,
    /// 95th percentile over the same. For PSNR and SSIM, where low is bad, the 5th. `null` of fewer than 20 values.
    pub p95: Option<f64>,
    /// Entry i is at refresh `(i + 1) · every − 1`, and refresh k at (k + 1) / display_hz seconds. Unscored refreshes are
    /// included. 0: not measured.
    pub every: usize,
    /// `null` where there is no value.
    pub values: Vec<Option<f64>>,
}

/// A percentile of fewer values would be one of their extremes.
const FEWEST_FOR_A_PERCENTILE: usize = 20;

impl Curve {
    /// `values` at every `every`-th refresh; `tail`: 0.95 where high values are bad, 0.05 where low ones are.
    pub(crate) fn new(values: Vec<Option<f64>>, every: usize, unscored: usize, tail: f64) -> Curve {
        let scored = scored(&values, every, unscored);
        let p95 = (scored.len() >= FEWEST_FOR_A_PERCENTILE).then(|| quantile(scored.clone(), tail));
        Curve { mean: mean(scored), p95, every, values }
    }

    /// PSNR in dB from the RMSE of every refresh.
    pub(crate) fn psnr_db(rmse: &[f64], unscored: usize) -> Curve {
        let errors = Curve::new(rmse.iter().copied().map(Some).collect(), 1, unscored, 0.95);
        let squares = scored(&errors.values, 1, unscored).into_iter().map(|rmse| rmse * rmse);
        Curve {
            mean: mean(squares).and_then(|mse| psnr_db(mse.sqrt())),
            p95: errors.p95.and_then(psnr_db),
            every: 1,
            values: rmse.iter().map(|&rmse| psnr_db(rmse)).collect(),
        }
    }
}

fn scored(values: &[Option<f64>], every: usize, unscored: usize) -> Vec<f64> {
    let is_scored =
        |(i, value): (usize, &Option<f64>)| value.filter(|_| (i + 1) * every > unscored);
    values.iter().enumerate().filter_map(is_scored).collect()
}

/// How fast an algorithm follows a sudden change.
#[derive(Clone, Debug, Deserialize, PartialEq, Serialize)]
#[serde(deny_unknown_fields)]
pub struct EventResult {
    /// The event's name.
    pub name: String,
    /// When it happens, in seconds.
    pub secs: f64,
    /// Pixels whose ideal it changes by more than 0.04 in a channel: against the ideal without the event, or 100 ms earlier where
    /// something stops or the scene acts by itself.
    pub changed_pixels: usize,
    /// From the event (the end of a gradual one) to the first refresh at which 90 % of them are within 0.05 of the ideal in all
    /// channels, in seconds; `null` if that does not happen before the next event or the end, or if no pixel changes.
    pub latency_secs: Option<f64>,
}

/// How well an algorithm finishes a picture at rest.
#[derive(Clone, Debug, Deserialize, PartialEq, Serialize)]
#[serde(deny_unknown_fields)]
pub struct AtRest {
    /// The first refresh from which on nothing moves any more, in seconds.
    pub since_secs: f64,
    /// RMSE against the ideal of 64 samples per pixel, at every refresh from then on.
    pub rmse: Vec<f64>,
}

/// How many times more samples per second an opponent needs to have the mean RMSE of an algorithm.
#[derive(Clone, Debug, Deserialize, PartialEq, Serialize)]
#[serde(deny_unknown_fields)]
pub struct EqualQuality {
    /// The scene's name.
    pub scene: String,
    /// Whose quality is to be reached.
    pub algorithm: String,
    /// Who needs more (or fewer) samples.
    pub opponent: String,
    /// Samples per second of the algorithm.
    pub samples_per_sec: f64,
    /// How many times as many the opponent needs, or the end of the range that was scanned.
    pub factor: f64,
    /// What `factor` is.
    pub bound: Bound,
}

/// Whether a factor is exact or beyond the range that was scanned.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Bound {
    /// Interpolated between two rates that were run.
    Exact,
    /// The opponent was worse even at this factor: the true one is larger.
    MoreThan,
    /// The opponent was better even at this factor: the true one is smaller.
    LessThan,
}
