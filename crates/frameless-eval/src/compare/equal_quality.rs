//! Equal-quality factors of one scene: who needs how many times more samples, from as few runs as possible.

use std::collections::HashMap;

use super::cells::Depth;
use super::cost;
use super::factor::{Step, exponents, next_step};
use crate::algorithm::Algorithm;
use crate::experiment::{Experiment, SceneSpec};
use crate::results::{EqualQuality, RunResult};
use crate::run::Cell;

/// The comparisons that an experiment asks for, and the errors known so far.
pub(super) struct Factors<'a> {
    experiment: &'a Experiment,
    scene: &'a str,
    /// Scans run with the first seed only.
    seed: u64,
    comparisons: Vec<Comparison<'a>>,
    /// Mean RMSE with the first seed, by algorithm and rate (as bits: rates are numbers of the experiment times powers of two).
    errors: HashMap<(String, u64), f64>,
}

/// How much more does `opponent` need to be as good as `algorithm` at a rate?
struct Comparison<'a> {
    algorithm: &'a Algorithm,
    opponent: &'a Algorithm,
    samples_per_sec: f64,
    max_factor: f64,
}

/// A comparison is thought to measure this many times its rate before it is known: at 1, 2 and 4 times, the first of which is
/// one of the experiment's own runs.
const GUESSED_FACTORS: [f64; 2] = [2.0, 4.0];

impl<'a> Factors<'a> {
    /// `runs` are all runs of the scene.
    pub(super) fn new(
        experiment: &'a Experiment,
        spec: &'a SceneSpec,
        runs: &[RunResult],
    ) -> Factors<'a> {
        let mut factors = Factors {
            experiment,
            scene: &spec.name,
            seed: experiment.seeds[0],
            comparisons: comparisons(experiment),
            errors: HashMap::new(),
        };
        let first_seed: Vec<RunResult> =
            runs.iter().filter(|run| run.seed == factors.seed).cloned().collect();
        factors.learn(&first_seed);
        factors
    }

    /// How much work the scans of a scene will probably be.
    pub(super) fn guessed_cost(experiment: &Experiment) -> u64 {
        let of_one = |comparison: &Comparison| -> u64 {
            let cost = |factor: &f64| {
                let rate = factor * comparison.samples_per_sec;
                cost::refresh(experiment, comparison.opponent, rate, Depth::OnlyRmse)
            };
            GUESSED_FACTORS.iter().map(cost).sum::<u64>() * experiment.refreshes as u64
        };
        comparisons(experiment).iter().map(of_one).sum()
    }

    /// The runs that the comparisons need next, each once; none when all factors are known.
    pub(super) fn cells_to_measure(&self) -> Vec<Cell> {
        let mut cells: Vec<Cell> = Vec::new();
        for comparison in &self.comparisons {
            let wanted = match self.target(comparison) {
                None => Some((comparison.algorithm, comparison.samples_per_sec)),
                Some(target) => match self.step(comparison, target) {
                    Step::Measure(n) => Some((comparison.opponent, comparison.rate(n))),
                    Step::Found(..) => None,
                },
            };
            let Some((algorithm, samples_per_sec)) = wanted else { continue };
            let algorithm = self.same(algorithm, samples_per_sec);
            let is_there = |cell: &Cell| {
                cell.algorithm == algorithm && cell.samples_per_sec == samples_per_sec
            };
            if !cells.iter().any(is_there) {
                cells.push(Cell {
                    scene: self.scene.into(),
                    algorithm,
                    samples_per_sec,
                    seed: self.seed,
                });
            }
        }
        cells
    }

    /// Takes in the outcomes of runs with the first seed.
    pub(super) fn learn(&mut self, runs: &[RunResult]) {
        for run in runs {
            if let Some(rmse) = run.rmse.mean {
                self.errors.insert((run.algorithm.clone(), run.samples_per_sec.to_bits()), rmse);
            }
        }
    }

    /// All factors that are known, in the order rates, algorithms, opponents.
    pub(super) fn found(&self) -> Vec<EqualQuality> {
        let row = |comparison: &Comparison| {
            let Step::Found(factor, bound) = self.step(comparison, self.target(comparison)?) else {
                return None;
            };
            Some(EqualQuality {
                scene: self.scene.into(),
                algorithm: comparison.algorithm.name(),
                opponent: comparison.opponent.name(),
                samples_per_sec: comparison.samples_per_sec,
                factor,
                bound,
            })
        };
        self.comparisons.iter().filter_map(row).collect()
    }

    fn target(&self, comparison: &Comparison) -> Option<f64> {
        self.error(comparison.algorithm, comparison.samples_per_sec)
    }

    fn step(&self, comparison: &Comparison, target: f64) -> Step {
        let exponents = exponents(comparison.samples_per_sec, comparison.max_factor);
        let error_at = |n| self.error(comparison.opponent, comparison.rate(n));
        next_step(target, &exponents, error_at)
    }

    fn error(&self, algorithm: &Algorithm, samples_per_sec: f64) -> Option<f64> {
        let of = |algorithm: &Algorithm| {
            self.errors.get(&(algorithm.name(), samples_per_sec.to_bits())).copied()
        };
        of(algorithm).or_else(|| of(&self.same(algorithm, samples_per_sec)))
    }

    /// Who is run for `algorithm` at a rate: one run for all that show the same.
    fn same(&self, algorithm: &Algorithm, samples_per_sec: f64) -> Algorithm {
        let Experiment { size, display_hz, .. } = self.experiment;
        algorithm.same_at(*size, *display_hz, samples_per_sec)
    }
}

impl Comparison<'_> {
    fn rate(&self, n: i32) -> f64 {
        self.samples_per_sec * f64::from(n).exp2()
    }
}

fn comparisons(experiment: &Experiment) -> Vec<Comparison<'_>> {
    let mut comparisons = Vec::new();
    let Some(spec) = &experiment.equal_quality else { return comparisons };
    for &samples_per_sec in &experiment.samples_per_sec {
        for algorithm in &spec.algorithms {
            for opponent in spec.opponents.iter().filter(|opponent| *opponent != algorithm) {
                let max_factor = spec.max_factor;
                comparisons.push(Comparison { algorithm, opponent, samples_per_sec, max_factor });
            }
        }
    }
    comparisons
}
