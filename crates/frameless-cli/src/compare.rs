//! `frameless compare`: algorithms against the ideal picture.

use std::fmt::Write;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use anyhow::Context;
use frameless_eval::{Experiment, Progress, Results, compare};
use indicatif::{ProgressBar, ProgressStyle};

use crate::args::CompareArgs;
use crate::failure::Failure;
use crate::output;

/// Run the experiment, write its folder, and print the errors.
pub(crate) fn run(args: &CompareArgs) -> Result<(), Failure> {
    let experiment = Experiment::read(&args.experiment).map_err(Failure::bad_input)?;
    let progress = Bar::new()?;
    let results = compare(&experiment, &args.out, &progress).map_err(|error| {
        if error.is_bad_input() { Failure::bad_input(error) } else { Failure::other(error) }
    })?;
    progress.bar.finish_and_clear();
    let where_to = format!("\nresults, pictures and curves: {}\n", args.out.display());
    Ok(output::print(&(table(&results) + &where_to))?)
}

/// One line per run.
fn table(results: &Results) -> String {
    let mut table = format!("{}\n\n", output::printable(&results.title));
    table += "mean RMSE against the ideal, in sRGB [0, 1]; p95: its 95th percentile over the refreshes\n";
    table += "scene        samples/s  seed   mean    p95     algorithm\n";
    for run in &results.runs {
        // Writing to a string cannot fail.
        let _ = writeln!(
            table,
            "{:12} {:<10} {:<6} {:.4}  {:.4}  {}",
            run.scene,
            run.samples_per_sec,
            run.seed,
            run.rmse.mean.unwrap_or(f64::NAN),
            run.rmse.p95.unwrap_or(f64::NAN),
            run.algorithm
        );
    }
    table
}

/// A bar on the terminal, and Ctrl-C as the wish to stop before anything is written.
struct Bar {
    bar: ProgressBar,
    interrupted: Arc<AtomicBool>,
}

impl Bar {
    fn new() -> anyhow::Result<Bar> {
        let interrupted = Arc::new(AtomicBool::new(false));
        let stop = Arc::clone(&interrupted);
        ctrlc::set_handler(move || stop.store(true, Ordering::Relaxed))
            .context("cannot listen for Ctrl-C")?;
        let bar = ProgressBar::new(0);
        let style = ProgressStyle::with_template("{bar:30} {percent:>3} %, {eta} left · {msg}");
        bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
        Ok(Bar { bar, interrupted })
    }
}

impl Progress for Bar {
    fn plan(&self, work: u64) {
        self.bar.set_length(work);
    }

    fn stage(&self, what: &str) {
        self.bar.set_message(what.to_owned());
    }

    fn advance(&self, work: u64) {
        self.bar.inc(work);
    }

    fn should_stop(&self) -> bool {
        self.interrupted.load(Ordering::Relaxed)
    }
}
