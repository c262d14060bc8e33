//! The web page in headless browsers: what it must do, and how fast it does it. Python scripts in the project's `.venv`.

use std::path::Path;
use std::time::Duration;

use anyhow::{Result, ensure};

use crate::command::{cargo, output_within, run};
use crate::missing::{self, Missing};
use crate::python::{install, python};
use crate::steps::Done;

const FOLDER: &str = "crates/frameless-web/tests/browser";

/// Three times what it takes on two free cores.
const CHECKS_WITHIN: Duration = Duration::from_secs(270);

/// Lets a browser do everything that the page offers. Screenshots stay in `out`.
pub(crate) fn page(program: &Path, out: &Path) -> Result<Done> {
    if let Some(reason) = lacks(missing::to_open_a_report()) {
        return Ok(Done::skipped(reason));
    }
    check("check_page.py", program, out)
}

/// Lets Firefox do what browsers do each in their own way.
pub(crate) fn in_firefox(program: &Path, out: &Path) -> Result<Done> {
    if let Some(reason) = lacks(missing::to_open_firefox()) {
        return Ok(Done::skipped(reason));
    }
    check("check_firefox.py", program, out)
}

fn check(script: &str, program: &Path, out: &Path) -> Result<Done> {
    let mut checks = python();
    checks.arg(format!("{FOLDER}/{script}")).arg(program).arg(out);
    let output = output_within(&mut checks, CHECKS_WITHIN)?;
    let text = String::from_utf8_lossy(&output.stdout);
    eprint!("{text}");
    ensure!(output.status.success(), "{}\n{}", last_line(&text), error_text(&output.stderr));
    Ok(Done::passed(last_line(&text)))
}

/// Measures latency, traffic and cost with an optimised program. The numbers are printed, and stay in `out`.
pub(crate) fn measure(out: &Path) -> Result<Done> {
    if let Some(reason) = lacks(missing::to_open_a_report()) {
        return Ok(Done::skipped(reason));
    }
    run(cargo(&["build", "--release", "--bin", "frameless"]))?;
    run(cargo(&["build", "--release", "-p", "frameless-web", "--example", "jpeg_frames"]))?;
    let mut measuring = python();
    measuring.arg(format!("{FOLDER}/measure.py")).arg("target/release/frameless").arg(out);
    run(measuring)?;
    Ok(Done::passed(out.display().to_string()))
}

/// Why there is nothing to run with, if so: a browser or Python is missing.
fn lacks(browser: Vec<Missing>) -> Option<String> {
    if let Some(missing) = missing::to_make_a_venv().or(browser.into_iter().next()) {
        return Some(format!("the web page: {missing}"));
    }
    let requirements = format!("{FOLDER}/requirements.txt");
    let error = install(&requirements).err()?;
    Some(format!("the web page: the packages of {requirements} could not be installed: {error:#}"))
}

fn last_line(text: &str) -> String {
    text.lines().last().unwrap_or("it printed nothing").to_owned()
}

fn error_text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}
