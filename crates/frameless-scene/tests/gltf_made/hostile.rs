//! Files that lie, climb and recurse are refused in bounded time and memory, with the place of the lie.

use std::fs;
use std::path::PathBuf;

use frameless_scene::{Limits, Place, Problem, load, load_bytes};
use serde_json::{Value, json};

use super::maker::{F32, Maker, SQUARE, U16, glb, rich};

#[test]
fn a_glb_cut_at_any_byte_is_refused() {
    let whole = rich().glb();
    assert!(load_bytes("whole.glb", &whole, None, &Limits::default()).is_ok());
    for length in 0..whole.len() {
        let cut = load_bytes("cut.glb", &whole[..length], None, &Limits::default());
        let error = cut.expect_err("a cut file is refused");
        assert!(matches!(error.place, Place::Byte(_)), "{length}: {error}");
    }
}

/// A cut that the header does not betray reaches chunks, JSON and buffers.
#[test]
fn a_glb_cut_at_any_byte_with_an_honest_length_is_refused() {
    let whole = rich().glb();
    for length in 0..whole.len() {
        let mut cut = whole[..length].to_vec();
        if length >= 12 {
            cut[8..12].copy_from_slice(&(length as u32).to_le_bytes());
        }
        assert!(load_bytes("cut.glb", &cut, None, &Limits::default()).is_err(), "{length}");
    }
}

#[test]
fn chunk_lengths_that_lie_are_refused() {
    let whole = rich().glb();
    let json_length = u32::from_le_bytes(whole[12..16].try_into().unwrap());
    let bin = 20 + json_length as usize;
    for (offset, length) in [(12, u32::MAX), (12, json_length + 1), (12, 0), (12, json_length - 1)]
        .into_iter()
        .chain([(bin, u32::MAX), (bin, 1 << 31), (8, u32::MAX), (8, 0), (8, 19)])
    {
        let mut lying = whole.clone();
        lying[offset..offset + 4].copy_from_slice(&length.to_le_bytes());
        let result = load_bytes("lying.glb", &lying, None, &Limits::default());
        assert!(result.is_err(), "length {length} at byte {offset}");
    }
}

#[test]
fn unknown_chunks_are_skipped_aloud() {
    let json = br#"{"asset":{"version":"2.0"}}  "#;
    let bytes = glb(&[(b"JSON", json), (b"XTRA", b"1234")]);
    let scene = load_bytes("extra.glb", &bytes, None, &Limits::default()).unwrap();
    assert!(scene.warnings.iter().any(|warning| warning.contains("XTRA")), "{:?}", scene.warnings);
}

#[test]
fn a_second_binary_chunk_is_refused_where_it_stands() {
    let json = br#"{"asset":{"version":"2.0"}}  "#;
    let bytes = glb(&[(b"JSON", json), (b"BIN\0", b"1234"), (b"BIN\0", b"5678")]);
    let error = load_bytes("two.glb", &bytes, None, &Limits::default()).unwrap_err();
    assert_eq!(error.place, Place::Byte(12 + 8 + json.len() as u64 + 8 + 4), "{error}");
}

/// RFC 2397 knows data that is not base64.
#[test]
fn percent_encoded_data_is_read() {
    let maker = Maker::with_primitive(
        |maker| json!({"attributes": {"POSITION": maker.floats("VEC3", &SQUARE)}}),
    );
    let text: String = maker.bytes.iter().map(|byte| format!("%{byte:02X}")).collect();
    let json = maker.finished_json(Some(format!("data:application/octet-stream,{text}")));
    let scene = load_bytes("a.gltf", json.to_string().as_bytes(), None, &Limits::default());
    assert_eq!(scene.unwrap().geometries.len(), 1);
}

/// Whatever single byte is wrong, the scene keeps its promises or is refused.
#[test]
fn any_byte_changed_does_no_harm() {
    let whole = rich().glb();
    for offset in 0..whole.len() {
        for change in [|_| 0, |_| 255, |byte: u8| byte ^ 0x80, |byte: u8| byte.wrapping_add(1)] {
            let mut changed = whole.clone();
            changed[offset] = change(changed[offset]);
            if let Ok(scene) = load_bytes("changed.glb", &changed, None, &Limits::default()) {
                assert_eq!(scene.check(), Ok(()), "byte {offset} is {}", changed[offset]);
            }
        }
    }
}

