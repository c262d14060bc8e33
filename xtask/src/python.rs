//! Our metrics beside other people's: a Python script with packages of its own, in the project's `.venv`.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

use anyhow::{Result, ensure};

use crate::command::{cargo, output_within, run};
use crate::missing;
use crate::steps::Done;

const REQUIREMENTS: &str = "crates/frameless-eval/tests/python/requirements.txt";
const SCRIPT: &str = "crates/frameless-eval/tests/python/check_metrics.py";

/// Wheels of 150 MB over a slow line.
const INSTALLS_WITHIN: Duration = Duration::from_secs(600);
const CHECKS_WITHIN: Duration = Duration::from_secs(120);

/// Measures pairs of pictures with our program, and lets Python check the values. What it looked at stays in `out`.
pub(crate) fn metrics(out: &Path) -> Result<Done> {
    if let Some(missing) = missing::to_make_a_venv() {
        return Ok(Done::skipped(format!("metrics against Python: {missing}")));
    }
    if let Err(error) = install(REQUIREMENTS) {
        return Ok(Done::skipped(format!(
            "metrics against Python: the packages of {REQUIREMENTS} could not be installed: {error:#}"
        )));
    }
    let folder = out.to_string_lossy();
    // Of the whole workspace, so that nothing is built again with other features than the tests have.
    run(cargo(&["build", "--workspace", "--exclude", "xtask", "--example", "metric_pairs"]))?;
    let example = std::env::current_exe()?.with_file_name("examples").join("metric_pairs");
    let mut pairs = Command::new(example.with_extension(std::env::consts::EXE_EXTENSION));
    pairs.arg(&*folder);
    run(pairs)?;
    let output = output_within(python().arg(SCRIPT).arg(&*folder), CHECKS_WITHIN)?;
    let text = String::from_utf8_lossy(&output.stdout);
    ensure!(
        output.status.success(),
        "metrics and Python disagree:\n{text}{}",
        String::from_utf8_lossy(&output.stderr)
    );
    Ok(Done::passed(text.lines().last().unwrap_or_default()))
}

/// Makes the environment if there is none; asks nobody on the network if everything in `requirements` is there.
pub(crate) fn install(requirements: &str) -> Result<()> {
    if !crate::project_dir().join(PYTHON).exists() {
        let mut venv = Command::new("python3");
        venv.args(["-m", "venv", ".venv"]).current_dir(crate::project_dir());
        checked(&mut venv)?;
    }
    let mut pip = python();
    pip.args(["-m", "pip", "install", "--quiet", "--disable-pip-version-check"]);
    pip.args(["--only-binary", ":all:", "-r", requirements]);
    // Networks fail now and then.
    checked(&mut pip).or_else(|_| checked(&mut pip))
}

const PYTHON: &str = if cfg!(windows) { ".venv/Scripts/python.exe" } else { ".venv/bin/python" };

/// The environment's Python, in the project's root.
pub(crate) fn python() -> Command {
    let mut python = Command::new(crate::project_dir().join(PYTHON));
    python.current_dir(crate::project_dir());
    python
}

/// A folder of the project.
pub(crate) fn in_project(folder: &str) -> PathBuf {
    crate::project_dir().join(folder)
}

fn checked(command: &mut Command) -> Result<()> {
    let output = output_within(command, INSTALLS_WITHIN)?;
    let said = String::from_utf8_lossy(&output.stderr);
    let last_line = said.lines().rfind(|line| !line.is_empty()).unwrap_or_default();
    ensure!(output.status.success(), "{last_line}");
    Ok(())
}
