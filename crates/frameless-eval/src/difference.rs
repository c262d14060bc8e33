//! What changed between two results: for checking that nothing got worse.

use crate::results::{Results, RunResult};

/// Two results side by side.
#[derive(Clone, Debug, PartialEq)]
pub struct Difference {
    /// What was measured in the first and can be looked for in the second, in the first one's order.
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

/// One value of one group in both results.
#[derive(Clone, Debug, PartialEq)]
pub struct DifferenceRow {
    /// Which runs.
    pub group: RunGroup,
    /// What was measured.
    pub measure: Measure,
    /// The value in the first result, mean over the seeds; `None` if a seed has none.
    pub a: Option<f64>,
    /// The same in the second.
    pub b: Option<f64>,
    /// Largest less smallest value over the seeds of the first result; 0 with a single seed. What the second one's seeds do
    /// must not excuse it.
    pub spread: f64,
}

/// What is compared of a run.
#[derive(Clone, Debug, PartialEq)]
pub enum Measure {
    /// Mean RMSE.
    Rmse,
    /// 95th percentile of the RMSE.
    RmseP95,
    /// Mean RMSE over the changed region.
    RmseChanged,
    /// Mean SSIM.
    Ssim,
    /// Mean FLIP.
    Flip,
    /// RMSE against 64 samples per pixel at the end of the run, where it ends at rest.
    AtRest,
    /// Latency of the event of this name, in seconds.
    Latency(String),
}

/// Whether a value moved by more than chance moves it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// By more than the tolerance to the good, or there is a value where there was none.
    Better,
    /// It did not move by more than the tolerance.
    Same,
    /// By more than the tolerance to the bad, or there is no value any more.
    Worse,
}

/// Changes of less than this part of the value are none, whatever the spread: what is not random has no spread, and another
/// machine's sine may put a pixel at an edge on the other side.
const NO_CHANGE: f64 = 0.005;

/// Nor are differences below this; a tenth of the smallest step of an 8-bit display, over the whole picture.
const NO_ERROR: f64 = 0.0004;

impl Measure {
    /// As people call it.
    pub fn name(&self) -> String {
        match self {
            Measure::Rmse => "RMSE".into(),
            Measure::RmseP95 => "95th percentile of RMSE".into(),
            Measure::RmseChanged => "RMSE of changed region".into(),
            Measure::Ssim => "SSIM".into(),
            Measure::Flip => "FLIP".into(),
            Measure::AtRest => "RMSE at rest".into(),
            Measure::Latency(event) => format!("latency of {event}, s"),
        }
    }

    fn of(&self, run: &RunResult) -> Option<f64> {
        match self {
            Measure::Rmse => run.rmse.mean,
            Measure::RmseP95 => run.rmse.p95,
            Measure::RmseChanged => run.rmse_changed.mean,
            Measure::Ssim => run.ssim.mean,
            Measure::Flip => run.flip.mean,
            Measure::AtRest => run.at_rest.as_ref()?.rmse.last().copied(),
            Measure::Latency(name) => {
                run.events.iter().find(|event| event.name == *name)?.latency_secs
            }
        }
    }

    /// Everything that is measured of a run.
    fn all_of(run: &RunResult) -> Vec<Measure> {
        use Measure::{AtRest, Flip, Rmse, RmseChanged, RmseP95, Ssim};
        let mut all = vec![Rmse, RmseP95, RmseChanged, Ssim, Flip, AtRest];
        all.extend(run.events.iter().map(|event| Measure::Latency(event.name.clone())));
        all
    }

    /// The smallest difference that counts.
    fn least(&self, group: &RunGroup) -> f64 {
        match self {
            // Refreshes come at times rounded to nanoseconds.
            Measure::Latency(_) => 0.5 / f64::from(group.display.2),
            _ => NO_ERROR,
        }
    }
}

impl DifferenceRow {
    /// Larger changes than this are called better or worse: the spread over the seeds, but at least 0.5 % of the value and
    /// 0.0004 (half a refresh for latencies).
    pub fn tolerance(&self) -> f64 {
        let part = NO_CHANGE * self.a.unwrap_or(0.0);
        self.spread.max(part).max(self.measure.least(&self.group))
    }

    /// Whether the value moved by more than [`tolerance`](DifferenceRow::tolerance).
    pub fn verdict(&self) -> Verdict {
        let (a, b) = match (self.a, self.b) {
            (Some(a), Some(b)) => (a, b),
            (None, None) => return Verdict::Same,
            (None, Some(_)) => return Verdict::Better,
            (Some(_), None) => return Verdict::Worse,
        };
        let rise = if self.measure == Measure::Ssim { a - b } else { b - a };
        if rise < -self.tolerance() {
            Verdict::Better
        } else if rise <= self.tolerance() {
            Verdict::Same
        } else {
            Verdict::Worse
        }
    }
}

impl Difference {
    /// Compares `b` with `a`, the older one.
    pub fn between(a: &Results, b: &Results) -> Difference {
        let (groups_a, groups_b) = (groups(a), groups(b));
        let mut rows = Vec::new();
        for (group, runs_a) in &groups_a {
            let Some((_, runs_b)) = groups_b.iter().find(|(other, _)| other == group) else {
                continue;
            };
            for measure in Measure::all_of(runs_a[0]) {
                let values = |runs: &[&RunResult]| -> Option<Vec<f64>> {
                    runs.iter().map(|run| measure.of(run)).collect()
                };
                let (a, b) = (values(runs_a), values(runs_b));
                if a.is_some() || b.is_some() || measure == Measure::Rmse {
                    let spread = a.as_deref().map_or(0.0, spread);
                    let (a, b) = (a.as_deref().map(mean), b.as_deref().map(mean));
                    rows.push(DifferenceRow { group: group.clone(), measure, a, b, spread });
                }
            }
        }
        let only_in = |these: &[Group], those: &[Group]| {
            let is_there = |group: &RunGroup| those.iter().any(|(other, _)| other == group);
            these.iter().map(|(group, _)| group.clone()).filter(|group| !is_there(group)).collect()
        };
        Difference {
            rows,
            only_in_a: only_in(&groups_a, &groups_b),
            only_in_b: only_in(&groups_b, &groups_a),
        }
    }