/// Whatever single value of the document is nonsense, the scene keeps its promises or is refused.
#[test]
fn any_value_replaced_by_nonsense_does_no_harm() {
    let whole: Value = serde_json::from_slice(&rich().gltf()).unwrap();
    let nonsense = [
        json!(null),
        json!(-1),
        json!(0),
        json!(1),
        json!(0.5),
        json!(1e300),
        json!(1e38),
        json!(2_147_483_648_u32),
        json!(u64::MAX),
        json!(9_007_199_254_740_992_u64),
        json!("nonsense"),
        json!([]),
        json!({}),
        json!([[[]]]),
    ];
    let mut pointers = Vec::new();
    collect_pointers(&whole, String::new(), &mut pointers);
    assert!(pointers.len() > 200);
    for pointer in pointers {
        for value in &nonsense {
            let mut changed = whole.clone();
            *changed.pointer_mut(&pointer).unwrap() = value.clone();
            let text = changed.to_string();
            if let Ok(scene) = load_bytes("n.gltf", text.as_bytes(), None, &Limits::default()) {
                assert_eq!(scene.check(), Ok(()), "{pointer} is {value}");
            }
        }
    }
}

fn collect_pointers(value: &Value, pointer: String, pointers: &mut Vec<String>) {
    match value {
        Value::Array(elements) => {
            for (i, element) in elements.iter().enumerate() {
                collect_pointers(element, format!("{pointer}/{i}"), pointers);
            }
        }
        Value::Object(members) => {
            for (key, member) in members {
                collect_pointers(member, format!("{pointer}/{key}"), pointers);
            }
        }
        _ => {}
    }
    pointers.push(pointer);
}

#[test]
fn counts_beyond_the_data_are_refused_where_they_stand() {
    for count in [5_u64, 1 << 31, u64::from(u32::MAX), u64::MAX / 12, u64::MAX] {
        let mut maker = Maker::new();
        maker.floats("VEC3", &SQUARE);
        maker.json["accessors"][0]["count"] = json!(count);
        let refusal = maker.refusal();
        assert!(refusal.starts_with("made.glb: /accessors/0/count: wanted"), "{refusal}");
    }
}

/// Without a buffer view, elements are zeros and cost the file nothing: only the limits bound them.
#[test]
fn counts_without_data_are_held_against_the_limits() {
    let maker = Maker::with_primitive(|maker| {
        let accessor = json!({"componentType": F32, "type": "VEC3", "count": 1_u64 << 31});
        json!({"attributes": {"POSITION": maker.push("accessors", accessor)}})
    });
    let error = maker.try_load().unwrap_err();
    assert!(matches!(error.problem, Problem::Limit { .. }), "{error}");
}

/// They are decoded, built into trees and drawn like any others, so that together they may be fewer than what the file has bytes for.
#[test]
fn zeros_without_data_are_limited_together() {
    let load = |count: u64, targets: usize| {
        let maker = Maker::with_primitive(|maker| {
            let accessor = json!({"componentType": F32, "type": "VEC3", "count": count});
            let position = maker.push("accessors", accessor);
            json!({"attributes": {"POSITION": position}, "targets": vec![json!({"POSITION": position}); targets]})
        });
        maker.try_load().map_err(|error| error.to_string())
    };
    let refused =
        "bytes of zeros without data, more than the limit of 33554432; --max-memory raises it";
    assert!(load(3_000_000, 0).unwrap_err().contains(refused));
    assert!(load(30_000, 200).unwrap_err().contains(refused));
    assert!(load(30_000, 80).is_ok());
}

