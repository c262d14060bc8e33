//! From outcomes to the folder that people open.

use std::path::Path;

use super::pictures::{VIDEO, pictured_rate, still_name};
use super::scene_work::SceneOutcome;
use crate::error::EvalError;
use crate::experiment::Experiment;
use crate::output::{OutputFolder, plot_curves};
use crate::results::{RESULTS_VERSION, Results, RunResult};
use crate::results_file::FORMAT;

/// Writes results, report and pictures, and lets them appear.
pub(super) fn publish(
    experiment: &Experiment,
    outcomes: Vec<SceneOutcome>,
    folder: &OutputFolder,
) -> Result<Results, EvalError> {
    let partial = folder.partial()?;
    let pictures = partial.path().join("pictures");
    std::fs::create_dir(&pictures).map_err(|e| EvalError::unwritable(&pictures, e))?;
    for (spec, outcome) in experiment.scenes.iter().zip(&outcomes) {
        copy_pictures(experiment, &spec.name, &outcome.pictures, &pictures)?;
        write_curves(experiment, &spec.name, &outcome.runs, &pictures)?;
    }
    let mut results = Results {
        format: FORMAT.into(),
        version: RESULTS_VERSION,
        title: experiment.title.clone(),
        unscored_refreshes: experiment.unscored,
        runs: Vec::new(),
        equal_quality: Vec::new(),
    };
    for outcome in outcomes {
        results.runs.extend(outcome.runs);
        results.equal_quality.extend(outcome.equal_quality);
    }
    let json = serde_json::to_string_pretty(&results).expect("plain data");
    write(&partial.path().join("results.json"), json + "\n")?;
    write(&partial.path().join("report.html"), String::new())?;
    folder.publish(partial)?;
    Ok(results)
}

/// Stills and video under names that say what they show.
fn copy_pictures(
    experiment: &Experiment,
    scene: &str,
    from: &Path,
    to: &Path,
) -> Result<(), EvalError> {
    let rate = pictured_rate(experiment);
    let copy = |file: &str, name: String| {
        let to = to.join(name);
        std::fs::copy(from.join(file), &to).map_err(|e| EvalError::unwritable(&to, e))
    };
    for &k in &experiment.stills {
        let still = still_name(experiment, k);
        copy(&still, format!("{scene}-{rate}-{still}"))?;
    }
    if experiment.video {
        copy(VIDEO, format!("{scene}-{rate}.mp4"))?;
    }
    Ok(())
}

/// One chart per rate.
fn write_curves(
    experiment: &Experiment,
    scene: &str,
    runs: &[RunResult],
    to: &Path,
) -> Result<(), EvalError> {
    for &rate in &experiment.samples_per_sec {
        let at_rate: Vec<&RunResult> =
            runs.iter().filter(|run| run.samples_per_sec == rate).collect();
        plot_curves(&to.join(format!("{scene}-{rate}-rmse.svg")), scene, &at_rate)?;
    }
    Ok(())
}

fn write(path: &Path, text: String) -> Result<(), EvalError> {
    std::fs::write(path, text).map_err(|e| EvalError::unwritable(path, e))
}
