//! What is fuzzed: bytes that come from outside are refused, or become a scene that can be drawn. None of these may panic, hang, take much
//! memory, or give a colour that is not finite.
//!
//! The fuzzer runs them ([README](../README.md)); so does a test, on the inputs that fuzzing has found to reach something new.

use std::path::Path;
use std::sync::{Arc, OnceLock};

use frameless::Size;
use frameless_eval::Experiment;
use frameless_scene::{Limits, load_bytes};
use frameless_trace::{Integrator, Settings, ViewSource, World, render, thread_pool};
use rayon::ThreadPool;
use serde_json::{Value, json};

/// What is done with an input.
pub type Target = fn(&[u8]);

/// Every target by its name.
pub const TARGETS: [(&str, Target); 5] = [
    ("gltf", gltf),
    ("accessors", accessors),
    ("animation", animation),
    ("image", image),
    ("experiment", experiment),
];

/// A whole file.
pub fn gltf(data: &[u8]) {
    draw(data);
}

/// Tables of numbers: views and accessors with any offset, count, stride, type, and sparse parts.
pub fn accessors(data: &[u8]) {
    let mut bytes = Bytes(data);
    let views: Vec<Value> = (0..3).map(|_| view(&mut bytes)).collect();
    let accessors: Vec<Value> = (0..4).map(|_| accessor(&mut bytes)).collect();
    let names = ["NORMAL", "TEXCOORD_0", "COLOR_0", "TANGENT", "JOINTS_0", "WEIGHTS_0"];
    let extra = bytes.pick(&names);
    let mode = bytes.number();
    let primitive = json!({"attributes": {"POSITION": 0, extra: 1}, "indices": 2, "mode": mode});
    let file = json!({
        "asset": {"version": "2.0"},
        "buffers": [{"byteLength": bytes.0.len()}],
        "bufferViews": views,
        "accessors": accessors,
        "meshes": [{"primitives": [primitive]}],
        "nodes": [{"mesh": 0}],
    });
    draw(&glb(&file, bytes.0));
}

/// A triangle that is moved, turned, scaled, bent by a joint or morphed, by keys of any value.
pub fn animation(data: &[u8]) {
    let mut bytes = Bytes(data);
    let paths = ["translation", "rotation", "scale", "weights", "pointer"];
    let (path, ways) = (bytes.pick(&paths), ["LINEAR", "STEP", "CUBICSPLINE"]);
    let (way, node) = (bytes.pick(&ways), bytes.below(3));
    let (keys, width) =
        (bytes.below(9), [3, 4, 3, 1, 1][paths.iter().position(|p| *p == path).unwrap_or(0)]);
    let per_key = if way == "CUBICSPLINE" { 3 } else { 1 };
    let (kind, count) = match width {
        1 => ("SCALAR", keys * per_key),
        3 => ("VEC3", keys * per_key),
        _ => ("VEC4", keys * per_key),
    };
    let triangle = [0.0f32, 0.0, -3.0, 1.0, 0.0, -3.0, 0.0, 1.0, -3.0];
    let mut bin: Vec<u8> = triangle.iter().flat_map(|x| x.to_le_bytes()).collect();
    bin.extend([[0u8, 1, 0, 1], [1, 0, 1, 0], [0, 1, 1, 0]].as_flattened());
    for weight in [[0.5f32, 0.5, 0.0, 0.0]; 3].as_flattened() {
        bin.extend(weight.to_le_bytes());
    }
    bin.extend(bytes.0);
    let (times, values) = (96, 96 + 4 * keys);
    let needed = values + 4 * width * count;
    bin.resize(bin.len().max(needed), 0);
    let part = |offset: usize, length: usize| json!({"buffer": 0, "byteOffset": offset, "byteLength": length.max(1)});
    let floats = |view: usize, kind: &str, count: usize| json!({"bufferView": view, "componentType": 5126, "type": kind, "count": count});
    let file = json!({
        "asset": {"version": "2.0"},
        "buffers": [{"byteLength": bin.len()}],
        "bufferViews": [part(0, 36), part(36, 12), part(48, 48), part(times, 4 * keys), part(values, 4 * width * count)],
        "accessors": [
            floats(0, "VEC3", 3),
            {"bufferView": 1, "componentType": 5121, "type": "VEC4", "count": 3},
            floats(2, "VEC4", 3),
            floats(3, "SCALAR", keys),
            floats(4, kind, count),
        ],
        "meshes": [{
            "primitives": [{
                "attributes": {"POSITION": 0, "JOINTS_0": 1, "WEIGHTS_0": 2},
                "targets": [{"POSITION": 0}],
            }],
            "weights": [0.5],
        }],
        "skins": [{"joints": [1, 2]}],
        "nodes": [{"mesh": 0, "skin": 0}, {"children": [2]}, {"translation": [0.1, 0, 0]}],
        "scenes": [{"nodes": [0, 1]}],
        "animations": [{
            "samplers": [{"input": 3, "output": 4, "interpolation": way}],
            "channels": [{"sampler": 0, "target": {"node": node, "path": path}}],
        }],
    });
    draw(&glb(&file, &bin));
}

