//! `frameless compare`: algorithms against the ideal picture, or two results against each other.

mod bar;
mod difference;
mod table;

use std::path::Path;

use anyhow::anyhow;
use frameless_eval::{EvalError, Experiment, Selection, compare};

use self::bar::Bar;
use crate::args::CompareArgs;
use crate::failure::Failure;
use crate::output;

/// Run the experiment, write its folder, and print the errors; or print what changed between two results.
pub(crate) fn run(args: &CompareArgs) -> Result<(), Failure> {
    let refused = |text: String| Err(Failure::bad_input(anyhow!("{text}; see --help")));
    match (args.files.as_slice(), &args.out) {
        ([experiment], Some(out)) => run_experiment(experiment, out, args.only.as_deref()),
        ([file], None) if is_json(file) => {
            refused(format!("{}: one result alone cannot be compared, wanted two", file.display()))
        }
        ([_], None) => refused("an experiment needs --out <DIR> for its results".into()),
        ([a, b], None) if args.only.is_none() => difference::run(a, b),
        _ => refused("--out and --only belong to an experiment, not to two results".into()),
    }
}

fn is_json(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension == "json")
}

fn run_experiment(path: &Path, out: &Path, only: Option<&str>) -> Result<(), Failure> {
    let mut experiment = Experiment::read(path).map_err(failure)?;
    if let Some(only) = only {
        let selected = Selection::parse(only).and_then(|selection| selection.of(experiment));
        experiment =
            selected.map_err(|text| Failure::bad_input(anyhow!("--only {only}: {text}")))?;
    }
    let progress = Bar::new()?;
    let outcome = compare(&experiment, out, &progress);
    progress.clear();
    let results = outcome.map_err(failure)?;
    let where_to = format!("\nreport: {}\n", out.join("report.html").display());
    Ok(output::print(&(table::of(&results) + &where_to))?)
}

fn failure(error: EvalError) -> Failure {
    if error.is_bad_input() { Failure::bad_input(error) } else { Failure::other(error) }
}