#[test]
fn offsets_that_wrap_around_are_refused() {
    for (list, key) in [("accessors", "byteOffset"), ("bufferViews", "byteOffset")] {
        for offset in [1_u64, 1 << 32, u64::MAX - 3, u64::MAX] {
            let mut maker = Maker::new();
            maker.floats("VEC3", &SQUARE);
            maker.json[list][0][key] = json!(offset);
            assert!(maker.refusal().contains(&format!("/{list}/0")), "{list} at {offset}");
        }
    }
}

#[test]
fn overlapping_strides_are_refused() {
    let mut maker = Maker::new();
    maker.floats("VEC3", &SQUARE);
    maker.json["bufferViews"][0]["byteStride"] = json!(4);
    maker.json["accessors"][0]["count"] = json!(10);
    assert!(maker.refusal().contains("stride of 4"), "{}", maker.refusal());
}

#[test]
fn sparse_indices_beyond_the_array_are_refused() {
    let maker = Maker::with_primitive(|maker| {
        let position = maker.floats("VEC3", &SQUARE);
        let indices = maker.view(&[4, 0]);
        let values = maker.view(&[0; 12]);
        maker.json["accessors"][position]["sparse"] = json!({"count": 1,
            "indices": {"bufferView": indices, "componentType": U16},
            "values": {"bufferView": values}});
        json!({"attributes": {"POSITION": position}})
    });
    assert!(maker.refusal().contains("/accessors/0/sparse/indices: wanted indices below 4, got 4"));
}

/// glTF 2.0 §3.6.2.3 wants them so, and which of two values counted would be chance.
#[test]
fn sparse_indices_that_do_not_rise_are_refused() {
    for (indices, is_fine) in [([0, 2], true), ([2, 2], false), ([2, 1], false)] {
        let maker = Maker::with_primitive(|maker| {
            let position = maker.floats("VEC3", &SQUARE);
            let indices = maker.view(&[indices[0], 0, indices[1], 0]);
            let values = maker.view(&[0; 24]);
            maker.json["accessors"][position]["sparse"] = json!({"count": 2,
                "indices": {"bufferView": indices, "componentType": U16},
                "values": {"bufferView": values}});
            json!({"attributes": {"POSITION": position}})
        });
        match is_fine {
            true => drop(maker.load()),
            false => {
                let refusal = maker.refusal();
                let expected = "/accessors/0/sparse/indices: wanted indices each higher";
                assert!(refusal.contains(expected), "{refusal}");
            }
        }
    }
}

#[test]
fn elements_of_another_kind_are_refused_where_they_are_used() {
    let mut maker = Maker::with_primitive(|maker| {
        let position = maker.floats("VEC3", &SQUARE);
        let normal = maker.floats("VEC2", &[0.0; 8]);
        json!({"attributes": {"POSITION": position, "NORMAL": normal}})
    });
    assert_eq!(
        maker.refusal(),
        "made.glb: /meshes/0/primitives/0/attributes/NORMAL: wanted 3 components per element (VEC3), got VEC2 of /accessors/1"
    );
    let primitive = &mut maker.json["meshes"][0]["primitives"][0];
    *primitive = json!({"attributes": {"POSITION": 0}, "indices": 1});
    let refusal = maker.refusal();
    let expected = "/meshes/0/primitives/0/indices: wanted unsigned scalars (5121, 5123 or 5125) as indices, \
        got VEC2 of 5126 in /accessors/1";
    assert!(refusal.contains(expected), "{refusal}");
}

#[test]
fn how_many_bytes_an_accessor_needs_is_told() {
    let mut maker = Maker::new();
    maker.floats("VEC3", &SQUARE);
    maker.json["accessors"][0]["count"] = json!(5);
    let expected = "within the view of 48 bytes, from byte 0 (so many need 60 bytes), got 5";
    assert!(maker.refusal().contains(expected), "{}", maker.refusal());
}

#[test]
fn keys_that_come_twice_are_told() {
    let text = br#"{"asset": {"version": "2.0"}, "extras": {"twice": 1, "twice": 2}}"#;
    let scene = load_bytes("twice.gltf", text, None, &Limits::default()).unwrap();
    let told =
        |warning: &String| warning.contains("several times") && warning.contains("\"twice\"");
    assert!(scene.warnings.iter().any(told), "{:?}", scene.warnings);
}

