//! Every bad file of `../shared/bad-scenes` is refused with its place, or drawn with a warning; none panics or hangs.

use std::panic::catch_unwind;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use frameless_scene::{Limits, LoadError, Place, Scene, load};
use serde_json::Value;

/// `../shared/bad-scenes` beside the project, unless it is missing: aloud, and not in CI.
fn bad_scenes() -> Option<PathBuf> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/bad-scenes");
    if path.is_dir() {
        return Some(path);
    }
    assert_ne!(std::env::var("CI").as_deref(), Ok("true"), "../shared/bad-scenes is missing");
    eprintln!("SKIPPED: ../shared/bad-scenes is missing");
    None
}

fn complaint(file: &Value, path: &Path, result: Result<Scene, LoadError>) -> Option<String> {
    // One file only crashed a reader once; nothing is wrong with it.
    let is_valid = file["violates"].is_null() && file["validator_errors"] == Value::Array(vec![]);
    match (file["class"].as_str().unwrap(), result) {
        ("T", Ok(scene)) if is_valid => scene.check().err(),
        ("R", Ok(scene)) => Some(format!("loaded, but must be refused: {:?}", scene.warnings)),
        ("T", Ok(scene)) if scene.warnings.is_empty() => {
            Some("loaded without a warning".to_owned())
        }
        (_, Ok(scene)) => scene.check().err(),
        (_, Err(error)) => {
            let text = error.to_string();
            let named =
                text.starts_with(&path.display().to_string()) && error.place != Place::Whole;
            (!named).then_some(text)
        }
    }
}

#[test]
fn each_is_refused_with_its_place_or_drawn_with_a_warning() {
    /// Generous: the tests share two cores, and most files take less than a millisecond.
    const LONGEST: Duration = Duration::from_secs(2);
    let Some(folder) = bad_scenes() else { return };
    let expected = std::fs::read_to_string(folder.join("EXPECTED.json")).unwrap();
    let expected: Value = serde_json::from_str(&expected).unwrap();
    let files = expected["files"].as_array().unwrap();
    let (mut failures, mut absent) = (Vec::new(), 0);
    for file in files {
        let path = folder.join(file["file"].as_str().unwrap());
        if !path.exists() {
            eprintln!("listed in EXPECTED.json, but not there: {}", path.display());
            absent += 1;
            continue;
        }
        let begin = Instant::now();
        let outcome = catch_unwind(|| load(&path, &Limits::default()));
        if begin.elapsed() > LONGEST {
            failures.push(format!("{}: took {:?}", path.display(), begin.elapsed()));
        }
        if let Ok(result) = &outcome {
            match result {
                Ok(scene) => eprintln!("{} {}: {:?}", file["class"], file["file"], scene.warnings),
                Err(error) => eprintln!("{} {}", file["class"], error),
            }
        }
        let complaint = match outcome {
            Err(_) => Some("panicked".to_owned()),
            Ok(result) => complaint(file, &path, result),
        };
        failures.extend(complaint.map(|complaint| format!("{}: {complaint}", path.display())));
    }
    // One of the 112 listed files is not in the folder as it was published.
    assert!(absent <= 1, "{absent} files that EXPECTED.json lists are not there");
    assert!(failures.is_empty(), "{failures:#?}");
    assert_eq!(files.len(), 112);
}
