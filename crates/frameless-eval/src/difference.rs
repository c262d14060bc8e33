//! What changed between two results: for checking that nothing got worse.

use crate::results::{Results, RunResult};

/// Two results side by side.
#[derive(Clone, Debug, PartialEq)]
pub struct Difference {
    /// What is in both, in the first one's order.
    pub rows: Vec<DifferenceRow>,
    /// What is only in the first.
    pub only_in_a: Vec<RunGroup>,
    /// What is only in the second.
    pub only_in_b: Vec<RunGroup>,
}

/// The runs that differ by nothing but their seed.
#[derive(Clone, Debug, PartialEq)]
pub struct RunGroup {
    /// The scene's name.
    pub scene: String,
    /// Samples per second.
    pub samples_per_sec: f64,
    /// The algorithm's name.
    pub algorithm: String,
    /// Width, height, refreshes per second, refreshes, refreshes that are not scored: what errors depend on besides.
    pub display: (u32, u32, u32, usize, usize),
}

/// One group in both results.
#[derive(Clone, Debug, PartialEq)]
pub struct DifferenceRow {
    /// Which runs.
    pub group: RunGroup,
    /// Mean RMSE in the first result, mean over the seeds.
    pub a: f64,
    /// The same in the second.
    pub b: f64,
    /// Largest less smallest mean RMSE over the seeds, of the result in which that is larger; 0 with a single seed.
    pub spread: f64,
}

/// Whether an error moved by more than chance moves it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// The error fell by more than the spread.
    Better,
    /// It did not move by more than the spread.
    Same,
    /// It rose by more than the spread.
    Worse,
}

/// Changes of less than this part of the error are none, whatever the spread: what is not random has no spread, and another
/// machine's sine may put a pixel at an edge on the other side.
const NO_CHANGE: f64 = 0.005;

/// Nor are differences below this; a tenth of the smallest step of an 8-bit display, over the whole picture.
const NO_ERROR: f64 = 0.0004;

impl DifferenceRow {
    /// b / a; infinite if an error appeared where there was none, 1 if there is none in either.
    pub fn ratio(&self) -> f64 {
        if self.a == self.b { 1.0 } else { self.b / self.a }
    }

    /// Larger changes than this are called better or worse: the spread over the seeds, but at least 0.5 % of the error and
    /// 0.0004.
    pub fn tolerance(&self) -> f64 {
        self.spread.max(NO_CHANGE * self.a).max(NO_ERROR)
    }

    /// Whether the error moved by more than [`tolerance`](DifferenceRow::tolerance).
    pub fn verdict(&self) -> Verdict {
        let change = self.b - self.a;
        if change.abs() <= self.tolerance() {
            Verdict::Same
        } else if change < 0.0 {
            Verdict::Better
        } else {
            Verdict::Worse
        }
    }
}

impl Difference {
    /// Compares `b` with `a`, the older one.
    pub fn between(a: &Results, b: &Results) -> Difference {
        let (groups_a, groups_b) = (groups(a), groups(b));
        let row = |(group, errors_a): &(RunGroup, Vec<f64>)| {
            let (_, errors_b) = groups_b.iter().find(|(other, _)| other == group)?;
            Some(DifferenceRow {
                group: group.clone(),
                a: mean(errors_a),
                b: mean(errors_b),
                spread: spread(errors_a).max(spread(errors_b)),
            })
        };
        let only_in = |these: &[(RunGroup, Vec<f64>)], those: &[(RunGroup, Vec<f64>)]| {
            let is_there = |group: &RunGroup| those.iter().any(|(other, _)| other == group);
            these.iter().map(|(group, _)| group.clone()).filter(|group| !is_there(group)).collect()
        };
        Difference {
            rows: groups_a.iter().filter_map(row).collect(),
            only_in_a: only_in(&groups_a, &groups_b),
            only_in_b: only_in(&groups_b, &groups_a),
        }
    }

    /// How many rows have this verdict.
    pub fn count(&self, verdict: Verdict) -> usize {
        self.rows.iter().filter(|row| row.verdict() == verdict).count()
    }
}

/// Groups in the order of their first run, with the mean RMSE of every run that has one.
fn groups(results: &Results) -> Vec<(RunGroup, Vec<f64>)> {
    let mut groups: Vec<(RunGroup, Vec<f64>)> = Vec::new();
    for run in &results.runs {
        let Some(error) = run.rmse.mean else { continue };
        let group = group_of(run, results.unscored_refreshes);
        match groups.iter_mut().find(|(known, _)| *known == group) {
            Some((_, errors)) => errors.push(error),
            None => groups.push((group, vec![error])),
        }
    }
    groups
}

fn group_of(run: &RunResult, unscored: usize) -> RunGroup {
    RunGroup {
        scene: run.scene.clone(),
        samples_per_sec: run.samples_per_sec,
        algorithm: run.algorithm.clone(),
        display: (run.width, run.height, run.display_hz, run.refreshes, unscored),
    }
}

fn mean(errors: &[f64]) -> f64 {
    errors.iter().sum::<f64>() / errors.len() as f64
}

fn spread(errors: &[f64]) -> f64 {
    let largest = errors.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let smallest = errors.iter().copied().fold(f64::INFINITY, f64::min);
    largest - smallest
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::made_up::results_of;

    #[test]
    fn worse_is_what_moves_by_more_than_the_seeds_do() {
        let a = results_of(&[("sphere", "change", &[0.050, 0.052]), ("sphere", "framed", &[0.1])]);
        let verdicts = |change: &[f64], framed: f64| {
            let b = results_of(&[("sphere", "change", change), ("sphere", "framed", &[framed])]);
            let difference = Difference::between(&a, &b);
            let rows = difference.rows.iter();
            rows.map(DifferenceRow::verdict).collect::<Vec<_>>()
        };
        assert_eq!(verdicts(&[0.050, 0.052], 0.1), [Verdict::Same, Verdict::Same]);
        assert_eq!(verdicts(&[0.0515, 0.0535], 0.1004), [Verdict::Same, Verdict::Same]);
        assert_eq!(verdicts(&[0.0535, 0.0540], 0.1006), [Verdict::Worse, Verdict::Worse]);
        assert_eq!(verdicts(&[0.0480, 0.0481], 0.09), [Verdict::Better, Verdict::Better]);
    }

    #[test]
    fn errors_that_nobody_sees_and_none_at_all() {
        let difference = |a: f64, b: f64| {
            let results = |error: f64| results_of(&[("sphere", "framed", &[error])]);
            Difference::between(&results(a), &results(b)).rows[0].clone()
        };
        assert_eq!(difference(0.0, 0.0).ratio(), 1.0);
        assert_eq!(difference(0.0, 0.0003).verdict(), Verdict::Same);
        assert_eq!(difference(0.0, 0.01).verdict(), Verdict::Worse);
        assert_eq!(difference(0.0, 0.01).ratio(), f64::INFINITY);
    }

    #[test]
    fn what_is_only_in_one_is_named() {
        let a = results_of(&[("sphere", "change", &[0.05]), ("many", "change", &[0.1])]);
        let mut b = results_of(&[("sphere", "change", &[0.05]), ("sphere", "framed", &[0.1])]);
        let difference = Difference::between(&a, &b);
        assert_eq!(difference.rows.len(), 1);
        assert_eq!(difference.only_in_a[0].scene, "many");
        assert_eq!(difference.only_in_b[0].algorithm, "framed");
        // Other sizes have other errors: nothing is comparable then.
        b.runs.iter_mut().for_each(|run| run.width += 1);
        assert!(Difference::between(&a, &b).rows.is_empty());
    }
}
