//! One run: one scene, one algorithm, one rate, one seed, against the ideal at every refresh.

use crate::algorithm::Algorithm;
use crate::contender::{Arena, Shown};
use crate::error::EvalError;
use crate::experiment::Experiment;
use crate::ideal::{Ideals, refresh_time};
use crate::metrics::Picture;
use crate::record::Record;
use crate::results::RunResult;
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
    let (mut shown, mut record) = (Shown::default(), Record::new(experiment, ideals));
    for k in 0..experiment.refreshes {
        contender.show(refresh_time(k, experiment.display_hz), &mut shown)?;
        record.add(k, &shown);
        if !look(k, &shown.picture) {
            return Err(EvalError::Interrupted);
        }
    }
    Ok(record.finish(cell))
}
