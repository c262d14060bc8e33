//! The whole of an experiment: runs, equal-quality factors, pictures, report. What is finished is kept; results appear whole or
//! not at all.

mod cells;
mod cost;
mod equal_quality;
mod factor;
mod fingerprint;
mod parallel;
mod pictures;
mod progress;
mod publish;
mod scene_work;
mod store;
mod versions;

pub use progress::Progress;

use std::path::Path;

use self::progress::Work;
use self::publish::publish;
use self::scene_work::{SceneOutcome, SceneWork};
use self::store::Store;
use crate::error::EvalError;
use crate::experiment::Experiment;
use crate::output::OutputFolder;
use crate::results::Results;

/// Runs an experiment and writes `results.json`, `report.html`, and `pictures/` with error curves, stills and videos into the
/// folder `out`; these appear when everything is finished, in place of earlier ones. Every finished run is kept in `out/cells`,
/// and not run again by a later call that needs the same.
///
/// # Errors
/// If a scene cannot be loaded, the output not written, or the user interrupts ([`EvalError::Unfinished`]); finished runs
/// are kept then.
pub fn compare(
    experiment: &Experiment,
    out: &Path,
    progress: &dyn Progress,
) -> Result<Results, EvalError> {
    let folder = OutputFolder::open(out)?;
    let store = Store::new(folder.cells());
    let scenes = experiment.scenes.iter().map(|spec| SceneWork::new(experiment, spec, &store));
    let mut scenes: Vec<SceneWork> = scenes.collect::<Result<_, _>>()?;
    let work = Work::new(progress);
    work.add(0);
    scenes.iter_mut().for_each(|scene| scene.plan(&work));

    // One after the other: the ideal pictures of a scene fill a good part of the memory.
    let outcomes = scenes.iter_mut().map(|scene| scene.finish(&work)).collect::<Result<_, _>>();
    let outcomes: Vec<SceneOutcome> = outcomes.map_err(|error| match error {
        EvalError::Interrupted => EvalError::Unfinished {
            kept: scenes.iter().map(SceneWork::finished_runs).sum(),
            wanted: scenes.iter().map(SceneWork::runs).sum(),
            out: folder.path().to_path_buf(),
        },
        error => error,
    })?;
    work.stage("writing");
    publish(experiment, outcomes, &folder)
}
