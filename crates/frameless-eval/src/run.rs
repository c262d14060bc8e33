//! One run: one scene, one algorithm, one rate, one seed, against the ideal at every refresh.

use frameless::{ReconstructionKind, Sampler};

use crate::algorithm::Algorithm;
use crate::contender::{Arena, Contender, Shown};
use crate::contenders::Frameless;
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
    let contender = cell.algorithm.contender(arena(cell, experiment, subject, ideals));
    judge(contender, cell, experiment, ideals, look)
}

/// As [`run`], but the caller's sampler chooses instead of the algorithm's own; the algorithm only says how its samples are shown,
/// which is `hold` if it is not a frameless one.
///
/// # Errors
/// As [`run`].
pub fn run_sampler(
    sampler: Box<dyn Sampler>,
    cell: &Cell,
    experiment: &Experiment,
    subject: &Subject,
    ideals: &Ideals,
    look: &mut dyn FnMut(usize, &Picture) -> bool,
) -> Result<RunResult, EvalError> {
    let reconstruction = match cell.algorithm {
        Algorithm::Frameless(_, reconstruction) => reconstruction,
        _ => ReconstructionKind::Hold,
    };
    let arena = arena(cell, experiment, subject, ideals);
    let contender = Frameless::new(arena, sampler, reconstruction);
    judge(Box::new(contender), cell, experiment, ideals, look)
}

fn arena<'a>(
    cell: &Cell,
    experiment: &Experiment,
    subject: &'a Subject,
    ideals: &'a Ideals,
) -> Arena<'a> {
    Arena {
        subject,
        ideals,
        size: experiment.size,
        display_hz: experiment.display_hz,
        samples_per_sec: cell.samples_per_sec,
        seed: cell.seed,
    }
}

fn judge(
    mut contender: Box<dyn Contender + '_>,
    cell: &Cell,
    experiment: &Experiment,
    ideals: &Ideals,
    look: &mut dyn FnMut(usize, &Picture) -> bool,
) -> Result<RunResult, EvalError> {
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