/// An image on a square.
pub fn image(data: &[u8]) {
    let mut bytes = Bytes(data);
    let mime = bytes.pick(&["image/png", "image/jpeg", "image/webp", "image/ktx2"]);
    let square = [[0.0f32, 0.0, -1.0], [1.0, 0.0, -1.0], [0.0, 1.0, -1.0]];
    let mut bin: Vec<u8> = square.as_flattened().iter().flat_map(|x| x.to_le_bytes()).collect();
    bin.extend(
        [[0.0f32, 0.0], [1.0, 0.0], [0.0, 1.0]].as_flattened().iter().flat_map(|x| x.to_le_bytes()),
    );
    bin.extend(bytes.0);
    let file = json!({
        "asset": {"version": "2.0"},
        "buffers": [{"byteLength": bin.len()}],
        "bufferViews": [
            {"buffer": 0, "byteLength": 36},
            {"buffer": 0, "byteOffset": 36, "byteLength": 24},
            {"buffer": 0, "byteOffset": 60, "byteLength": bin.len().saturating_sub(60).max(1)},
        ],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "type": "VEC3", "count": 3},
            {"bufferView": 1, "componentType": 5126, "type": "VEC2", "count": 3},
        ],
        "images": [{"bufferView": 2, "mimeType": mime}],
        "textures": [{"source": 0}],
        "materials": [{
            "pbrMetallicRoughness": {"baseColorTexture": {"index": 0}},
            "normalTexture": {"index": 0},
            "emissiveTexture": {"index": 0},
            "alphaMode": "MASK",
        }],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 1}, "material": 0}]}],
        "nodes": [{"mesh": 0}],
    });
    draw(&glb(&file, &bin));
}

/// The text of an experiment.
pub fn experiment(data: &[u8]) {
    if let Ok(text) = std::str::from_utf8(data) {
        // The folder in which files are looked for; there is none of this name.
        drop(Experiment::parse(text, Path::new("no such folder")));
    }
}

/// Numbers from the input; where it has ended, zeros.
struct Bytes<'a>(&'a [u8]);

impl Bytes<'_> {
    fn next(&mut self) -> u8 {
        let Some((&first, rest)) = self.0.split_first() else { return 0 };
        self.0 = rest;
        first
    }

    fn below(&mut self, end: usize) -> usize {
        usize::from(self.next()) % end
    }

    fn pick<T: Copy>(&mut self, among: &[T]) -> T {
        among[self.below(among.len())]
    }

    /// Mostly small, sometimes one that overflows something.
    fn number(&mut self) -> Value {
        const BAD: [f64; 8] =
            [-1.0, 0.5, 4294967295.0, 4294967296.0, 9007199254740992.0, 1e19, 1e308, -0.0];
        match self.next() {
            small @ 0..=199 => json!(small),
            200..=219 => json!(u32::from(self.next()) << 8 | u32::from(self.next())),
            _ => json!(self.pick(&BAD)),
        }
    }
}

