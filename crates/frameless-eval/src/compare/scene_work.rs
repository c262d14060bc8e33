//! The work on one scene: its runs, its equal-quality factors, its pictures; whatever lies in the store already is not done again.

use std::path::PathBuf;
use std::sync::OnceLock;

use super::cells::{Depth, SceneKey, cells_of};
use super::equal_quality::Factors;
use super::parallel::in_parallel;
use super::progress::Work;
use super::store::Store;
use super::{cost, pictures};
use crate::error::EvalError;
use crate::experiment::{Experiment, SceneSpec};
use crate::ideal::Ideals;
use crate::results::{EqualQuality, RunResult};
use crate::run::{Cell, run};
use crate::subject::Subject;

/// A scene, what is known of it, and where its outcomes lie.
pub(super) struct SceneWork<'a> {
    experiment: &'a Experiment,
    spec: &'a SceneSpec,
    store: &'a Store,
    key: SceneKey,
    cells: Vec<Cell>,
    /// Loaded when there is something to trace.
    subject: OnceLock<Subject>,
    /// Traced when there is something to compare with them; shared by all runs.
    ideals: OnceLock<Ideals>,
    /// Whether the ideals are part of the plan.
    are_ideals_planned: bool,
    /// Work that was planned for what cannot be known before.
    guessed: u64,
}

/// What came out of one scene.
pub(super) struct SceneOutcome {
    pub(super) runs: Vec<RunResult>,
    pub(super) equal_quality: Vec<EqualQuality>,
    /// The folder with its pictures.
    pub(super) pictures: PathBuf,
}

