//! Files made to push every limit: loaded and drawn at several times by both integrators, or refused; in time, and without a colour that is
//! not finite.

use std::sync::Arc;
use std::time::{Duration, Instant};

use frameless::Size;
use frameless_scene::{Limits, LoadError, load_bytes};
use frameless_trace::{Integrator, Settings, ViewSource, World, render, thread_pool};
use serde_json::{Value, json};

/// With assertions and overflow checks, as tests are built, everything takes up to six times as long.
const LONGEST: Duration = Duration::from_secs(if cfg!(debug_assertions) { 12 } else { 2 });
const F32: u32 = 5126;
const U32: u32 = 5125;

/// A triangle at the only node; whoever wants something worse changes it.
fn triangle() -> (Value, Vec<u8>) {
    let corners = [[0.0f32, 0.0, -3.0], [1.0, 0.0, -3.0], [0.0, 1.0, -3.0]];
    let bin: Vec<u8> = corners.as_flattened().iter().flat_map(|x| x.to_le_bytes()).collect();
    let document = json!({
        "asset": {"version": "2.0"},
        "buffers": [{"byteLength": 36}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}],
        "accessors": [{"bufferView": 0, "componentType": F32, "type": "VEC3", "count": 3}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "nodes": [{"mesh": 0}],
        "scenes": [{"nodes": [0]}],
    });
    (document, bin)
}

/// The number of an accessor of these numbers.
fn add_numbers(document: &mut Value, bin: &mut Vec<u8>, kind: &str, numbers: &[f32]) -> usize {
    let parts = match kind {
        "SCALAR" => 1,
        "VEC3" => 3,
        _ => 4,
    };
    let view = json!({"buffer": 0, "byteOffset": bin.len(), "byteLength": 4 * numbers.len()});
    bin.extend(numbers.iter().flat_map(|x| x.to_le_bytes()));
    document["buffers"][0]["byteLength"] = json!(bin.len());
    let count = numbers.len() / parts;
    let view = push(document, "bufferViews", view);
    let accessor = json!({"bufferView": view, "componentType": F32, "type": kind, "count": count});
    push(document, "accessors", accessor)
}

fn push(document: &mut Value, list: &str, element: Value) -> usize {
    let list = document[list].as_array_mut().expect("a list");
    list.push(element);
    list.len() - 1
}

/// A binary file (glTF 2.0 §4.4).
fn glb(document: &Value, bin: &[u8]) -> Vec<u8> {
    let mut text = document.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    let mut bin = bin.to_vec();
    bin.resize(bin.len().next_multiple_of(4), 0);
    let mut file = b"glTF".to_vec();
    let length = (28 + text.len() + bin.len()) as u32;
    file.extend([2, length, text.len() as u32].map(u32::to_le_bytes).as_flattened());
    file.extend(b"JSON");
    file.extend(text);
    file.extend((bin.len() as u32).to_le_bytes());
    file.extend(b"BIN\0");
    file.extend(bin);
    file
}

/// Loads the file and draws it.
fn survives(what: &str, (document, bin): &(Value, Vec<u8>)) -> Result<(), LoadError> {
    let begin = Instant::now();
    let scene = load_bytes(what, &glb(document, bin), None, &Limits::default())?;
    let (secs, world) = (scene.animation.duration_secs, World::new(Arc::new(scene)));
    let pool = thread_pool(0);
    for (secs, integrator) in [
        (0.0, Integrator::Direct),
        (0.4 * secs, Integrator::Direct),
        (1e9, Integrator::Direct),
        (0.4 * secs, Integrator::Path),
    ] {
        let settings = Settings { integrator, max_depth: 3, ..Settings::default() };
        let view = ViewSource::Camera(0);
        let picture = render(&world, secs, &view, Size::new(6, 4), &settings, &pool);
        let finite = picture.iter().flatten().all(|channel| channel.is_finite());
        assert!(finite, "{what}: {integrator:?} at {secs} s: {picture:?}");
    }
    assert!(begin.elapsed() < LONGEST, "{what}: {:?}", begin.elapsed());
    Ok(())
}

fn is_drawn(what: &str, file: &(Value, Vec<u8>)) {
    survives(what, file).unwrap_or_else(|error| panic!("{error}"));
}

#[test]
fn a_chain_of_100_000_nodes_is_drawn() {
    for scale in [json!(null), json!([1.00001, 1.0, 0.99999])] {
        let (mut document, bin) = triangle();
        let count = 100_000;
        let link = |i: usize| match i + 1 < count {
            true if scale.is_null() => json!({"children": [i + 1]}),
            true => json!({"children": [i + 1], "scale": scale, "rotation": [0, 0, 0.01, 0.99995]}),
            false => json!({"mesh": 0}),
        };
        document["nodes"] = (0..count).map(link).collect();
        is_drawn("chain", &(document, bin));
    }
}