    /// How many rows have this verdict.
    pub fn count(&self, verdict: Verdict) -> usize {
        self.rows.iter().filter(|row| row.verdict() == verdict).count()
    }
}

type Group<'a> = (RunGroup, Vec<&'a RunResult>);

/// Groups in the order of their first run.
fn groups(results: &Results) -> Vec<Group<'_>> {
    let mut groups: Vec<Group> = Vec::new();
    for run in &results.runs {
        let group = group_of(run, results.unscored_refreshes);
        match groups.iter_mut().find(|(known, _)| *known == group) {
            Some((_, runs)) => runs.push(run),
            None => groups.push((group, vec![run])),
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

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

fn spread(values: &[f64]) -> f64 {
    let largest = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let smallest = values.iter().copied().fold(f64::INFINITY, f64::min);
    largest - smallest
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::made_up::results_of;

    fn verdicts_of(difference: &Difference, measure: &Measure) -> Vec<Verdict> {
        let rows = difference.rows.iter().filter(|row| row.measure == *measure);
        rows.map(DifferenceRow::verdict).collect()
    }

    #[test]
    fn worse_is_what_moves_by_more_than_the_seeds_do() {
        let a = results_of(&[("sphere", "change", &[0.050, 0.052]), ("sphere", "framed", &[0.1])]);
        let verdicts = |change: &[f64], framed: f64| {
            let b = results_of(&[("sphere", "change", change), ("sphere", "framed", &[framed])]);
            verdicts_of(&Difference::between(&a, &b), &Measure::Rmse)
        };
        use Verdict::{Better, Same, Worse};
        assert_eq!(verdicts(&[0.050, 0.052], 0.1), [Same, Same]);
        assert_eq!(verdicts(&[0.0515, 0.0535], 0.1004), [Same, Same]);
        assert_eq!(verdicts(&[0.0535, 0.0540], 0.1006), [Worse, Worse]);
        assert_eq!(verdicts(&[0.0480, 0.0481], 0.09), [Better, Better]);
        // A seed that goes astray does not widen what is allowed.
        assert_eq!(verdicts(&[0.050, 0.5], 0.1), [Worse, Same]);
    }

    #[test]
    fn errors_that_nobody_sees_and_none_at_all() {
        let verdict = |a: f64, b: f64| {
            let results = |error: f64| results_of(&[("sphere", "framed", &[error])]);
            verdicts_of(&Difference::between(&results(a), &results(b)), &Measure::Rmse)[0]
        };
        assert_eq!(verdict(0.0, 0.0003), Verdict::Same);
        assert_eq!(verdict(0.0, 0.01), Verdict::Worse);
    }

    #[test]
    fn every_measure_is_compared() {
        let a = results_of(&[("sphere", "framed", &[0.1])]);
        let verdict = |measure: Measure, change: &dyn Fn(&mut RunResult)| {
            let mut b = a.clone();
            change(&mut b.runs[0]);
            verdicts_of(&Difference::between(&a, &b), &measure)
        };
        use Verdict::{Better, Worse};
        assert_eq!(verdict(Measure::RmseP95, &|run| run.rmse.p95 = Some(0.2)), [Worse]);
        let changed: &dyn Fn(&mut RunResult) = &|run| run.rmse_changed.mean = Some(0.9);
        assert_eq!(verdict(Measure::RmseChanged, changed), [Worse]);
        assert_eq!(verdict(Measure::Ssim, &|run| run.ssim.mean = Some(0.5)), [Worse]);
        assert_eq!(verdict(Measure::Ssim, &|run| run.ssim.mean = Some(0.95)), [Better]);
        assert_eq!(verdict(Measure::Flip, &|run| run.flip.mean = None), [Worse]);
        let cut = Measure::Latency("cut".into());
        let quick: &dyn Fn(&mut RunResult) = &|run| run.events[0].latency_secs = Some(0.1);
        assert_eq!(verdict(cut.clone(), quick), [Better]);
        let mut followed = a.clone();
        quick(&mut followed.runs[0]);
        assert_eq!(verdicts_of(&Difference::between(&followed, &a), &cut), [Worse]);
    }

    #[test]
    fn what_is_only_in_one_is_named() {
        let a = results_of(&[("sphere", "change", &[0.05]), ("many", "change", &[0.1])]);
        let mut b = results_of(&[("sphere", "change", &[0.05]), ("sphere", "framed", &[0.1])]);
        let difference = Difference::between(&a, &b);
        assert!(difference.rows.iter().all(|row| row.group.scene == "sphere"));
        assert_eq!(difference.only_in_a[0].scene, "many");
        assert_eq!(difference.only_in_b[0].algorithm, "framed");
        // Other sizes have other errors: nothing is comparable then.
        b.runs.iter_mut().for_each(|run| run.width += 1);
        assert!(Difference::between(&a, &b).rows.is_empty());
    }
}