impl<'a> SceneWork<'a> {
    /// Loads the scene if one of its runs or its pictures are not in the store.
    ///
    /// # Errors
    /// If the scene cannot be loaded.
    pub(super) fn new(
        experiment: &'a Experiment,
        spec: &'a SceneSpec,
        store: &'a Store,
    ) -> Result<SceneWork<'a>, EvalError> {
        let scene = SceneWork {
            experiment,
            spec,
            store,
            key: SceneKey::new(experiment, spec)?,
            cells: cells_of(experiment, spec),
            subject: OnceLock::new(),
            ideals: OnceLock::new(),
            are_ideals_planned: false,
            guessed: 0,
        };
        if scene.finished_runs() < scene.runs() || scene.finished_pictures().is_none() {
            // A broken file is reported now, not after an hour of work on other scenes.
            scene.subject()?;
        }
        Ok(scene)
    }

    /// How many runs there are.
    pub(super) fn runs(&self) -> usize {
        self.cells.len()
    }

    /// How many of them are in the store.
    pub(super) fn finished_runs(&self) -> usize {
        let is_finished = |cell: &&Cell| self.store.has_run(&self.key.run(cell, Depth::Everything));
        self.cells.iter().filter(is_finished).count()
    }

    fn finished_pictures(&self) -> Option<PathBuf> {
        self.store.pictures(&pictures::key(self.experiment, &self.key))
    }

    /// Adds what is not in the store to the plan.
    pub(super) fn plan(&mut self, work: &Work) {
        let is_missing = |cell: &&Cell| !self.store.has_run(&self.key.run(cell, Depth::Everything));
        let missing = self.cells.iter().filter(is_missing);
        let runs: u64 = missing.map(|cell| self.cost(cell, Depth::Everything)).sum();
        let pictures = match self.finished_pictures() {
            Some(_) => 0,
            None => pictures::cost(self.experiment),
        };
        // What is scanned for equal quality is not known; it is not done again if the runs are there.
        self.guessed = if runs == 0 { 0 } else { Factors::guessed_cost(self.experiment) };
        self.are_ideals_planned = runs + pictures > 0;
        let ideals = if self.are_ideals_planned { cost::ideals(self.experiment) } else { 0 };
        work.add(runs + pictures + ideals + self.guessed);
    }

    /// Does what is missing.
    ///
    /// # Errors
    /// If something cannot be traced or written, or `work` is to stop; what has been finished stays in the store.
    pub(super) fn finish(&mut self, work: &Work) -> Result<SceneOutcome, EvalError> {
        let runs = self.outcomes(&self.cells, Depth::Everything, "runs", work)?;

        work.forget(self.guessed);
        let mut factors = Factors::new(self.experiment, self.spec, &runs);
        loop {
            let cells = factors.cells_to_measure();
            if cells.is_empty() {
                break;
            }
            work.add(self.missing_cost(&cells, Depth::OnlyRmse));
            let measured = self.outcomes(&cells, Depth::OnlyRmse, "equal quality", work)?;
            factors.learn(&measured);
        }
        let pictures = match self.finished_pictures() {
            Some(pictures) => pictures,
            None => self.make_pictures(work)?,
        };
        let equal_quality = factors.found();
        // The next scene needs the memory.
        (self.subject, self.ideals) = (OnceLock::new(), OnceLock::new());
        Ok(SceneOutcome { runs, equal_quality, pictures })
    }

    fn cost(&self, cell: &Cell, depth: Depth) -> u64 {
        let refresh = cost::refresh(self.experiment, &cell.algorithm, cell.samples_per_sec, depth);
        refresh * self.experiment.refreshes as u64
    }

    fn missing_cost(&self, cells: &[Cell], depth: Depth) -> u64 {
        let missing = cells.iter().filter(|cell| self.stored(cell, depth).is_none());
        missing.map(|cell| self.cost(cell, depth)).sum()
    }

    /// An earlier outcome; where everything was measured, RMSE was too.
    fn stored(&self, cell: &Cell, depth: Depth) -> Option<RunResult> {
        let everything = self.store.run(&self.key.run(cell, Depth::Everything));
        let found = everything.or_else(|| self.store.run(&self.key.run(cell, depth)));
        // The scene may have been called something else then.
        found.map(|result| RunResult { scene: cell.scene.clone(), ..result })
    }

    /// The outcomes of `cells`, in their order, from the store or run now.
    fn outcomes(
        &self,
        cells: &[Cell],
        depth: Depth,
        stage: &str,
        work: &Work,
    ) -> Result<Vec<RunResult>, EvalError> {
        let mut outcomes: Vec<Option<RunResult>> =
            cells.iter().map(|cell| self.stored(cell, depth)).collect();
        let mut missing: Vec<usize> = (0..cells.len()).filter(|&i| outcomes[i].is_none()).collect();
        if !missing.is_empty() {
            // The longest first; a stable sort, though any order gives the same outcomes.
            missing.sort_by_key(|&i| std::cmp::Reverse(self.cost(&cells[i], depth)));
            let (subject, ideals) = (self.subject()?, self.ideals(work)?);
            work.stage(&format!("{}: {stage}", self.spec.name));
            let made = in_parallel(&missing, |&i| {
                self.run_and_keep(&cells[i], depth, subject, ideals, work)
            })?;
            for (i, result) in missing.into_iter().zip(made) {
                outcomes[i] = Some(result);
            }
        }
        Ok(outcomes.into_iter().flatten().collect())
    }

    fn run_and_keep(
        &self,
        cell: &Cell,
        depth: Depth,
        subject: &Subject,
        ideals: &Ideals,
        work: &Work,
    ) -> Result<RunResult, EvalError> {
        let cost = cost::refresh(self.experiment, &cell.algorithm, cell.samples_per_sec, depth);
        let mut go_on = |_: usize, _: &_| {
            work.advance(cost);
            !work.should_stop()
        };
        let result = match depth {
            Depth::Everything => run(cell, self.experiment, subject, ideals, &mut go_on)?,
            Depth::OnlyRmse => {
                run(cell, &self.experiment.with_error_only(), subject, ideals, &mut go_on)?
            }
        };
        self.store.keep_run(&self.key.run(cell, depth), &result)?;
        Ok(result)
    }

    fn make_pictures(&self, work: &Work) -> Result<PathBuf, EvalError> {
        let key = pictures::key(self.experiment, &self.key);
        let (subject, ideals) = (self.subject()?, self.ideals(work)?);
        work.stage(&format!("{}: pictures", self.spec.name));
        self.store.keep_pictures(&key, |folder| {
            pictures::make(self.experiment, subject, ideals, folder, work)
        })
    }

    fn subject(&self) -> Result<&Subject, EvalError> {
        match self.subject.get() {
            Some(subject) => Ok(subject),
            None => {
                let loaded = Subject::load(self.spec)?;
                Ok(self.subject.get_or_init(|| loaded))
            }
        }
    }

    fn ideals(&self, work: &Work) -> Result<&Ideals, EvalError> {
        if let Some(ideals) = self.ideals.get() {
            return Ok(ideals);
        }
        work.stage(&format!("{}: ideal", self.spec.name));
        if !self.are_ideals_planned {
            work.add(cost::ideals(self.experiment));
        }
        let subject = self.subject()?;
        let picture = self.experiment.size.pixels() as u64;
        let traced = Ideals::trace(subject, self.experiment, &|| work.advance(picture), &|| {
            work.should_stop()
        });
        let traced = traced.ok_or(EvalError::Interrupted)?;
        Ok(self.ideals.get_or_init(|| traced))
    }
}
