//! The program as a user runs it: the commands of its help, on real input.

use std::path::Path;
use std::process::{Command, Output};
use std::time::Duration;

use anyhow::{Result, ensure};

use crate::command::output_within;
use crate::picture;
use crate::steps::Done;

/// Each of these commands takes a second or two; this is a hang.
const LIMIT: Duration = Duration::from_secs(60);

/// The tiny comparison takes a few seconds on two cores.
const COMPARISON_LIMIT: Duration = Duration::from_secs(240);

/// Help, a picture, what is in a scene, one pixel, and a mistake.
pub(crate) fn as_a_user(program: &Path, out: &Path) -> Result<Done> {
    let help = said(program, &["--help"])?;
    for command in ["view", "compare", "render", "trace", "info", "scenes"] {
        ensure!(help.contains(command), "`frameless --help` does not name `{command}`");
    }

    let ideal = out.join("ideal.png");
    let ideal_name = ideal.to_string_lossy();
    said(program, &["render", "sphere", "--time", "0.5", "--size", "256x192", "-o", &ideal_name])?;
    let (width, height) = picture::shows_something(&ideal)?;
    ensure!((width, height) == (256, 192), "asked for 256×192 pixels, got {width}×{height}");

    for scene in said(program, &["scenes"])?.lines().filter_map(|line| line.split(' ').next()) {
        ensure!(said(program, &["info", scene])?.contains("triangles"), "no triangles in {scene}");
    }
    said(program, &["trace", "sphere", "--pixel", "128,96", "--time", "0.5"])?;

    let mistake = answer(program, &["info", "no-such-scene.glb"], LIMIT)?;
    let complaint = String::from_utf8_lossy(&mistake.stderr).into_owned();
    ensure!(
        mistake.status.code() == Some(2) && complaint.lines().count() == 1,
        "a missing file ended with {}: {complaint}",
        mistake.status
    );
    Ok(Done::passed(format!("{}", ideal.display())))
}

/// A small comparison: its report, its numbers, and that its video plays.
pub(crate) fn a_comparison(program: &Path, out: &Path) -> Result<Done> {
    let experiment = crate::project_dir().join("experiments/smoke.toml");
    let arguments =
        ["compare", &experiment.to_string_lossy(), "--out", &out.join("smoke").to_string_lossy()]
            .map(String::from);
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    succeeded(&answer(program, &arguments, COMPARISON_LIMIT)?)?;
    Ok(Done::passed(""))
}

/// What a command that must succeed printed.
fn said(program: &Path, arguments: &[&str]) -> Result<String> {
    let answer = answer(program, arguments, LIMIT)?;
    succeeded(&answer)?;
    Ok(String::from_utf8_lossy(&answer.stdout).into_owned())
}

fn answer(program: &Path, arguments: &[&str], limit: Duration) -> Result<Output> {
    output_within(Command::new(program).args(arguments), limit)
}

fn succeeded(answer: &Output) -> Result<()> {
    let complaint = String::from_utf8_lossy(&answer.stderr);
    ensure!(answer.status.success(), "it ended with {}: {}", answer.status, complaint.trim_end());
    Ok(())
}
