//! EXT_meshopt_compression, encoded by meshoptimizer itself.

use frameless_scene::{Limits, Problem, load_bytes};
use glam::Vec3;
use serde_json::{Value, json};

use super::maker::{F32, I8, Maker, SQUARE, U16, mesh};

const NAME: &str = "EXT_meshopt_compression";

/// A view of `count` elements of `stride` bytes, of which only the encoding is in the file.
fn compressed_view(
    maker: &mut Maker,
    bytes: &[u8],
    stride: usize,
    count: usize,
    mode: &str,
) -> usize {
    let encoded = maker.view(bytes);
    let offset = maker.json["bufferViews"][encoded]["byteOffset"].clone();
    let extension = json!({"buffer": 0, "byteOffset": offset, "byteLength": bytes.len(),
        "byteStride": stride, "count": count, "mode": mode});
    let view = json!({"buffer": 1, "byteLength": stride * count, "extensions": {NAME: extension}});
    maker.push("bufferViews", view)
}

fn accessor(maker: &mut Maker, view: usize, component: u32, kind: &str, count: usize) -> usize {
    let accessor =
        json!({"bufferView": view, "componentType": component, "type": kind, "count": count});
    maker.push("accessors", accessor)
}

/// The square with positions, normals and indices compressed, as one document without its fallback.
fn square() -> Maker {
    let positions: Vec<[f32; 3]> = SQUARE.as_chunks::<3>().0.to_vec();
    // Four corners whose normals are (0, 0, 1), in eight bits.
    let normals = meshopt::encode_filter_oct::<i8>(&[[0.0, 0.0, 1.0, 0.0]; 4], 8);
    Maker::with_primitive(|maker| {
        let encoded = meshopt::encode_vertex_buffer(&positions).unwrap();
        let view = compressed_view(maker, &encoded, 12, 4, "ATTRIBUTES");
        let position = accessor(maker, view, F32, "VEC3", 4);
        let encoded = meshopt::encode_vertex_buffer(&normals).unwrap();
        let view = compressed_view(maker, &encoded, 4, 4, "ATTRIBUTES");
        maker.json["bufferViews"][view]["extensions"][NAME]["filter"] = json!("OCTAHEDRAL");
        maker.json["bufferViews"][view]["byteStride"] = json!(4);
        let normal = accessor(maker, view, I8, "VEC3", 4);
        maker.json["accessors"][normal]["normalized"] = json!(true);
        let encoded = meshopt::encode_index_buffer(&[0, 1, 2, 0, 2, 3], 4).unwrap();
        let view = compressed_view(maker, &encoded, 2, 6, "TRIANGLES");
        let indices = accessor(maker, view, U16, "SCALAR", 6);
        json!({"attributes": {"POSITION": position, "NORMAL": normal}, "indices": indices})
    })
}

/// The GLB, with a second buffer that only readers without the extension would need.
fn bytes(maker: &Maker, edit: impl Fn(&mut Value)) -> Vec<u8> {
    let mut json = maker.finished_json(None);
    let fallback = json!({"byteLength": 1000, "extensions": {NAME: {"fallback": true}}});
    json["buffers"].as_array_mut().unwrap().push(fallback);
    json["extensionsRequired"] = json!([NAME]);
    edit(&mut json);
    let mut text = json.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    super::maker::glb(&[(b"JSON", &text), (b"BIN\0", &maker.bytes)])
}

fn load(bytes: &[u8]) -> Result<frameless_scene::Scene, frameless_scene::LoadError> {
    load_bytes("c.glb", bytes, None, &Limits::default())
}

#[test]
fn compressed_views_are_what_they_were() {
    let scene = load(&bytes(&square(), |_| ())).unwrap();
    scene.check().unwrap();
    let mesh = mesh(&scene, 0);
    assert_eq!(mesh.positions[2], Vec3::new(1.0, 1.0, 0.0));
    assert_eq!(mesh.normals, [Vec3::Z; 4]);
    let mut corners: Vec<u32> = mesh.triangles.as_flattened().to_vec();
    corners.sort_unstable();
    assert_eq!(corners, [0, 0, 1, 2, 2, 3]);
}

