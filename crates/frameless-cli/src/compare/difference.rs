//! What changed between two results.

use std::fmt::Write;
use std::path::Path;

use anyhow::anyhow;
use frameless_eval::{Difference, DifferenceRow, Measure, Results, RunGroup, Verdict};

use super::failure;
use crate::failure::Failure;
use crate::output;

/// Print it. An error if anything got worse or is gone, or if there was nothing to compare.
pub(super) fn run(a: &Path, b: &Path) -> Result<(), Failure> {
    let read = |path| Results::read(path).map_err(failure);
    let difference = Difference::between(&read(a)?, &read(b)?);
    if difference.rows.is_empty() {
        let (a, b) = (a.display(), b.display());
        let text = format!("{a} and {b} have no scene, rate and algorithm at one size in common");
        return Err(Failure::bad_input(anyhow!(text)));
    }
    output::print(&text(&difference, a, b))?;
    let (worse, gone) = (difference.count(Verdict::Worse), difference.only_in_a.len());
    if worse == 0 && gone == 0 {
        return Ok(());
    }
    let all = difference.rows.len();
    Err(Failure::other(anyhow!(
        "{worse} of {all} values got worse by more than the spread; {gone} runs of A are not in B"
    )))
}

const HEAD: &str = "\
mean over the seeds; worse or better: by more than A's spread over the seeds, 0.5 % and 0.0004 (latencies: half a refresh)
RMSE of every run, other measures where they moved

scene        samples/s        A       B   spread          algorithm
";

fn text(difference: &Difference, a: &Path, b: &Path) -> String {
    let mut text = format!("A: {}\nB: {}\n{HEAD}", a.display(), b.display());
    let is_told =
        |row: &&DifferenceRow| row.measure == Measure::Rmse || row.verdict() != Verdict::Same;
    for row in difference.rows.iter().filter(is_told) {
        text += &line(row);
    }
    for (name, groups) in [("A", &difference.only_in_a), ("B", &difference.only_in_b)] {
        for RunGroup { scene, samples_per_sec, algorithm, display } in groups {
            let (width, height, ..) = display;
            // Writing to a string cannot fail.
            let _ = writeln!(
                text,
                "only in {name}: {scene} at {samples_per_sec} samples/s and {width}×{height}, {algorithm}"
            );
        }
    }
    let count = |verdict| difference.count(verdict);
    let (better, same, worse) =
        (count(Verdict::Better), count(Verdict::Same), count(Verdict::Worse));
    text + &format!("\n{better} better, {same} the same, {worse} worse\n")
}

fn line(row: &DifferenceRow) -> String {
    let verdict = match row.verdict() {
        Verdict::Better => "better",
        Verdict::Same => "",
        Verdict::Worse => "WORSE",
    };
    let value = |value: Option<f64>| value.map_or("none".into(), |value| format!("{value:.4}"));
    let measure = match &row.measure {
        Measure::Rmse => String::new(),
        other => format!(": {}", output::printable(&other.name())),
    };
    format!(
        "{:12} {:<10} {:>7} {:>7}   {:.4}  {verdict:6}  {}{measure}\n",
        output::printable(&row.group.scene),
        row.group.samples_per_sec,
        value(row.a),
        value(row.b),
        row.spread,
        output::printable(&row.group.algorithm),
    )
}
