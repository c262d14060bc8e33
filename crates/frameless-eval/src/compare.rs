//! The whole of an experiment: ideals, runs, pictures, report; written whole or not at all.

use std::path::Path;

use frameless::Display;
use rayon::prelude::*;

use crate::error::EvalError;
use crate::experiment::{Experiment, IDEAL, SceneSpec};
use crate::ideal::Ideals;
use crate::metrics::Picture;
use crate::output::{OutputFolder, Strip, plot_curves, write_still, write_video};
use crate::results::{RESULTS_VERSION, Results, RunResult};
use crate::run::{Cell, run};
use crate::subject::Subject;

/// Told how far a comparison is.
pub trait Progress: Sync {
    /// Once, before the work: so many pictures will be made.
    fn begin(&self, pictures: u64);
    /// What is being worked on.
    fn stage(&self, what: &str);
    /// One more picture has been made.
    fn advance(&self);
    /// Asked often; after `true` the comparison ends with [`EvalError::Interrupted`] and writes nothing.
    fn should_stop(&self) -> bool;
}

/// Runs an experiment and writes `results.json`, error curves, stills and videos into the folder `out`, which
/// appears when everything is finished. A folder with an earlier `results.json` is replaced.
///
/// # Errors
/// If a scene cannot be loaded, the output not written, or the user interrupts; nothing is written then.
pub fn compare(
    experiment: &Experiment,
    out: &Path,
    progress: &dyn Progress,
) -> Result<Results, EvalError> {
    let folder = OutputFolder::create(out)?;
    let subjects: Vec<Subject> =
        experiment.scenes.iter().map(Subject::load).collect::<Result<_, _>>()?;
    progress.begin(pictures_to_make(experiment));

    let mut runs = Vec::new();
    for (spec, subject) in experiment.scenes.iter().zip(&subjects) {
        runs.extend(compare_scene(experiment, spec, subject, folder.path(), progress)?);
    }
    let results = Results {
        format: "frameless results".into(),
        version: RESULTS_VERSION,
        title: experiment.title.clone(),
        unscored_refreshes: experiment.unscored,
        runs,
        equal_quality: Vec::new(),
    };
    progress.stage("writing");
    let json = serde_json::to_string_pretty(&results).expect("plain data");
    let path = folder.path().join("results.json");
    std::fs::write(&path, json + "\n").map_err(|e| EvalError::unwritable(&path, e))?;
    folder.publish()?;
    Ok(results)
}

fn pictures_to_make(experiment: &Experiment) -> u64 {
    let runs =
        experiment.samples_per_sec.len() * experiment.algorithms.len() * experiment.seeds.len();
    (experiment.scenes.len() * experiment.refreshes * (1 + runs)) as u64
}

fn compare_scene(
    experiment: &Experiment,
    spec: &SceneSpec,
    subject: &Subject,
    folder: &Path,
    progress: &dyn Progress,
) -> Result<Vec<RunResult>, EvalError> {
    progress.stage(&format!("{}: ideal", spec.name));
    let ideals =
        Ideals::trace(subject, experiment, &|| progress.advance(), &|| progress.should_stop())
            .ok_or(EvalError::Interrupted)?;
    let mut results = Vec::new();
    for &samples_per_sec in &experiment.samples_per_sec {
        progress.stage(&format!("{}: {samples_per_sec} samples/s", spec.name));
        let shown = compare_rate(experiment, spec, subject, &ideals, samples_per_sec, progress)?;
        let basename = format!("{}-{samples_per_sec}", spec.name);
        illustrate(experiment, &ideals, &shown, &basename, folder)?;
        results.extend(shown.into_iter().map(|run| run.result));
    }
    Ok(results)
}

/// A run with the pictures that the output needs.
struct Shown {
    result: RunResult,
    /// One per refresh, if the run is part of a video or still.
    pictures: Vec<Vec<[u8; 3]>>,
}

fn compare_rate(
    experiment: &Experiment,
    spec: &SceneSpec,
    subject: &Subject,
    ideals: &Ideals,
    samples_per_sec: f64,
    progress: &dyn Progress,
) -> Result<Vec<Shown>, EvalError> {
    let cells = experiment.algorithms.iter().flat_map(|algorithm| {
        let cell = move |&seed: &u64| Cell {
            scene: spec.name.clone(),
            algorithm: algorithm.clone(),
            samples_per_sec,
            seed,
        };
        experiment.seeds.iter().map(cell)
    });
    let cells: Vec<Cell> = cells.collect();
    let run_one = |cell: &Cell| -> Result<Shown, EvalError> {
        // Pictures are kept of the first seed only: the others look alike.
        let keep =
            cell.seed == experiment.seeds[0] && experiment.show.contains(&cell.algorithm.name());
        let mut pictures = Vec::new();
        let mut look = |k: usize, picture: &Picture| {
            progress.advance();
            let wanted = keep && (experiment.video || experiment.stills.contains(&k));
            pictures.push(if wanted { rgb8(picture) } else { Vec::new() });
            !progress.should_stop()
        };
        let result = run(cell, experiment, subject, ideals, &mut look)?;
        Ok(Shown { result, pictures })
    };
    cells.par_iter().map(run_one).collect()
}

fn rgb8(picture: &Picture) -> Vec<[u8; 3]> {
    picture.iter().map(|c| c.map(Display::quantize)).collect()
}

/// Stills, video and error curves of one scene at one rate.
fn illustrate(
    experiment: &Experiment,
    ideals: &Ideals,
    shown: &[Shown],
    basename: &str,
    folder: &Path,
) -> Result<(), EvalError> {
    let strip = Strip::new(experiment.size, &experiment.show);
    let panels = |k: usize| -> Vec<Vec<[u8; 3]>> {
        let panel = |name: &String| match name.as_str() {
            IDEAL => rgb8(&ideals.pictures[k]),
            name => {
                let run = shown.iter().find(|run| run.result.algorithm == name);
                run.expect("show was checked").pictures[k].clone()
            }
        };
        experiment.show.iter().map(panel).collect()
    };
    for &k in &experiment.stills {
        let millis = crate::ideal::refresh_time(k, experiment.display_hz).0 / 1_000_000;
        let path = folder.join(format!("{basename}-{millis}ms.png"));
        write_still(&path, &strip, &panels(k))?;
    }
    let results: Vec<&RunResult> = shown.iter().map(|run| &run.result).collect();
    plot_curves(&folder.join(format!("{basename}-rmse.svg")), basename, &results)?;
    if experiment.video {
        let path = folder.join(format!("{basename}.mp4"));
        let frames = (0..experiment.refreshes).map(panels);
        write_video(&path, &strip, experiment.display_hz, frames)?;
    }
    Ok(())
}