#[test]
fn text_in_other_encodings_is_called_by_its_name() {
    let words: Vec<u16> = r#"{"asset": {"version": "2.0"}}"#.encode_utf16().collect();
    let [little, big] = [u16::to_le_bytes, u16::to_be_bytes]
        .map(|bytes| words.iter().flat_map(|word| bytes(*word)).collect::<Vec<u8>>());
    let marked = [&[0xff, 0xfe], &little[..]].concat();
    for text in [little, big, marked] {
        let error = load_bytes("wide.gltf", &text, None, &Limits::default()).unwrap_err();
        assert!(error.to_string().contains("got text in UTF-16"), "{error}");
    }
}

#[test]
fn schemes_may_be_written_in_capitals() {
    let text = String::from_utf8(rich().gltf()).unwrap().replace("data:app", "DATA:app");
    assert!(text.contains("DATA:app"));
    assert!(load_bytes("rich.gltf", text.as_bytes(), None, &Limits::default()).is_ok());
}

/// Its rays would not be numbers.
#[test]
fn pictures_higher_than_the_world_are_refused() {
    let mut maker = Maker::new();
    for (ymag, is_fine) in [(3.4e38, false), (1e16, false), (1e-45, true), (2.0, true)] {
        maker.json["cameras"] = json!([{"type": "orthographic", "orthographic": {"ymag": ymag}}]);
        match is_fine {
            true => drop(maker.load()),
            false => {
                let refusal = maker.refusal();
                assert!(refusal.contains("/cameras/0/orthographic/ymag: wanted"), "{refusal}");
            }
        }
    }
}

/// A file with `count` nodes, each the child of the one before.
fn chain(count: usize) -> Maker {
    let mut maker = Maker::new();
    let nodes =
        (0..count).map(|i| if i + 1 < count { json!({"children": [i + 1]}) } else { json!({}) });
    maker.json["nodes"] = Value::Array(nodes.collect());
    maker
}

#[test]
fn a_chain_of_100_000_nodes_costs_no_stack() {
    let scene = chain(100_000).load();
    assert_eq!(scene.nodes[99_999].parent, Some(99_998));
    let mut ring = chain(100_000);
    ring.json["nodes"][99_999] = json!({"children": [0]});
    assert!(ring.refusal().contains("its own descendant"), "{}", ring.refusal());
    let limits = Limits { node_depth: 1000, ..Limits::default() };
    let error = load_bytes("deep.glb", &chain(1001).glb(), None, &limits).unwrap_err();
    assert_eq!(
        error.to_string(),
        "deep.glb: /nodes: 1001 levels of nodes, more than the limit of 1000; --max-nesting raises it"
    );
}

#[test]
fn a_chain_of_huge_scales_has_no_place_in_the_world() {
    let mut maker = chain(3);
    for node in 0..3 {
        maker.json["nodes"][node]["scale"] = json!([1e30, 1e30, 1e30]);
    }
    assert!(maker.refusal().contains("/nodes/1"), "{}", maker.refusal());
}

#[test]
fn what_is_no_gltf_is_told_by_its_first_byte() {
    let refusal = |bytes: &[u8]| {
        load_bytes("sky.hdr", bytes, None, &Limits::default()).unwrap_err().to_string()
    };
    let no_gltf = refusal(&[b"#?RADIANCE\n".as_slice(), &[b'['; 200]].concat());
    assert!(no_gltf.contains("sky.hdr: byte 0: wanted glTF"), "{no_gltf}");
    assert!(no_gltf.contains("other bytes"), "{no_gltf}");
    let json = refusal(b" \n{\"asset\": 3}");
    assert!(!json.contains("other bytes"), "{json}");
}

