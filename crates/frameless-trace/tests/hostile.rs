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
    let secs = scene.animation.duration_secs;
    let world = World::open(what, Arc::new(scene), &Limits::default())?;
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
    assert!(text.contains("500000000 instances, more than the limit of 500000"), "{text}");
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

/// Eight million triangles, and ten seconds, of 32 MB of zeros.
#[test]
fn bytes_that_nothing_refers_to_speak_for_nothing() {
    let (mut document, bin) = soup(10_000);
    let primitive = document["meshes"][0]["primitives"][0].clone();
    document["materials"] = json!(vec![json!({}); 400]);
    let primitives = (0..400).map(|material| {
        let mut primitive = primitive.clone();
        primitive["material"] = json!(material);
        primitive
    });
    document["meshes"][0]["primitives"] = primitives.collect();
    is_refused("a soup in 400 materials", &(document.clone(), bin.clone()), "--max-memory");
    let padding = json!({"buffer": 0, "byteOffset": bin.len(), "byteLength": 32 << 20});
    push(&mut document, "bufferViews", padding);
    let padded = [bin.clone(), vec![0; 32 << 20]].concat();
    document["buffers"][0]["byteLength"] = json!(padded.len());
    is_refused("and zeros", &(document.clone(), padded), "--max-memory");
    // Nor do blanks, and what nobody reads of JSON.
    document["buffers"][0]["byteLength"] = json!(bin.len());
    document["bufferViews"].as_array_mut().expect("a list").pop();
    document["extras"] = json!(" ".repeat(32 << 20));
    is_refused("and blanks", &(document, bin), "--max-memory");
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

/// `direct` looks at every one from every point: 20 s for a picture of 512×384 with 5,000.
#[test]
fn five_thousand_lights_are_refused_and_three_hundred_are_drawn() {
    for (count, is_allowed) in [(20_000, false), (5_000, false), (300, true)] {
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

/// Moves node 0, from where it is by a metre, in a second.
fn add_motion(document: &mut Value, bin: &mut Vec<u8>, nodes: usize) {
    let input = add_numbers(document, bin, "SCALAR", &[0.0, 1.0]);
    let output = add_numbers(document, bin, "VEC3", &[0.0, 0.0, 0.0, 1.0, 1.0, 1.0]);
    let channel =
        |node: usize| json!({"sampler": 0, "target": {"node": node, "path": "translation"}});
    document["animations"] = json!([{
        "samplers": [{"input": input, "output": output}],
        "channels": (0..nodes).map(channel).collect::<Vec<_>>(),
    }]);
}

/// From 840 bytes: 800 MB, and rays of tens of seconds, as nothing that moves is left out where it stands in one place.
#[test]
fn nine_hundred_thousand_instances_that_move_are_refused() {
    let (mut document, mut bin) = instances(900_000);
    add_motion(&mut document, &mut bin, 1);
    is_refused("instances that move", &(document, bin), "--max-instances");
    // Within what a small file may place, but all in one place.
    let (mut document, mut bin) = instances(30_000);
    add_motion(&mut document, &mut bin, 1);
    is_refused("instances that move in one place", &(document, bin), "--max-overlap");
}

/// A grid of so many squares along each side, a metre large, with its corners at random heights up to a centimetre.
fn add_grid(document: &mut Value, bin: &mut Vec<u8>, side: u32) {
    let mut word = 1u32;
    let mut height = || {
        word = word.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (word >> 8) as f32 / 16_777_216.0 * 0.01
    };
    let corner = |k: u32| k as f32 / side as f32;
    let corners: Vec<f32> = (0..=side)
        .flat_map(|y| (0..=side).map(move |x| (x, y)))
        .flat_map(|(x, y)| [corner(x), corner(y), height() - 3.0])
        .collect();
    let places = add_numbers(document, bin, "VEC3", &corners);
    let squares = (0..side).flat_map(|y| (0..side).map(move |x| y * (side + 1) + x));
    let indices: Vec<u8> = squares
        .flat_map(|a| [a, a + 1, a + side + 1, a + 1, a + side + 2, a + side + 1])
        .flat_map(u32::to_le_bytes)
        .collect();
    let view = json!({"buffer": 0, "byteOffset": bin.len(), "byteLength": indices.len()});
    bin.extend(&indices);
    document["buffers"][0]["byteLength"] = json!(bin.len());
    let view = push(document, "bufferViews", view);
    let indices = json!({"bufferView": view, "componentType": U32, "type": "SCALAR",
        "count": indices.len() / 4});
    let indices = push(document, "accessors", indices);
    document["meshes"][0]["primitives"][0] =
        json!({"attributes": {"POSITION": places}, "indices": indices});
}

/// Tens of seconds for a picture, each ray through all of them: not the same place, so that none is left out.
#[test]
fn what_lies_nearly_in_one_place_many_times_is_refused() {
    let refused = |what: &str, document: Value, bin: Vec<u8>| {
        is_refused(what, &(document, bin), "--max-overlap");
    };
    let at = |step: f64| {
        let (mut document, mut bin) = triangle();
        add_grid(&mut document, &mut bin, 100);
        document["nodes"] = (0..5_000)
            .map(|k| json!({"mesh": 0, "translation": [0, 0, step * k as f64]}))
            .collect();
        document["scenes"][0]["nodes"] = json!((0..5_000).collect::<Vec<_>>());
        (document, bin)
    };
    let (document, bin) = at(1e-6);
    refused("nodes a micrometre apart", document, bin);
    // A triangle far away makes the world large, and the crowd a small part of it.
    let (mut document, bin) = at(1e-6);
    document["nodes"][0]["translation"] = json!([1e6, 1e6, 1e6]);
    refused("nodes a micrometre apart in a large world", document, bin);
    let (mut document, mut bin) = at(1.0);
    add_motion(&mut document, &mut bin, 5_000);
    refused("nodes that are moved there", document, bin);
    let (mut document, mut bin) = triangle();
    let corners = |k: u16| {
        let z = -3.0 - f32::from(k) * 1e-6;
        [[0.0, 0.0, z], [1.0, 0.0, z], [0.0, 1.0, z]]
    };
    let corners: Vec<f32> = (0..30_000).flat_map(corners).flatten().collect();
    let sheets = add_numbers(&mut document, &mut bin, "VEC3", &corners);
    document["meshes"][0]["primitives"][0]["attributes"]["POSITION"] = json!(sheets);
    refused("vertices of their own", document, bin);
}

/// Half a minute, and 1.3 GB.
#[test]
fn sixty_four_sets_of_joints_are_counted_for_every_node() {
    let (mut document, mut bin) = triangle();
    add_grid(&mut document, &mut bin, 39);
    let vertices = 40 * 40;
    let whole = [1.0, 0.0, 0.0, 0.0].repeat(vertices);
    let weights = add_numbers(&mut document, &mut bin, "VEC4", &whole);
    let joints = json!({"componentType": 5121, "type": "VEC4", "count": vertices});
    let joints = push(&mut document, "accessors", joints);
    let attributes = &mut document["meshes"][0]["primitives"][0]["attributes"];
    for set in 0..64 {
        attributes[format!("JOINTS_{set}")] = json!(joints);
        attributes[format!("WEIGHTS_{set}")] = json!(weights);
    }
    document["skins"] = json!([{"joints": [1_000]}]);
    let nodes = (0..1_000).map(|x| json!({"mesh": 0, "skin": 0, "translation": [x, 0, 0]}));
    document["nodes"] = nodes.chain([json!({})]).collect();
    document["scenes"][0]["nodes"] = json!((0..=1_000).collect::<Vec<_>>());
    is_refused("sets of joints", &(document, bin), "--max-memory");
}

/// Targets that displace nothing, and weights of them: seconds, and what moves them as much again.
#[test]
fn weights_of_many_targets_are_counted_for_every_node() {
    let with_nodes = |targets: usize, nodes: usize| {
        let (mut document, bin) = triangle();
        document["meshes"][0]["primitives"][0]["targets"] = json!(vec![json!({}); targets]);
        document["nodes"] = json!(vec![json!({"mesh": 0}); nodes]);
        document["scenes"][0]["nodes"] = json!((0..nodes).collect::<Vec<_>>());
        (document, bin)
    };
    let (mut document, bin) = with_nodes(10_000, 6_500);
    document["meshes"][0]["weights"] = json!(vec![0; 10_000]);
    is_refused("weights", &(document, bin), "--max-memory");

    let (mut document, mut bin) = with_nodes(8_000, 700);
    let input = add_numbers(&mut document, &mut bin, "SCALAR", &[0.0]);
    let zeros = json!({"componentType": F32, "type": "SCALAR", "count": 8_000});
    let output = push(&mut document, "accessors", zeros);
    let channel = |node: usize| json!({"sampler": 0, "target": {"node": node, "path": "weights"}});
    document["animations"] = json!([{
        "samplers": [{"input": input, "output": output}],
        "channels": (0..700).map(channel).collect::<Vec<_>>(),
    }]);
    is_refused("weights that move", &(document, bin), "--max-memory");
}

#[test]
fn two_hundred_thousand_animations_of_nothing_are_read() {
    let (mut document, bin) = triangle();
    document["animations"] = json!(vec![json!({"samplers": [], "channels": []}); 200_000]);
    is_drawn("animations", &(document, bin));
}

/// A chunk of a PNG, with a checksum of zeros unless it is looked at.
fn chunk(kind: &[u8; 4], data: &[u8]) -> Vec<u8> {
    let step =
        |crc: u32| (0..8).fold(crc, |crc, _| (crc >> 1) ^ (0xedb8_8320 & (crc & 1).wrapping_neg()));
    let body = [kind, data].concat();
    let crc = !body.iter().fold(!0, |crc: u32, byte| step(crc ^ u32::from(*byte)));
    [&(data.len() as u32).to_be_bytes(), &body[..], &crc.to_be_bytes()].concat()
}

/// A PNG of one pixel.
fn png(more_chunks: &[u8]) -> Vec<u8> {
    // zlib: stored, and the checksum of (0, 7).
    let data = [0x78, 0x01, 1, 2, 0, 0xfd, 0xff, 0, 7, 0, 9, 0, 8];
    [
        b"\x89PNG\r\n\x1a\n",
        &chunk(b"IHDR", &[0, 0, 0, 1, 0, 0, 0, 1, 8, 0, 0, 0, 0])[..],
        more_chunks,
        &chunk(b"IDAT", &data),
        &chunk(b"IEND", &[]),
    ]
    .concat()
}

/// The triangle with a picture in each of so many materials, all of the bytes of one; each of a view of its own that is some bytes shorter
/// than the one before, or all of the same.
fn pictures(count: usize, picture: &[u8], kind: &str, views: usize) -> (Value, Vec<u8>) {
    let (mut document, mut bin) = triangle();
    for shorter in 0..views {
        let length = picture.len() - shorter;
        let view = json!({"buffer": 0, "byteOffset": bin.len(), "byteLength": length});
        push(&mut document, "bufferViews", view);
    }
    bin.extend(picture);
    document["buffers"][0]["byteLength"] = json!(bin.len());
    let image = |k: usize| json!({"bufferView": 1 + k % views, "mimeType": kind});
    document["images"] = (0..count).map(image).collect();
    document["textures"] = (0..count).map(|k| json!({"source": k})).collect();
    let material = |k: usize| json!({"pbrMetallicRoughness": {"baseColorTexture": {"index": k}}});
    document["materials"] = (0..count).map(material).collect();
    document["meshes"][0]["primitives"][0]["material"] = json!(0);
    (document, bin)
}

/// Six seconds: for each picture all chunks were looked through, twice.
#[test]
fn a_png_of_300_000_empty_chunks_in_five_thousand_images_is_looked_through_a_few_times() {
    let empty = chunk(b"tEXt", &[]).repeat(300_000);
    let picture = [png(&empty), vec![0; 5_000]].concat();
    for views in [1, 5_000] {
        is_drawn("chunks", &pictures(5_000, &picture, "image/png", views));
    }
}

/// A progressive JPEG (ITU T.81) of flat channels: a DC scan of each, of which every block is one bit.
fn progressive_jpeg(side: u16, channels: u8) -> Vec<u8> {
    let segment = |kind: u8, data: &[u8]| {
        [&[0xff, kind], &(data.len() as u16 + 2).to_be_bytes()[..], data].concat()
    };
    let [high, low] = side.to_be_bytes();
    let frame = [8, high, low, high, low, channels].into_iter();
    let frame: Vec<u8> = frame.chain((1..=channels).flat_map(|k| [k, 0x11, 0])).collect();
    let codes: Vec<u8> = [vec![0x00, 1], vec![0; 15], vec![0]].concat();
    let mut file = [
        vec![0xff, 0xd8],
        segment(0xdb, &[vec![0], vec![1; 64]].concat()),
        segment(0xc2, &frame),
        segment(0xc4, &codes),
    ]
    .concat();
    let blocks = usize::from(side / 8).pow(2);
    for k in 1..=channels {
        file.extend(segment(0xda, &[1, k, 0, 0, 0, 0]));
        file.extend(vec![0; blocks.div_ceil(8)]);
    }
    file.extend([0xff, 0xd9]);
    file
}

/// All of their coefficients are kept until the last scan: 650 MB for four channels.
#[test]
fn what_a_progressive_jpeg_takes_is_known_before_it_is_decoded() {
    for (side, channels, is_drawn) in [(64, 3, true), (7_680, 3, false), (7_680, 4, false)] {
        let file = pictures(1, &progressive_jpeg(side, channels), "image/jpeg", 1);
        survives("a progressive JPEG", &file).unwrap_or_else(|error| panic!("{error}"));
        let scene = load_bytes("a", &glb(&file.0, &file.1), None, &Limits::default());
        let warnings = scene.expect("it is drawn").warnings.join("\n");
        let refused = warnings.contains("pixels in images of few bytes");
        assert_eq!(refused, !is_drawn, "{side}, {channels} channels: {warnings}");
    }
}

/// Eight seconds for a picture: each ray looked up the alpha of all of them.
#[test]
fn fifteen_hundred_masked_sheets_behind_each_other_are_drawn() {
    let (mut document, mut bin) = triangle();
    add_grid(&mut document, &mut bin, 1);
    document["materials"] = json!([{"alphaMode": "MASK", "alphaCutoff": 2}]);
    document["meshes"][0]["primitives"][0]["material"] = json!(0);
    document["nodes"] =
        (0..1_500).map(|k| json!({"mesh": 0, "translation": [0, 0, -0.01 * k as f64]})).collect();
    document["scenes"][0]["nodes"] = json!((0..1_500).collect::<Vec<_>>());
    is_drawn("masked sheets", &(document, bin));
}

/// Triangles from these corners; with a camera if that is somewhere else than the origin.
fn of_corners(corners: &[[f32; 3]], instances: &[Value]) -> (Value, Vec<u8>) {
    let (mut document, mut bin) = triangle();
    let places = add_numbers(&mut document, &mut bin, "VEC3", corners.as_flattened());
    document["meshes"][0]["primitives"][0]["attributes"]["POSITION"] = json!(places);
    document["nodes"] = instances.into();
    document["scenes"][0]["nodes"] = json!((0..instances.len()).collect::<Vec<_>>());
    (document, bin)
}

/// Numbers in [0, 1).
fn numbers() -> impl FnMut() -> f32 {
    let mut word = 1u32;
    move || {
        word = word.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (word >> 8) as f32 / 16_777_216.0
    }
}

/// Twelve seconds for a picture: over all directions a ray asks a thousand boxes, along the slab six thousand.
#[test]
fn a_slab_of_needles_that_is_seen_along_itself_is_refused() {
    let mut number = numbers();
    let mut needle = || {
        let [x, y, z] = [100.0 * number() - 50.0, number(), 100.0 * number() - 50.0];
        let [a, b, c] = [number(), number(), number()].map(|side| (side - 0.5).signum() * 0.5);
        let end = |way: f32, w: f32| [x + way * a + w, y + way * b, z + way * c - w];
        [end(-1.0, -5e-4), end(-1.0, 5e-4), end(1.0, 0.0)]
    };
    let corners: Vec<_> = (0..5_000).flat_map(|_| needle()).collect();
    let slab = |yfov: f32| {
        let mut nodes: Vec<Value> = (0..60u8)
            .map(|k| f32::from(k).sin_cos())
            .map(|(sine, cosine)| json!({"mesh": 0, "rotation": [0, sine, 0, cosine]}))
            .collect();
        nodes.push(json!({"camera": 0, "translation": [0, 0.5, 70]}));
        let (mut document, bin) = of_corners(&corners, &nodes);
        document["cameras"] =
            json!([{"type": "perspective", "perspective": {"yfov": yfov, "znear": 0.1}}]);
        (document, bin)
    };
    is_refused("a slab", &slab(0.02), "--max-overlap");
    // Of which most of the picture sees nothing.
    is_drawn("a slab in a wide picture", &slab(2.8));
}

/// Refused for what lies on a line through all of them, though most of the picture stops at the first or sees none.
#[test]
fn a_bundle_of_long_cables_is_drawn() {
    let mut number = numbers();
    let turn = glam::Quat::from_xyzw(0.27, 0.27, 0.0, 0.924).normalize();
    let mut cable = || {
        let [a, b] =
            [-5.0f32, 5.0].map(|z| glam::Vec3::new(2.0 * number() - 1.0, 2.0 * number() - 1.0, z));
        let (e, f) = (0.01 * glam::Vec3::X, 0.01 * glam::Vec3::Y);
        let sides = [(e, f), (f, -e), (-e, -f), (-f, e)];
        sides.into_iter().flat_map(move |(u, v)| [a + u, a + v, b + v, a + u, b + v, b + u])
    };
    let corners: Vec<_> = (0..2_000)
        .flat_map(|_| cable().map(|corner| corner.to_array()).collect::<Vec<_>>())
        .collect();
    let nodes = [json!({"mesh": 0, "rotation": turn.to_array()})];
    is_drawn("cables", &of_corners(&corners, &nodes));
}
