//! Project chores; `cargo xtask help` lists them.

mod browser;
mod command;
mod contact_sheet;
mod missing;
mod package;
mod picture;
mod program;
mod python;
mod steps;
mod test;
mod web;
mod window;

use std::path::PathBuf;
use std::process::ExitCode;

const HELP: &str = "\
Project chores. Run them from anywhere in the checkout:

  cargo xtask test           everything that CI checks: formatting, clippy, all tests, the program as a
                             user runs it, a small comparison with its video and report, the web page, the window, the
                             Python package with its examples
  cargo xtask smoke-window   only the window: opens it on a virtual screen and looks at a screenshot
  cargo xtask smoke-report   only a small comparison: nothing got worse, and its report opens in a browser
  cargo xtask smoke-web      only the web page: what it must do, in headless Chromium and Firefox
  cargo xtask measure-web    the web page's latency, traffic and cost, in a headless browser; minutes, and a quiet machine
  cargo xtask contact-sheet  every public scene on one page, beside what it is known to show; minutes
  cargo xtask measure-scenes real scenes beside Mitsuba 3: samples per second, edits, loading, memory; many minutes, and a quiet machine
  cargo xtask python         only the Python package: wheel, tests, types, reference, examples, notebook
  cargo xtask help           this text

What is missing on this machine is named together with the way to install it, and the checks that need it
are skipped aloud. With CI=true in the environment a skipped check is a failure.

Exit code: 0 if everything passed, 1 otherwise, 2 for an unknown chore.";

fn main() -> ExitCode {
    let chore: Vec<String> = std::env::args().skip(1).collect();
    let passed = match chore.iter().map(String::as_str).collect::<Vec<_>>().as_slice() {
        ["test"] => test::everything(),
        ["smoke-window"] => test::only_window(),
        ["smoke-report"] => test::only_report(),
        ["smoke-web"] => test::only_web_page(),
        ["measure-web"] => test::measure_web_page(),
        ["contact-sheet"] => test::contact_sheet(),
        ["measure-scenes"] => test::measure_scenes(),
        ["python"] => test::only_python(),
        [] | ["help" | "--help" | "-h"] => {
            println!("{HELP}");
            true
        }
        other => {
            eprintln!("error: no chore `{}`; see `cargo xtask help`", other.join(" "));
            return ExitCode::from(2);
        }
    };
    if passed { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

/// The checkout that this program was built from.
fn project_dir() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("..")
}
