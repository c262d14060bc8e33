//! The program as a user runs it: the commands of its help, on real input.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::time::Duration;

use anyhow::{Context, Result, ensure};

use crate::command::output_within;
use crate::steps::Done;
use crate::{missing, picture};

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

    let scenes = said(program, &["scenes"])?;
    for scene in scenes.lines().filter_map(|line| line.split(' ').next()) {
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

/// A small comparison: its numbers, its still, and that its video plays.
pub(crate) fn a_comparison(program: &Path, out: &Path) -> Result<Done> {
    let experiment = crate::project_dir().join("xtask/smoke.toml");
    let out = out.join("smoke");
    let (experiment, folder) = (experiment.to_string_lossy(), out.to_string_lossy());
    succeeded(&answer(program, &["compare", &experiment, "--out", &folder], COMPARISON_LIMIT)?)?;

    let results = std::fs::read_to_string(out.join("results.json"))
        .context("the comparison wrote no results.json")?;
    for algorithm in ["\"random\"", "\"change\""] {
        ensure!(results.contains(algorithm), "results.json does not know {algorithm}");
    }
    not_worse(program, &out.join("results.json"))?;
    let pictures = out.join("pictures");
    ensure!(!files(&pictures, "svg")?.is_empty(), "the comparison drew no curves");
    for still in files(&pictures, "png")? {
        picture::shows_something(&still)?;
    }
    let missing = missing::to_read_a_video();
    if let Some(missing) = missing.first() {
        let skipped = vec![format!("the comparison's video: {missing}")];
        return Ok(Done { skipped, ..Done::passed("") });
    }
    let videos = files(&pictures, "mp4")?;
    let wanted = COMPARED_SCENES.len();
    ensure!(videos.len() == wanted, "wanted {wanted} videos, got {}", videos.len());
    let frames = frames_of(&videos[0])?;
    ensure!(frames == VIDEO_FRAMES, "the video has {frames} frames, not {VIDEO_FRAMES}");
    Ok(Done::passed(format!("no error grew; {frames} frames of video")))
}

/// Against the results in the repository: nothing may have got worse. When it did so on purpose, copy the new results there and
/// say so under "Results change" in the changelog.
fn not_worse(program: &Path, results: &Path) -> Result<()> {
    let kept = crate::project_dir().join("xtask/smoke.json");
    let (kept, results) = (kept.to_string_lossy(), results.to_string_lossy());
    let answer = answer(program, &["compare", &kept, &results], LIMIT)?;
    let table = String::from_utf8_lossy(&answer.stdout);
    eprint!("{table}");
    succeeded(&answer)?;
    ensure!(!table.contains("only in"), "xtask/smoke.json is of another experiment");
    Ok(())
}

/// What xtask/smoke.toml looks at.
pub(crate) const COMPARED_SCENES: [&str; 2] = ["sphere", "shadow"];

/// Half a second at 60 Hz.
const VIDEO_FRAMES: usize = 30;

/// The frames that a decoder finds, in a stream that is H.264.
fn frames_of(video: &Path) -> Result<usize> {
    let mut ffprobe = Command::new("ffprobe");
    ffprobe.args(["-v", "error", "-count_frames", "-select_streams", "v:0", "-show_entries"]);
    ffprobe.args(["stream=codec_name,nb_read_frames", "-of", "csv=p=0"]).arg(video);
    let answer = output_within(&mut ffprobe, LIMIT)?;
    succeeded(&answer)?;
    ensure!(answer.stderr.is_empty(), "{}", String::from_utf8_lossy(&answer.stderr));
    let said = String::from_utf8_lossy(&answer.stdout).trim().to_owned();
    let frames = said.strip_prefix("h264,").and_then(|frames| frames.parse().ok());
    frames.with_context(|| format!("wanted an H.264 stream, ffprobe says {said:?}"))
}

/// Files with this extension in a folder.
fn files(folder: &Path, extension: &str) -> Result<Vec<PathBuf>> {
    let entries = folder.read_dir().with_context(|| format!("no {}", folder.display()))?;
    let paths = entries.map(|entry| Ok(entry?.path())).collect::<Result<Vec<_>>>()?;
    let wanted = |path: &PathBuf| path.extension().is_some_and(|found| found == extension);
    Ok(paths.into_iter().filter(wanted).collect())
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
