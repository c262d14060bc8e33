//! Small glTF documents put together by hand, so that tests know every byte of them.

use base64::Engine;
use frameless_scene::{Geometry, Limits, LoadError, Mesh, Scene, load_bytes};
use serde_json::{Value, json};

pub(crate) const U8: u32 = 5121;
pub(crate) const I8: u32 = 5120;
pub(crate) const U16: u32 = 5123;
pub(crate) const U32: u32 = 5125;
pub(crate) const F32: u32 = 5126;

/// The corners of a square in the plane z = 0.
pub(crate) const SQUARE: [f32; 12] = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0, 0.0];

/// A document and the bytes of its only buffer.
pub(crate) struct Maker {
    pub(crate) json: Value,
    pub(crate) bytes: Vec<u8>,
}

impl Maker {
    /// Nothing but the version.
    pub(crate) fn new() -> Maker {
        Maker { json: json!({"asset": {"version": "2.0"}}), bytes: Vec::new() }
    }

    /// One node with one mesh of one primitive; returns the maker for more.
    pub(crate) fn with_primitive(primitive: impl FnOnce(&mut Maker) -> Value) -> Maker {
        let mut maker = Maker::new();
        let primitive = primitive(&mut maker);
        maker.json["meshes"] = json!([{"primitives": [primitive]}]);
        maker.json["nodes"] = json!([{"mesh": 0}]);
        maker
    }

    /// Appends to a list of the document; returns the element's index.
    pub(crate) fn push(&mut self, list: &str, element: Value) -> usize {
        if self.json[list].is_null() {
            self.json[list] = json!([]);
        }
        let list = self.json[list].as_array_mut().unwrap();
        list.push(element);
        list.len() - 1
    }

    /// A buffer view of its own for `bytes`.
    pub(crate) fn view(&mut self, bytes: &[u8]) -> usize {
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        let offset = self.bytes.len();
        self.bytes.extend(bytes);
        let view = json!({"buffer": 0, "byteOffset": offset, "byteLength": bytes.len()});
        self.push("bufferViews", view)
    }

    pub(crate) fn accessor(
        &mut self,
        component: u32,
        kind: &str,
        count: usize,
        bytes: &[u8],
    ) -> usize {
        let view = self.view(bytes);
        let accessor =
            json!({"bufferView": view, "componentType": component, "type": kind, "count": count});
        self.push("accessors", accessor)
    }

    pub(crate) fn floats(&mut self, kind: &str, values: &[f32]) -> usize {
        let width = match kind {
            "SCALAR" => 1,
            "VEC2" => 2,
            "VEC3" => 3,
            "MAT4" => 16,
            _ => 4,
        };
        let bytes: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
        self.accessor(F32, kind, values.len() / width, &bytes)
    }

    /// The document with its buffer, if it has one.
    pub(crate) fn finished_json(&self, uri: Option<String>) -> Value {
        let mut json = self.json.clone();
        if !self.bytes.is_empty() {
            json["buffers"] = json!([{"byteLength": self.bytes.len()}]);
            if let Some(uri) = uri {
                json["buffers"][0]["uri"] = json!(uri);
            }
        }
        json
    }

    pub(crate) fn glb(&self) -> Vec<u8> {
        let mut json = self.finished_json(None).to_string().into_bytes();
        json.resize(json.len().next_multiple_of(4), b' ');
        match self.bytes.as_slice() {
            [] => glb(&[(b"JSON", &json)]),
            bytes => glb(&[(b"JSON", &json), (b"BIN\0", bytes)]),
        }
    }

    pub(crate) fn gltf(&self) -> Vec<u8> {
        let text = base64::engine::general_purpose::STANDARD.encode(&self.bytes);
        let uri = format!("data:application/octet-stream;base64,{text}");
        self.finished_json(Some(uri)).to_string().into_bytes()
    }

    pub(crate) fn load(&self) -> Scene {
        let scene = self.try_load().unwrap_or_else(|error| panic!("{error}"));
        scene.check().unwrap();
        scene
    }

    pub(crate) fn try_load(&self) -> Result<Scene, LoadError> {
        load_bytes("made.glb", &self.glb(), None, &Limits::default())
    }

    /// The message with which the document is refused.
    pub(crate) fn refusal(&self) -> String {
        self.try_load().expect_err("the document is refused").to_string()
    }
}

/// A GLB of the given chunks, padding left to the caller.
pub(crate) fn glb(chunks: &[(&[u8; 4], &[u8])]) -> Vec<u8> {
    let body: Vec<u8> = chunks
        .iter()
        .flat_map(|(kind, data)| [&(data.len() as u32).to_le_bytes()[..], &kind[..], data].concat())
        .collect();
    let length = (12 + body.len() as u32).to_le_bytes();
    [b"glTF".as_slice(), &2_u32.to_le_bytes(), &length, &body].concat()
}

/// The scene's mesh number `index`.
pub(crate) fn mesh(scene: &Scene, index: usize) -> &Mesh {
    match &scene.geometries[index] {
        Geometry::Mesh(mesh) => mesh,
        Geometry::Sphere { .. } => panic!("glTF has no spheres"),
    }
}