#[test]
fn any_scale_is_drawn() {
    for factor in [0.0, 1e-45, 1e-38, 1e15, 1e38, -1e38, f32::MAX] {
        for scale in [[factor; 3], [factor, 1.0, 1.0], [1.0, factor, factor]] {
            let (mut document, bin) = triangle();
            document["nodes"] = json!([{"mesh": 0, "scale": scale}, {"mesh": 0}]);
            document["scenes"][0]["nodes"] = json!([0, 1]);
            is_drawn(&format!("scale {scale:?}"), &(document, bin));
        }
    }
}

#[test]
fn keyframes_of_any_value_are_drawn() {
    for (path, kind, parts) in
        [("translation", "VEC3", 3), ("rotation", "VEC4", 4), ("scale", "VEC3", 3)]
    {
        for bad in [f32::NAN, f32::INFINITY, 0.0, 1e38, f32::MAX, -1e38] {
            for way in ["LINEAR", "STEP", "CUBICSPLINE"] {
                let per_key = if way == "CUBICSPLINE" { 3 } else { 1 };
                // Right, wrong, right, wrong; and all wrong.
                for only_bad in [false, true] {
                    let value = |k: usize| {
                        if only_bad || k / (parts * per_key) % 2 == 1 { bad } else { 0.5 }
                    };
                    let values: Vec<f32> = (0..4 * parts * per_key).map(value).collect();
                    let (mut document, mut bin) = triangle();
                    let input =
                        add_numbers(&mut document, &mut bin, "SCALAR", &[0.0, 1.0, 2.0, 3.0]);
                    let output = add_numbers(&mut document, &mut bin, kind, &values);
                    document["animations"] = json!([{
                        "samplers": [{"input": input, "output": output, "interpolation": way}],
                        "channels": [{"sampler": 0, "target": {"node": 0, "path": path}}],
                    }]);
                    is_drawn(&format!("{path} {bad} {way}"), &(document, bin));
                }
            }
        }
    }
}

/// In one line, which names the flag that lets it pass.
#[track_caller]
fn is_refused(what: &str, file: &(Value, Vec<u8>), flag: &str) {
    let begin = Instant::now();
    let refusal = survives(what, file).expect_err("more than a small file may ask for");
    assert!(begin.elapsed() < LONGEST, "{what}: {:?}", begin.elapsed());
    assert!(refusal.to_string().contains(flag), "{what}: {refusal}");
}

/// The triangle where an accessor says, which has no data: zeros.
fn instances(count: u32) -> (Value, Vec<u8>) {
    let (mut document, bin) = triangle();
    let places = json!({"componentType": F32, "type": "VEC3", "count": count});
    let places = push(&mut document, "accessors", places);
    document["nodes"][0]["extensions"] =
        json!({"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": places}}});
    (document, bin)
}

#[test]
fn half_a_billion_instances_are_refused_and_a_hundred_thousand_in_one_place_are_drawn() {
    let refusal = survives("many", &instances(500_000_000)).expect_err("beyond the limit");
    let text = refusal.to_string();
    assert!(text.contains("500000000 instances, more than the limit of 1000000"), "{text}");
    assert!(text.contains("/nodes/0/extensions/EXT_mesh_gpu_instancing"), "{text}");
    // Every ray meets them all: few are enough to see that the tree over them is built in time.
    is_drawn("instances in one place", &instances(30_000));
}

/// Clustering merged two of them at a time: minutes for a file of a kilobyte.
#[test]
fn three_hundred_thousand_triangles_in_one_place_are_drawn() {
    let (mut document, bin) = triangle();
    // With vertices of their own, as triangles with a vertex twice are dropped.
    let zeros = json!({"componentType": F32, "type": "VEC3", "count": 900_000});
    document["meshes"][0]["primitives"][0]["attributes"]["POSITION"] =
        json!(push(&mut document, "accessors", zeros));
    is_drawn("points", &(document, bin));
}

#[test]
fn fifty_thousand_triangles_in_a_row_are_drawn() {
    let (mut document, mut bin) = triangle();
    let corners: Vec<f32> = (0..50_000u16)
        .flat_map(|k| {
            let x = f32::from(k);
            [[x, 0.0, -3.0], [x + 1.0, 0.0, -3.0], [x, 1.0, -3.0]]
        })
        .flatten()
        .collect();
    let row = add_numbers(&mut document, &mut bin, "VEC3", &corners);
    document["meshes"][0]["primitives"][0]["attributes"]["POSITION"] = json!(row);
    is_drawn("a row", &(document, bin));
}

/// Every other triangle of a strip that turns is one of these; a file may have nothing else.
#[test]
fn six_million_triangles_with_all_corners_in_one_are_nothing() {
    let (mut document, bin) = triangle();
    let zeros = json!({"componentType": U32, "type": "SCALAR", "count": 6_000_000});
    let primitive = &mut document["meshes"][0]["primitives"][0];
    primitive["mode"] = json!(5);
    document["meshes"][0]["primitives"][0]["indices"] =
        json!(push(&mut document, "accessors", zeros));
    is_drawn("a strip of zeros", &(document, bin));
}