#[test]
fn every_limit_is_held() {
    type Lower = fn(&mut Limits);
    let lower: [(&str, &str, Lower); 13] = [
        ("bytes of file", "--max-memory", |limits| limits.file_bytes = 100),
        ("decoded bytes", "--max-memory", |limits| limits.decoded_bytes = 100),
        ("triangles", "--max-triangles", |limits| limits.triangles = 1),
        ("vertices", "--max-triangles", |limits| limits.vertices = 3),
        ("nodes", "--max-nodes", |limits| limits.nodes = 2),
        ("levels of nodes", "--max-nesting", |limits| limits.node_depth = 1),
        ("instances", "--max-instances", |limits| limits.instances = 0),
        ("lights", "--max-lights", |limits| limits.lights = 0),
        ("keyframes", "--max-memory", |limits| limits.keyframes = 3),
        ("levels of JSON nesting", "", |limits| limits.json_depth = 4),
        ("JSON values", "--max-memory", |limits| limits.json_values = 100),
        ("pixels in one image", "--max-texture-pixels", |limits| limits.image_pixels = 3),
        ("pixels in all images", "--max-texture-pixels", |limits| limits.total_pixels = 3),
    ];
    for (what, flag, lower) in lower {
        let mut limits = Limits::default();
        lower(&mut limits);
        let text = match load_bytes("rich.glb", &rich().glb(), None, &limits) {
            Err(error) => error.to_string(),
            // Images too large do not stop the scene.
            Ok(scene) => scene.warnings.join("\n"),
        };
        assert!(text.contains(what) && text.contains("more than the limit"), "{what}: {text}");
        assert!(text.contains(flag), "{what} is raised by {flag}: {text}");
    }
}

/// A folder of its own for a test, inside the build's.
fn folder(name: &str) -> PathBuf {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("gltf_hostile").join(name);
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(folder.join("scene")).unwrap();
    folder
}

#[test]
fn nothing_outside_the_folder_is_read() {
    let folder = folder("climbing");
    let maker = Maker::with_primitive(
        |maker| json!({"attributes": {"POSITION": maker.floats("VEC3", &SQUARE)}}),
    );
    fs::write(folder.join("secret.bin"), &maker.bytes).unwrap();
    fs::write(folder.join("scene/inside it.bin"), &maker.bytes).unwrap();
    let path = folder.join("scene/scene.gltf");
    let load_with = |uri: &str| {
        fs::write(&path, maker.finished_json(Some(uri.to_owned())).to_string()).unwrap();
        load(&path, &Limits::default())
    };
    assert!(load_with("inside%20it.bin").is_ok());
    let absolute = folder.join("secret.bin").display().to_string();
    for uri in
        ["../secret.bin", "%2e%2e/secret.bin", "./../secret.bin", &absolute, "file:secret.bin"]
    {
        let error = load_with(uri).expect_err(uri).to_string();
        assert!(error.contains("scene.gltf: /buffers/0/uri: wanted a relative path"), "{error}");
    }
    assert!(load_with("missing.bin").unwrap_err().to_string().contains("\"missing.bin\""));
    assert!(load_with(".").is_err());
}

#[cfg(unix)]
#[test]
fn links_that_lead_out_of_the_folder_are_not_followed() {
    let folder = folder("links");
    let maker = Maker::with_primitive(
        |maker| json!({"attributes": {"POSITION": maker.floats("VEC3", &SQUARE)}}),
    );
    fs::write(folder.join("secret.bin"), &maker.bytes).unwrap();
    std::os::unix::fs::symlink("../secret.bin", folder.join("scene/link.bin")).unwrap();
    let path = folder.join("scene/scene.gltf");
    fs::write(&path, maker.finished_json(Some("link.bin".to_owned())).to_string()).unwrap();
    let error = load(&path, &Limits::default()).unwrap_err().to_string();
    assert!(error.contains("wanted a plain file in the file's folder"), "{error}");
}

#[test]
fn bytes_without_a_folder_name_no_files() {
    let maker = Maker::with_primitive(
        |maker| json!({"attributes": {"POSITION": maker.floats("VEC3", &SQUARE)}}),
    );
    let json = maker.finished_json(Some("a.bin".to_owned())).to_string();
    let error = load_bytes("dropped.gltf", json.as_bytes(), None, &Limits::default()).unwrap_err();
    assert!(error.to_string().contains("there is no folder"), "{error}");
}