/// A document that uses everything which is read: a textured, coloured, animated mesh, cameras, lights, a skin.
pub(crate) fn rich() -> Maker {
    let mut maker = Maker::new();
    let position = maker.floats("VEC3", &SQUARE);
    let normal = maker.floats("VEC3", &[0.0, 0.0, 1.0].repeat(4));
    let uv = maker.floats("VEC2", &[0.0, 0.0, 1.0, 0.0, 1.0, 1.0, 0.0, 1.0]);
    let color = maker.accessor(U8, "VEC4", 4, &[0, 128, 255, 255].repeat(4));
    maker.json["accessors"][color]["normalized"] = json!(true);
    let indices = maker.accessor(U16, "SCALAR", 6, &[0, 0, 1, 0, 2, 0, 0, 0, 2, 0, 3, 0]);
    let sparse_indices = maker.view(&[1, 0, 3, 0]);
    let sparse_values = maker.view(&[0; 24]);
    maker.json["accessors"][position]["sparse"] = json!({"count": 2,
        "indices": {"bufferView": sparse_indices, "componentType": U16},
        "values": {"bufferView": sparse_values, "byteOffset": 0}});
    let bulge = maker.floats("VEC3", &SQUARE);
    let joints = maker.accessor(U8, "VEC4", 4, &[0, 1, 0, 0].repeat(4));
    let weights = maker.accessor(U16, "VEC4", 4, &[0, 128, 255, 127, 0, 0, 0, 0].repeat(4));
    maker.json["accessors"][weights]["normalized"] = json!(true);
    let turned = [0.0, 1.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 0.0, 0.0, 1.0];
    let bind = maker.floats("MAT4", &turned.repeat(2));
    let swells = maker.floats("SCALAR", &[0.0, 1.0]);
    let times = maker.floats("SCALAR", &[0.0, 1.0]);
    let moves = maker.floats("VEC3", &[0.0, 0.0, 0.0, 1.0, 2.0, 3.0]);
    let turns = maker.floats("VEC4", &[0.0, 0.0, 0.0, 1.0].repeat(6));
    let png = maker.view(&png(2, 2));
    maker.push("images", json!({"bufferView": png, "mimeType": "image/png", "name": "paint"}));
    maker.push("samplers", json!({"magFilter": 9728, "wrapS": 33071, "wrapT": 33648}));
    maker.push("textures", json!({"source": 0, "sampler": 0}));
    maker.push("textures", json!({"extensions": {"EXT_texture_webp": {"source": 0}}}));
    let glow = json!({"KHR_materials_emissive_strength": {"emissiveStrength": 2.0}});
    maker.push(
        "materials",
        json!({"name": "paint", "doubleSided": true, "alphaMode": "MASK",
        "pbrMetallicRoughness": {"baseColorFactor": [1.0, 0.5, 0.25, 1.0], "metallicFactor": 0.5,
            "roughnessFactor": 0.25, "baseColorTexture": {"index": 0, "texCoord": 0},
            "metallicRoughnessTexture": {"index": 1}},
        "emissiveFactor": [0.5, 0.0, 0.0], "emissiveTexture": {"index": 0},
        "normalTexture": {"index": 1}, "extensions": glow}),
    );
    maker.push(
        "meshes",
        json!({"name": "square", "primitives": [{"mode": 4, "material": 0,
        "attributes": {"POSITION": position, "NORMAL": normal, "TEXCOORD_0": uv, "COLOR_0": color,
            "JOINTS_0": joints, "WEIGHTS_0": weights},
        "indices": indices, "targets": [{"POSITION": bulge, "NORMAL": normal, "COLOR_0": color}]}],
        "weights": [0.25]}),
    );
    maker.push(
        "cameras",
        json!({"type": "perspective", "perspective": {"yfov": 1.0, "znear": 0.1}}),
    );
    maker.push(
        "cameras",
        json!({"type": "orthographic",
        "orthographic": {"xmag": 1.0, "ymag": 2.0, "znear": 0.0, "zfar": 1.0}}),
    );
    maker.push("skins", json!({"joints": [2, 0], "skeleton": 2, "inverseBindMatrices": bind}));
    maker.push(
        "nodes",
        json!({"children": [1, 2], "translation": [1.0, 2.0, 3.0],
        "rotation": [0.0, 1.0, 0.0, 0.0], "scale": [1.0, -1.0, 1.0], "camera": 0}),
    );
    let light = json!({"KHR_lights_punctual": {"light": 0}});
    maker.push("nodes", json!({"mesh": 0, "skin": 0, "weights": [0.5], "extensions": light}));
    maker.push("nodes", json!({"camera": 1,
        "matrix": [1.0, 0.0, 0.0, 0.0, 0.0, 2.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 5.0, 6.0, 7.0, 1.0]}));
    maker.push("scenes", json!({"nodes": [0]}));
    maker.json["scene"] = json!(0);
    maker.json["extensions"] = json!({"KHR_lights_punctual": {"lights": [{"type": "spot",
        "color": [1.0, 0.5, 0.0], "intensity": 10.0, "range": 20.0,
        "spot": {"innerConeAngle": 0.1, "outerConeAngle": 0.5}}]}});
    maker.json["extensionsUsed"] = json!(["KHR_lights_punctual"]);
    maker.json["extensionsRequired"] = json!(["KHR_lights_punctual"]);
    maker.push(
        "animations",
        json!({"channels": [
            {"sampler": 0, "target": {"node": 0, "path": "translation"}},
            {"sampler": 1, "target": {"node": 1, "path": "rotation"}},
            {"sampler": 2, "target": {"node": 1, "path": "weights"}}],
        "samplers": [{"input": times, "output": moves, "interpolation": "LINEAR"},
            {"input": times, "output": turns, "interpolation": "CUBICSPLINE"},
            {"input": times, "output": swells}]}),
    );
    maker
}

/// A PNG whose texels are all (255, 128, 0).
pub(crate) fn png(width: u32, height: u32) -> Vec<u8> {
    let picture = image::RgbImage::from_pixel(width, height, image::Rgb([255, 128, 0]));
    let mut bytes = std::io::Cursor::new(Vec::new());
    picture.write_to(&mut bytes, image::ImageFormat::Png).unwrap();
    bytes.into_inner()
}
