//! Small files that ask for much, through the whole program: drawn, or refused in one line, in half a gibibyte and in time.

use std::time::Duration;

use serde_json::{Value, json};

use crate::run::frameless_within;

/// With assertions and overflow checks, as tests are built, everything takes up to six times as long.
const LIMIT: Duration = Duration::from_secs(if cfg!(debug_assertions) { 12 } else { 2 });
const MEMORY_KIB: u32 = 512 << 10;
const F32: u32 = 5126;
const U32: u32 = 5125;

/// A triangle at the only node, its vertices percent-encoded in the file; whoever wants something worse changes it.
fn triangle() -> Value {
    let corners = [[0.0f32, 0.0, -3.0], [1.0, 0.0, -3.0], [0.0, 1.0, -3.0]];
    let bytes = corners.as_flattened().iter().flat_map(|x| x.to_le_bytes());
    let data: String = bytes.map(|byte| format!("%{byte:02x}")).collect();
    json!({
        "asset": {"version": "2.0"},
        "buffers": [{"byteLength": 36, "uri": format!("data:application/octet-stream,{data}")}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}],
        "accessors": [
            {"bufferView": 0, "componentType": F32, "type": "VEC3", "count": 3},
            {"componentType": U32, "type": "SCALAR", "count": 6_000_000},
        ],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "nodes": [{"mesh": 0}],
        "scenes": [{"nodes": [0]}],
    })
}

/// `word`: of the error's line; none: it is drawn.
#[track_caller]
fn takes(what: &str, file: &Value, word: Option<&str>) {
    let folder = tempfile::tempdir().unwrap();
    let (scene, out) = (folder.path().join("scene.gltf"), folder.path().join("out.png"));
    std::fs::write(&scene, file.to_string()).unwrap();
    let [scene, path] = [&scene, &out].map(|path| path.to_string_lossy().into_owned());
    let arguments = ["render", &scene, "--size", "128x96", "-o", &path];
    let run = frameless_within(MEMORY_KIB, &arguments);
    assert!(run.duration < LIMIT, "{what}: {:?}", run.duration);
    match word {
        Some(word) => drop(run.refused(2, word)),
        None => assert!(run.succeeded().out.is_empty() && out.exists(), "{what}: no picture"),
    }
}

#[test]
fn small_files_stay_small() {
    takes("a triangle", &triangle(), None);

    let mut strip = triangle();
    strip["meshes"][0]["primitives"][0]["mode"] = json!(5);
    strip["meshes"][0]["primitives"][0]["indices"] = json!(1);
    takes("six million times one vertex", &strip, None);

    let mut materials = triangle();
    materials["materials"] = json!(vec![json!({}); 4_000_000]);
    takes("four million materials", &materials, Some("/materials: "));

    let mut extras = triangle();
    extras["extras"] = json!(vec![json!({"a": 0}); 1_000_000]);
    takes("a million small objects", &extras, None);

    let mut primitives = triangle();
    let primitive = primitives["meshes"][0]["primitives"][0].clone();
    primitives["meshes"][0]["primitives"] = json!(vec![primitive; 100_000]);
    takes("100,000 times the same primitive", &primitives, None);

    let mut meshes = triangle();
    let mesh = meshes["meshes"][0].clone();
    meshes["meshes"] = json!(vec![mesh; 50_000]);
    meshes["nodes"] = (0..50_000).map(|mesh| json!({"mesh": mesh})).collect();
    meshes["scenes"][0]["nodes"] = json!((0..50_000).collect::<Vec<_>>());
    takes("50,000 times the same mesh", &meshes, None);

    let mut targets = triangle();
    targets["meshes"][0]["primitives"][0]["targets"] = json!(vec![json!({"POSITION": 0}); 65_535]);
    targets["meshes"][0]["weights"] = json!(vec![1e-3; 65_535]);
    targets["nodes"] = json!(vec![json!({"mesh": 0}); 2_000]);
    targets["scenes"][0]["nodes"] = json!((0..2_000).collect::<Vec<_>>());
    takes("65,535 targets at 2,000 nodes", &targets, Some("--max-memory"));
}