#[test]
fn exponents_and_quaternions_are_unfiltered() {
    let numbers: Vec<[f32; 3]> = vec![[0.5, -2.0, 1024.0], [0.0, 3.0, -0.25]];
    let encoded = meshopt::encode_filter_exp::<3>(&numbers, 15, meshopt::EncodeExpMode::Separate);
    let turns = [[0.0, 0.0, 0.0, 1.0], [0.0, 0.6, 0.0, 0.8]];
    let encoded_turns = meshopt::encode_filter_quat(&turns, 12);
    let mut maker = Maker::new();
    maker.push("nodes", json!({}));
    let times = maker.floats("SCALAR", &[0.0, 1.0]);
    let view = meshopt::encode_vertex_buffer(&encoded).unwrap();
    let view = compressed_view(&mut maker, &view, 12, 2, "ATTRIBUTES");
    maker.json["bufferViews"][view]["extensions"][NAME]["filter"] = json!("EXPONENTIAL");
    let places = accessor(&mut maker, view, F32, "VEC3", 2);
    let view = meshopt::encode_vertex_buffer(&encoded_turns).unwrap();
    let view = compressed_view(&mut maker, &view, 8, 2, "ATTRIBUTES");
    maker.json["bufferViews"][view]["extensions"][NAME]["filter"] = json!("QUATERNION");
    let turns = accessor(&mut maker, view, 5122, "VEC4", 2);
    maker.json["accessors"][turns]["normalized"] = json!(true);
    maker.push(
        "animations",
        json!({"channels": [{"sampler": 0, "target": {"node": 0, "path": "translation"}},
            {"sampler": 1, "target": {"node": 0, "path": "rotation"}}],
            "samplers": [{"input": times, "output": places}, {"input": times, "output": turns}]}),
    );
    let scene = load(&bytes(&maker, |_| ())).unwrap();
    let place = scene.state_at(0.999_999).parent_from_node[0];
    assert!(place.translation.abs_diff_eq(Vec3::new(0.0, 3.0, -0.25), 2e-3), "{place:?}");
    assert!(
        place.rotation.abs_diff_eq(glam::Quat::from_xyzw(0.0, 0.6, 0.0, 0.8), 2e-3),
        "{place:?}"
    );
}

#[test]
fn any_byte_cut_or_changed_does_no_harm() {
    let whole = square();
    for (view, offset) in [(1, 0), (3, 0), (5, 0)] {
        let extension = &whole.json["bufferViews"][view]["extensions"][NAME];
        let first = extension["byteOffset"].as_u64().unwrap() as usize + offset;
        let length = extension["byteLength"].as_u64().unwrap() as usize;
        for cut in 0..length {
            let cut = bytes(&whole, |json| {
                json["bufferViews"][view]["extensions"][NAME]["byteLength"] = json!(cut);
            });
            let error = load(&cut).expect_err("a cut view is refused").to_string();
            assert!(error.contains(&format!("/bufferViews/{view}/extensions/{NAME}")), "{error}");
        }
        for byte in first..first + length {
            for change in [0, 255, 0x80] {
                let mut changed = square();
                changed.bytes[byte] ^= change;
                if let Ok(scene) = load(&bytes(&changed, |_| ())) {
                    assert_eq!(scene.check(), Ok(()), "byte {byte}");
                }
            }
        }
    }
}

#[test]
fn numbers_that_the_decoder_could_not_bear_are_refused() {
    for (key, value) in [
        ("byteStride", json!(0)),
        ("byteStride", json!(13)),
        ("byteStride", json!(260)),
        ("byteStride", json!(1_u64 << 60)),
        ("count", json!(1_u64 << 53)),
        ("count", json!(5)),
        ("mode", json!("TRIANGLES")),
        ("mode", json!("POINTS")),
        ("filter", json!("OCTAHEDRAL")),
        ("filter", json!("GAUSS")),
        ("byteOffset", json!(u64::MAX)),
        ("buffer", json!(2)),
    ] {
        let wrong = bytes(&square(), |json| {
            json["bufferViews"][1]["extensions"][NAME][key] = value.clone();
        });
        assert!(load(&wrong).is_err(), "{key}: {value}");
    }
    let endless = bytes(&square(), |json| {
        json["bufferViews"][1]["extensions"][NAME]["count"] = json!(1_u64 << 40);
    });
    let error = load(&endless).unwrap_err();
    assert!(matches!(error.problem, Problem::Limit { .. }), "{error}");
    let triangles = bytes(&square(), |json| {
        json["bufferViews"][5]["extensions"][NAME]["count"] = json!(4);
    });
    assert!(load(&triangles).unwrap_err().to_string().contains("three indices per triangle"));
    let unmarked = bytes(&square(), |json| {
        json["buffers"][1].as_object_mut().unwrap().remove("extensions");
    });
    assert!(load(&unmarked).unwrap_err().to_string().contains("/buffers/1: wanted a uri"));
}
