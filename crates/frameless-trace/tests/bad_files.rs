//! All public bad files in one process: none leaves a trace in what is drawn after it.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use frameless::Size;
use frameless_scene::{Limits, load};
use frameless_trace::{Integrator, Settings, ViewSource, World, render, thread_pool};
use rayon::ThreadPool;

const SIZE: Size = Size { width: 16, height: 12 };

/// `../shared`, or `None` where it is missing: then the test says so aloud, and fails in CI.
fn shared() -> Option<PathBuf> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared");
    if path.is_dir() {
        return Some(path);
    }
    assert!(std::env::var("CI").as_deref() != Ok("true"), "CI needs ../shared");
    eprintln!("SKIPPED: ../shared is missing, no bad files were drawn one after the other");
    None
}

/// By both integrators, at two moments.
fn pictures(file: &Path, pool: &ThreadPool) -> Option<Vec<[f32; 3]>> {
    let world = World::new(Arc::new(load(file, &Limits::default()).ok()?));
    let draw = |integrator, secs| {
        let settings = Settings { integrator, ..Settings::default() };
        render(&world, secs, &ViewSource::Camera(0), SIZE, &settings, pool)
    };
    let moments = Integrator::ALL.into_iter().flat_map(|by| [draw(by, 0.0), draw(by, 0.37)]);
    Some(moments.flatten().collect())
}

#[test]
fn a_good_scene_looks_the_same_after_all_bad_ones() {
    let Some(shared) = shared() else { return };
    let good = shared.join("scenes/skinned/Fox.glb");
    let pool = thread_pool(0);
    let before = pictures(&good, &pool).expect("a good file");
    let list = std::fs::read_to_string(shared.join("bad-scenes/EXPECTED.json")).unwrap();
    let list: serde_json::Value = serde_json::from_str(&list).unwrap();
    let (mut tried, mut drawn) = (0, 0);
    for entry in list["files"].as_array().unwrap() {
        let file = shared.join("bad-scenes").join(entry["file"].as_str().unwrap());
        tried += 1;
        let Some(colours) = pictures(&file, &pool) else { continue };
        drawn += 1;
        let bad = colours.iter().flatten().find(|channel| !channel.is_finite() || **channel < 0.0);
        assert_eq!(bad, None, "{}", file.display());
    }
    assert!(tried >= 112 && drawn > 10, "{tried} tried, {drawn} drawn");
    let bits = |colours: &[[f32; 3]]| {
        colours.as_flattened().iter().map(|c| c.to_bits()).collect::<Vec<_>>()
    };
    assert!(bits(&before) == bits(&pictures(&good, &pool).unwrap()), "the good scene has changed");
}
