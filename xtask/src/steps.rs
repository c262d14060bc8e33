//! Steps with a title, a duration and an outcome, and the table of them at the end.

use std::time::{Duration, Instant};

use anyhow::Result;

/// What a step that did not fail has to say.
#[derive(Default)]
pub(crate) struct Done {
    /// One short remark for the summary; may be empty.
    pub(crate) remark: String,
    /// What was not checked and why, each one line.
    pub(crate) skipped: Vec<String>,
    /// Whether anything was checked at all.
    pub(crate) checked: bool,
}

impl Done {
    /// Everything was checked.
    pub(crate) fn passed(remark: impl Into<String>) -> Done {
        Done { remark: remark.into(), skipped: Vec::new(), checked: true }
    }

    /// Nothing was checked.
    pub(crate) fn skipped(reason: impl Into<String>) -> Done {
        Done { skipped: vec![reason.into()], ..Done::default() }
    }
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Verdict {
    Passed,
    Failed,
    Skipped,
}

struct Row {
    title: &'static str,
    verdict: Verdict,
    duration: Duration,
    remark: String,
}

/// The steps so far.
pub(crate) struct Steps {
    rows: Vec<Row>,
    skipped: Vec<String>,
    /// Whether a skipped check is a failure.
    strict: bool,
}

impl Steps {
    /// With `strict`, what is skipped has failed.
    pub(crate) fn new(strict: bool) -> Steps {
        Steps { rows: Vec::new(), skipped: Vec::new(), strict }
    }

    /// Run one step; a failure is reported and the next step may follow.
    pub(crate) fn step(&mut self, title: &'static str, work: impl FnOnce() -> Result<Done>) {
        eprintln!("\n=== {title}");
        let start = Instant::now();
        let (verdict, remark) = match work() {
            Ok(done) => self.judge(done),
            Err(error) => {
                eprintln!("FAILED: {error:#}");
                let first_line = format!("{error:#}").lines().next().unwrap_or_default().to_owned();
                (Verdict::Failed, first_line)
            }
        };
        self.rows.push(Row { title, verdict, duration: start.elapsed(), remark });
    }

    fn judge(&mut self, done: Done) -> (Verdict, String) {
        for reason in &done.skipped {
            eprintln!("SKIPPED: {reason}");
        }
        let verdict = match (done.skipped.is_empty(), done.checked) {
            (false, _) if self.strict => Verdict::Failed,
            (_, false) => Verdict::Skipped,
            (_, true) => Verdict::Passed,
        };
        let mut remark = done.remark;
        if remark.is_empty() {
            remark = done.skipped.first().cloned().unwrap_or_default();
        }
        self.skipped.extend(done.skipped);
        (verdict, remark)
    }

    /// Print the table; the last line counts. True if nothing failed.
    pub(crate) fn finish(self) -> bool {
        println!("\n=== summary");
        for row in &self.rows {
            println!(
                "{:8} {:6.1} s  {:24} {}",
                row.verdict.word(),
                row.duration.as_secs_f64(),
                row.title,
                row.remark
            );
        }
        for reason in &self.skipped {
            println!("SKIPPED: {reason}");
        }
        if self.strict && !self.skipped.is_empty() {
            println!("CI=true: nothing may be skipped");
        }
        println!("{}", self.tally());
        self.count(Verdict::Failed) == 0
    }

    fn tally(&self) -> String {
        format!(
            "{} passed, {} failed, {} skipped",
            self.count(Verdict::Passed),
            self.count(Verdict::Failed),
            self.count(Verdict::Skipped)
        )
    }

    fn count(&self, verdict: Verdict) -> usize {
        self.rows.iter().filter(|row| row.verdict == verdict).count()
    }
}

impl Verdict {
    fn word(self) -> &'static str {
        match self {
            Verdict::Passed => "passed",
            Verdict::Failed => "FAILED",
            Verdict::Skipped => "skipped",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn three_steps(strict: bool) -> Steps {
        let mut steps = Steps::new(strict);
        steps.step("good", || Ok(Done::passed("")));
        steps.step("bad", || anyhow::bail!("it broke"));
        steps.step("absent", || Ok(Done::skipped("no screen")));
        steps
    }

    #[test]
    fn each_outcome_is_counted_once() {
        assert_eq!(three_steps(false).tally(), "1 passed, 1 failed, 1 skipped");
        assert!(!three_steps(false).finish());
    }

    #[test]
    fn a_skip_fails_where_nothing_may_be_skipped() {
        assert_eq!(three_steps(true).tally(), "1 passed, 2 failed, 0 skipped");
        let mut partly = Steps::new(true);
        partly.step("tests", || {
            Ok(Done { skipped: vec!["no files".into()], ..Done::passed("3 tests") })
        });
        assert_eq!(partly.tally(), "0 passed, 1 failed, 0 skipped");
        assert!(!partly.finish());
    }

    #[test]
    fn a_step_that_skips_a_part_has_passed_outside_ci() {
        let mut partly = Steps::new(false);
        partly.step("tests", || {
            Ok(Done { skipped: vec!["no files".into()], ..Done::passed("3 tests") })
        });
        assert_eq!(partly.tally(), "1 passed, 0 failed, 0 skipped");
        assert!(partly.finish());
    }
}