/// The triangle so many times, by indices of one byte.
fn repeated(count: usize) -> (Value, Vec<u8>) {
    let (mut document, mut bin) = triangle();
    let view = json!({"buffer": 0, "byteOffset": bin.len(), "byteLength": 3 * count});
    bin.extend([0, 1, 2].repeat(count));
    document["buffers"][0]["byteLength"] = json!(bin.len());
    let view = push(&mut document, "bufferViews", view);
    let indices =
        json!({"bufferView": view, "componentType": 5121, "type": "SCALAR", "count": 3 * count});
    document["meshes"][0]["primitives"][0]["indices"] =
        json!(push(&mut document, "accessors", indices));
    (document, bin)
}

#[test]
fn a_million_times_the_same_triangle_is_one() {
    is_drawn("one triangle a million times", &repeated(1_000_000));
    let (mut document, bin) = triangle();
    let primitive = document["meshes"][0]["primitives"][0].clone();
    document["meshes"][0]["primitives"] = json!(vec![primitive; 50_000]);
    is_drawn("one triangle in 50,000 primitives", &(document, bin));
}

/// Vertices at random: no two triangles alike, each as large as all of them.
fn soup(triangles: usize) -> (Value, Vec<u8>) {
    let (mut document, mut bin) = triangle();
    let mut word = 1u32;
    let mut number = || {
        word = word.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (word >> 8) as f32 / 16_777_216.0
    };
    let corners: Vec<f32> = (0..9 * triangles).map(|_| number()).collect();
    let places = add_numbers(&mut document, &mut bin, "VEC3", &corners);
    document["meshes"][0]["primitives"][0]["attributes"]["POSITION"] = json!(places);
    (document, bin)
}

#[test]
fn a_mesh_that_stands_in_the_file_900_times_is_read_once() {
    let (mut document, bin) = soup(10_000);
    let mesh = document["meshes"][0].clone();
    document["meshes"] = json!(vec![mesh; 900]);
    document["nodes"] = (0..900).map(|mesh| json!({"mesh": mesh})).collect();
    document["scenes"][0]["nodes"] = json!((0..900).collect::<Vec<_>>());
    is_drawn("900 meshes", &(document.clone(), bin.clone()));
    // The same accessors, but no two meshes are the same.
    document["materials"] = json!(vec![json!({}); 900]);
    for mesh in 0..900 {
        document["meshes"][mesh]["primitives"][0]["material"] = json!(mesh);
    }
    is_refused("900 materials", &(document, bin), "--max-memory");
}

#[test]
fn morph_targets_and_joints_are_counted_for_every_node() {
    let (mut document, bin) = triangle();
    document["meshes"][0]["primitives"][0]["targets"] = json!(vec![json!({"POSITION": 0}); 65_535]);
    document["meshes"][0]["weights"] = json!(vec![1e-3; 65_535]);
    document["nodes"] = (0..2_000).map(|x| json!({"mesh": 0, "translation": [x, 0, 0]})).collect();
    document["scenes"][0]["nodes"] = json!((0..2_000).collect::<Vec<_>>());
    is_refused("targets", &(document, bin), "--max-memory");

    let (mut document, mut bin) = triangle();
    let weights = add_numbers(&mut document, &mut bin, "VEC4", &[1.0, 0.0, 0.0, 0.0].repeat(3));
    let joints = json!({"componentType": 5121, "type": "VEC4", "count": 3});
    let joints = push(&mut document, "accessors", joints);
    let attributes = json!({"POSITION": 0, "JOINTS_0": joints, "WEIGHTS_0": weights});
    document["meshes"][0]["primitives"][0]["attributes"] = attributes;
    document["skins"] = json!([{"joints": vec![2_000; 2_000]}]);
    let nodes = (0..2_000).map(|_| json!({"mesh": 0, "skin": 0}));
    document["nodes"] = nodes.chain([json!({})]).collect();
    document["scenes"][0]["nodes"] = json!((0..=2_000).collect::<Vec<_>>());
    is_refused("joints", &(document, bin), "--max-memory");
}

#[test]
fn millions_of_things_of_three_bytes_are_refused() {
    for list in ["materials", "images", "textures", "samplers", "extras"] {
        let (mut document, bin) = triangle();
        document[list] = json!(vec![json!({}); 4_000_000]);
        match list {
            // Which nobody reads: the JSON alone is kept, for a moment.
            "extras" => is_drawn(list, &(document, bin)),
            _ => is_refused(list, &(document, bin), "--max-memory"),
        }
    }
}

#[test]
fn twenty_thousand_lights_are_refused_and_five_thousand_are_drawn() {
    for (count, is_allowed) in [(20_000, false), (5_000, true)] {
        let (mut document, bin) = triangle();
        document["extensions"] =
            json!({"KHR_lights_punctual": {"lights": [{"type": "point", "range": 10}]}});
        let light = |k: usize| {
            json!({"translation": [0, 0, 1e-3 * k as f64],
                "extensions": {"KHR_lights_punctual": {"light": 0}}})
        };
        document["nodes"] =
            std::iter::once(json!({"mesh": 0})).chain((0..count).map(light)).collect();
        document["scenes"][0]["nodes"] = json!((0..=count).collect::<Vec<_>>());
        match is_allowed {
            true => is_drawn("lights", &(document, bin)),
            false => is_refused("lights", &(document, bin), "--max-lights"),
        }
    }
}