fn view(bytes: &mut Bytes<'_>) -> Value {
    let mut view = json!({"buffer": 0, "byteOffset": bytes.number(), "byteLength": bytes.number()});
    if bytes.next() & 1 == 1 {
        view["byteStride"] = bytes.number();
    }
    view
}

fn accessor(bytes: &mut Bytes<'_>) -> Value {
    const COMPONENTS: [u32; 8] = [5126, 5120, 5121, 5122, 5123, 5125, 5124, 0];
    const KINDS: [&str; 8] = ["VEC3", "SCALAR", "VEC2", "VEC4", "MAT2", "MAT3", "MAT4", "VEC5"];
    let flags = bytes.next();
    let mut accessor = json!({
        "componentType": bytes.pick(&COMPONENTS),
        "type": bytes.pick(&KINDS),
        "count": bytes.number(),
        "normalized": flags & 1 == 1,
    });
    if flags & 2 == 0 {
        accessor["bufferView"] = bytes.number();
        accessor["byteOffset"] = bytes.number();
    }
    if flags & 4 == 4 {
        accessor["sparse"] = json!({
            "count": bytes.number(),
            "indices": {
                "bufferView": bytes.below(4),
                "byteOffset": bytes.number(),
                "componentType": bytes.pick(&COMPONENTS),
            },
            "values": {"bufferView": bytes.below(4), "byteOffset": bytes.number()},
        });
    }
    accessor
}

/// A binary file (glTF 2.0 §4.4) of a document and its only buffer.
fn glb(document: &Value, bin: &[u8]) -> Vec<u8> {
    let mut text = document.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    let mut bin = bin.to_vec();
    bin.resize(bin.len().next_multiple_of(4), 0);
    let length = (12 + 8 + text.len() + 8 + bin.len()) as u32;
    let mut file = Vec::new();
    file.extend(b"glTF");
    file.extend([2, length].map(u32::to_le_bytes).as_flattened());
    file.extend((text.len() as u32).to_le_bytes());
    file.extend(b"JSON");
    file.extend(text);
    file.extend((bin.len() as u32).to_le_bytes());
    file.extend(b"BIN\0");
    file.extend(bin);
    file
}

/// Small, so that no input takes long.
fn limits() -> Limits {
    Limits {
        file_bytes: 1 << 20,
        decoded_bytes: 32 << 20,
        triangles: 20_000,
        vertices: 20_000,
        image_pixels: 1 << 20,
        total_pixels: 1 << 21,
        nodes: 2_000,
        node_depth: 1_000,
        instances: 1_000,
        keyframes: 20_000,
        json_values: 20_000,
        ..Limits::default()
    }
}

/// Loads and draws it, by both integrators and at several times, unless it is refused.
fn draw(file: &[u8]) {
    let Ok(scene) = load_bytes("fuzzed", file, None, &limits()) else { return };
    scene.check().expect("what is loaded is consistent");
    let middle_secs = 0.4 * scene.animation.duration_secs;
    let world = World::new(Arc::new(scene));
    for (secs, integrator) in [
        (0.0, Integrator::Direct),
        (middle_secs, Integrator::Direct),
        (1e9, Integrator::Direct),
        (middle_secs, Integrator::Path),
    ] {
        let settings = Settings { integrator, max_depth: 3, ..Settings::default() };
        let size = Size::new(8, 6);
        let picture = render(&world, secs, &ViewSource::Camera(0), size, &settings, pool());
        let finite = picture.iter().flatten().all(|channel| channel.is_finite());
        assert!(finite, "{integrator:?} at {secs} s: {picture:?}");
    }
}

fn pool() -> &'static ThreadPool {
    static POOL: OnceLock<ThreadPool> = OnceLock::new();
    POOL.get_or_init(|| thread_pool(1))
}
