//! What changed between two results.

use std::fmt::Write;
use std::path::Path;

use anyhow::anyhow;
use frameless_eval::{Difference, DifferenceRow, Results, RunGroup, Verdict};

use super::failure;
use crate::failure::Failure;
use crate::output;

/// Print it. An error if anything got worse, or if there was nothing to compare.
pub(super) fn run(a: &Path, b: &Path) -> Result<(), Failure> {
    let read = |path| Results::read(path).map_err(failure);
    let difference = Difference::between(&read(a)?, &read(b)?);
    if difference.rows.is_empty() {
        let (a, b) = (a.display(), b.display());
        let text = format!("{a} and {b} have no scene, rate and algorithm at one size in common");
        return Err(Failure::bad_input(anyhow!(text)));
    }
    output::print(&text(&difference, a, b))?;
    match difference.count(Verdict::Worse) {
        0 => Ok(()),
        worse => {
            let all = difference.rows.len();
            Err(Failure::other(anyhow!("{worse} of {all} got worse by more than the spread")))
        }
    }
}

fn text(difference: &Difference, a: &Path, b: &Path) -> String {
    let mut text = format!("A: {}\nB: {}\n", a.display(), b.display());
    text += "mean RMSE, mean over the seeds; worse or better: by more than the spread over the seeds, 0.5 % and 0.0004\n\n";
    text += "scene        samples/s        A       B    B/A   spread          algorithm\n";
    for row in &difference.rows {
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
    format!(
        "{:12} {:<10} {:>7.4} {:>7.4}  {:>5.3}   {:.4}  {verdict:6}  {}\n",
        output::printable(&row.group.scene),
        row.group.samples_per_sec,
        row.a,
        row.b,
        row.ratio(),
        row.spread,
        output::printable(&row.group.algorithm),
    )
}
