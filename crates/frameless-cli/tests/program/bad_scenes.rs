//! Public files that break other loaders, through the whole program.

use std::path::{Path, PathBuf};
use std::time::Duration;

use crate::run::frameless_within;

/// Loading and drawing 8×8 pixels of any of these small files; far above what one takes, far below a hang.
const LIMIT: Duration = Duration::from_secs(2);

/// Memory that may be written to: half a gibibyte, the stacks of all threads included.
const MEMORY_KIB: u32 = 512 << 10;

struct Expected {
    file: PathBuf,
    must_be_refused: bool,
}

/// The list, or `None` where the files are not at hand: then the test says so aloud, and fails in CI.
fn expected() -> Option<Vec<Expected>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/bad-scenes");
    let Ok(text) = std::fs::read_to_string(folder.join("EXPECTED.json")) else {
        let in_ci = std::env::var("CI").is_ok_and(|ci| ci == "true");
        assert!(!in_ci, "../shared/bad-scenes is missing");
        eprintln!("SKIPPED: ../shared/bad-scenes is missing: no public bad files were tried");
        return None;
    };
    let list: serde_json::Value = serde_json::from_str(&text).unwrap();
    let files = list["files"].as_array().unwrap().iter().map(|entry| Expected {
        file: folder.join(entry["file"].as_str().unwrap()),
        must_be_refused: entry["class"] == "R",
    });
    Some(files.collect())
}

/// What is wrong with how the program takes this file; `None` if nothing is.
fn verdict(expected: &Expected, out: &Path) -> Option<String> {
    let file = expected.file.to_string_lossy().into_owned();
    let name = expected.file.file_name().unwrap().to_string_lossy().into_owned();
    let arguments = ["render", &file, "--size", "8x8", "-o", &out.to_string_lossy()];
    let run = frameless_within(MEMORY_KIB, &arguments);
    let errors: Vec<&str> = run.err.lines().filter(|line| line.starts_with("error: ")).collect();
    let complaint = match run.code {
        Some(0) if expected.must_be_refused => "drawn, but must be refused",
        Some(0) if !out.exists() => "drawn, but there is no picture",
        Some(0) => "",
        Some(2) if errors.len() != 1 || run.err.lines().count() != 1 => "not refused in one line",
        Some(2) if !errors[0].contains(&name) => "refused without naming the file",
        Some(2) if out.exists() => "refused, but there is a picture",
        Some(2) => "",
        _ => "neither drawn nor refused",
    };
    // Absent after a refusal.
    let _ = std::fs::remove_file(out);
    let slow = run.duration > LIMIT;
    if complaint.is_empty() && !slow {
        return None;
    }
    let complaint = if slow { "too slow" } else { complaint };
    Some(format!("{file}: {complaint}, {:?}, {:.1?}: {}", run.code, run.duration, run.err))
}

#[test]
fn public_bad_files_are_refused_by_name_or_drawn_and_never_crash() {
    let Some(list) = expected() else { return };
    assert!(list.len() >= 100, "only {} files", list.len());
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out.png");
    let wrong: Vec<String> = list.iter().filter_map(|file| verdict(file, &out)).collect();
    assert!(wrong.is_empty(), "{} of {}:\n{}", wrong.len(), list.len(), wrong.join("\n"));
}
