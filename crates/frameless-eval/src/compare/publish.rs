//! From outcomes to the folder that people open.

use std::path::Path;

use super::pictures::{VIDEO, panel_name, pictured_rate, pictured_refreshes, still_name};
use super::scene_work::SceneOutcome;
use crate::algorithm::Algorithm;
use crate::error::EvalError;
use crate::experiment::Experiment;
use crate::ideal::refresh_time;
use crate::output::{Instant, OutputFolder, Report, ScenePictures, error_chart};
use crate::results::{RESULTS_VERSION, Results};
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
    let mut results = Results {
        format: FORMAT.into(),
        version: RESULTS_VERSION,
        title: experiment.title.clone(),
        unscored_refreshes: experiment.unscored,
        runs: Vec::new(),
        equal_quality: Vec::new(),
    };
    let mut in_report = Vec::new();
    for (spec, outcome) in experiment.scenes.iter().zip(outcomes) {
        copy_pictures(experiment, &spec.name, &outcome.pictures, &pictures)?;
        in_report.push(scene_pictures(experiment, &outcome.pictures));
        results.runs.extend(outcome.runs);
        results.equal_quality.extend(outcome.equal_quality);
    }
    for (scene, rate) in scenes_and_rates(&results) {
        let svg = error_chart(&results, &scene, rate).standalone();
        write(&pictures.join(format!("{scene}-{rate}-rmse.svg")), svg)?;
    }
    let pictured_rate = pictured_rate(experiment);
    let report = Report { results: &results, pictured_rate, pictures: in_report };
    write(&partial.path().join("report.html"), report.page()?)?;
    let json = serde_json::to_string_pretty(&results).expect("plain data");
    write(&partial.path().join("results.json"), json + "\n")?;
    folder.publish(partial)?;
    Ok(results)
}

fn scenes_and_rates(results: &Results) -> Vec<(String, f64)> {
    let rates = results.rates();
    let of =
        |scene: String| rates.iter().map(move |&rate| (scene.clone(), rate)).collect::<Vec<_>>();
    results.scenes().into_iter().flat_map(of).collect()
}

/// Where the report finds the pictures of a scene.
fn scene_pictures(experiment: &Experiment, folder: &Path) -> ScenePictures {
    let names = || experiment.algorithms.iter().map(Algorithm::name).enumerate();
    let instant = |refresh: usize| Instant {
        refresh,
        secs: refresh_time(refresh, experiment.display_hz).secs(),
        ideal: folder.join(panel_name(refresh, None)),
        panels: names()
            .map(|(i, name)| (name, folder.join(panel_name(refresh, Some(i)))))
            .collect(),
    };
    ScenePictures {
        video: experiment.video.then(|| folder.join(VIDEO)),
        instants: pictured_refreshes(experiment).into_iter().map(instant).collect(),
    }
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

fn write(path: &Path, text: String) -> Result<(), EvalError> {
    std::fs::write(path, text).map_err(|e| EvalError::unwritable(path, e))
}
