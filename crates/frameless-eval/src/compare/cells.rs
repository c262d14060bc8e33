//! The runs of an experiment, and everything that determines them.

use super::fingerprint::fingerprint;
use super::store::Key;
use super::versions::{WORLD_VERSION, versioned};
use crate::error::EvalError;
use crate::experiment::{Experiment, SceneSpec};
use crate::results::RESULTS_VERSION;
use crate::run::Cell;

/// The runs of a scene: rates, algorithms, seeds, in this order. What is not random runs with the first seed only.
pub(super) fn cells_of(experiment: &Experiment, spec: &SceneSpec) -> Vec<Cell> {
    let mut cells = Vec::new();
    for &samples_per_sec in &experiment.samples_per_sec {
        for algorithm in &experiment.algorithms {
            let seeds = if algorithm.is_seeded() { experiment.seeds.len() } else { 1 };
            cells.extend(experiment.seeds[..seeds].iter().map(|&seed| Cell {
                scene: spec.name.clone(),
                algorithm: algorithm.clone(),
                samples_per_sec,
                seed,
            }));
        }
    }
    cells
}

/// How much of a run is measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Depth {
    /// Every metric of the experiment.
    Everything,
    /// RMSE alone, for whoever looks for equal quality.
    OnlyRmse,
}

/// What every piece of work on a scene depends on.
pub(super) struct SceneKey {
    text: String,
    /// What a run tells if everything is measured.
    measured: String,
}

impl SceneKey {
    /// # Errors
    /// If the scene's file cannot be read.
    pub(super) fn new(experiment: &Experiment, spec: &SceneSpec) -> Result<SceneKey, EvalError> {
        let SceneSpec { source, camera, events, .. } = spec;
        let Experiment { size, display_hz, refreshes, unscored, metrics, .. } = experiment;
        let text = format!(
            "frameless cell, results version {RESULTS_VERSION}, world version {WORLD_VERSION}\n\
             scene {}\n\
             camera {camera:?}\n\
             events {events:?}\n\
             display {}x{} at {display_hz} Hz, {refreshes} refreshes of which {unscored} unscored\n",
            fingerprint(source)?,
            size.width,
            size.height,
        );
        Ok(SceneKey { text, measured: format!("everything measured, {metrics:?}") })
    }

    /// Of one run.
    pub(super) fn run(&self, cell: &Cell, depth: Depth) -> Key {
        let Cell { scene: _, algorithm, samples_per_sec, seed } = cell;
        let measured = match depth {
            Depth::Everything => &self.measured,
            Depth::OnlyRmse => "only RMSE measured",
        };
        Key::new(format!(
            "{}run {}, {samples_per_sec} samples/s, seed {seed}, {measured}\n",
            self.text,
            versioned(algorithm)
        ))
    }

    /// Of pictures of some algorithms at one rate.
    pub(super) fn pictures(&self, what: &str) -> Key {
        Key::new(format!("{}pictures {what}\n", self.text))
    }
}
