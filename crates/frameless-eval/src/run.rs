//! One run: one scene, one algorithm, one rate, one seed, against the ideal at every refresh.

use crate::algorithm::Algorithm;
use crate::contender::{Arena, Shown};
use crate::error::EvalError;
use crate::experiment::Experiment;
use crate::ideal::{Ideals, refresh_time};
use crate::metrics::{Picture, rmse, rmse_where};
use crate::results::{Curve, RunResult};
use crate::subject::Subject;

/// Which run.
#[derive(Clone, Debug)]
pub struct Cell {
    /// The scene's name.
    pub scene: String,
    /// Who competes.
    pub algorithm: Algorithm,
    /// Samples per second.
    pub samples_per_sec: f64,
    /// Of the sampler.
    pub seed: u64,
}

/// Runs a cell. `look` is shown the picture at every refresh, with the refresh's index, and says whether to go on.
///
/// # Errors
/// If the tracer returns a colour that is not finite, or `look` said no.
pub fn run(
    cell: &Cell,
    experiment: &Experiment,
    subject: &Subject,
    ideals: &Ideals,
    look: &mut dyn FnMut(usize, &Picture) -> bool,
) -> Result<RunResult, EvalError> {
    let mut contender = cell.algorithm.contender(Arena {
        subject,
        ideals,
        size: experiment.size,
        display_hz: experiment.display_hz,
        samples_per_sec: cell.samples_per_sec,
        seed: cell.seed,
    });
    let mut shown = Shown::default();
    let (mut whole, mut changed) = (Vec::new(), Vec::new());
    for (k, ideal) in ideals.pictures.iter().enumerate() {
        contender.show(refresh_time(k, experiment.display_hz), &mut shown)?;
        whole.push(rmse(&shown.picture, ideal));
        changed.push(rmse_where(&ideals.changed[k], &shown.picture, ideal));
        if !look(k, &shown.picture) {
            return Err(EvalError::Interrupted);
        }
    }
    Ok(summary(cell, experiment, whole, changed))
}

fn summary(
    cell: &Cell,
    experiment: &Experiment,
    whole: Vec<f64>,
    changed: Vec<Option<f64>>,
) -> RunResult {
    let every_refresh = |values: Vec<Option<f64>>| Curve::new(values, 1, experiment.unscored, 0.95);
    let not_measured = || every_refresh(Vec::new());
    RunResult {
        scene: cell.scene.clone(),
        algorithm: cell.algorithm.name(),
        samples_per_sec: cell.samples_per_sec,
        seed: cell.seed,
        width: experiment.size.width,
        height: experiment.size.height,
        display_hz: experiment.display_hz,
        refreshes: experiment.refreshes,
        rmse: every_refresh(whole.into_iter().map(Some).collect()),
        psnr_db: not_measured(),
        rmse_changed: every_refresh(changed),
        ssim: not_measured(),
        flip: not_measured(),
        age_secs: not_measured(),
        oldest_secs: 0.0,
        events: Vec::new(),
        at_rest: None,
    }
}
