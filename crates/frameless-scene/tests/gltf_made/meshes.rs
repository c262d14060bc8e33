//! Vertices and triangles.

use glam::{Vec2, Vec3, Vec4};
use serde_json::{Value, json};

use super::maker::{I8, Maker, SQUARE, U8, U16, U32, mesh};

/// The mesh of a document with one primitive.
fn load_one(primitive: impl FnOnce(&mut Maker) -> Value) -> frameless_scene::Mesh {
    let scene = Maker::with_primitive(primitive).load();
    assert_eq!(scene.instances.len(), 1);
    mesh(&scene, 0).clone()
}

fn corners() -> [Vec3; 4] {
    [Vec3::ZERO, Vec3::X, Vec3::new(1.0, 1.0, 0.0), Vec3::Y]
}

#[test]
fn a_square_in_a_glb_and_in_a_gltf_is_the_same() {
    let maker = Maker::with_primitive(|maker| {
        json!({"attributes": {"POSITION": maker.floats("VEC3", &SQUARE)},
            "indices": maker.accessor(U8, "SCALAR", 6, &[0, 1, 2, 0, 2, 3])})
    });
    let limits = frameless_scene::Limits::default();
    for bytes in [maker.glb(), maker.gltf()] {
        let scene = frameless_scene::load_bytes("square", &bytes, None, &limits).unwrap();
        let square = mesh(&scene, 0);
        assert_eq!(square.positions, corners());
        assert_eq!(square.triangles, [[0, 1, 2], [0, 2, 3]]);
        assert!(square.triangle_materials.iter().eq([0, 0]));
        assert!(square.normals.is_empty(), "no normals: flat shading");
        assert_eq!(scene.warnings, [""; 0]);
        assert_eq!(scene.name, "square");
    }
}

#[test]
fn all_index_types_and_none() {
    let expected = [[1, 2, 3]];
    let with = |component: u32, bytes: &[u8]| {
        load_one(|maker| {
            json!({"attributes": {"POSITION": maker.floats("VEC3", &SQUARE)},
                "indices": maker.accessor(component, "SCALAR", 3, bytes)})
        })
    };
    assert_eq!(with(U8, &[1, 2, 3]).triangles, expected);
    assert_eq!(with(U16, &[1, 0, 2, 0, 3, 0]).triangles, expected);
    assert_eq!(with(U32, &[1, 0, 0, 0, 2, 0, 0, 0, 3, 0, 0, 0]).triangles, expected);
    let none = load_one(|maker| json!({"attributes": {"POSITION": maker.floats("VEC3", &SQUARE)}}));
    assert_eq!(none.triangles, [[0, 1, 2]]);
}

#[test]
fn strips_and_fans_face_the_same_way() {
    for (mode, order, expected) in
        [(5, [0, 1, 3, 2], [[0, 1, 3], [1, 2, 3]]), (6, [0, 1, 2, 3], [[1, 2, 0], [2, 3, 0]])]
    {
        let square = load_one(|maker| {
            json!({"attributes": {"POSITION": maker.floats("VEC3", &SQUARE)}, "mode": mode,
                "indices": maker.accessor(U8, "SCALAR", 4, &order)})
        });
        assert_eq!(square.triangles, expected);
        for triangle in square.triangles {
            let [a, b, c] = triangle.map(|corner| square.positions[corner as usize]);
            assert_eq!((b - a).cross(c - a), Vec3::Z, "mode {mode}");
        }
    }
}

#[test]
fn points_and_lines_are_left_out_aloud() {
    for mode in 0..4 {
        let scene = Maker::with_primitive(|maker| {
            json!({"attributes": {"POSITION": maker.floats("VEC3", &SQUARE)}, "mode": mode})
        })
        .load();
        assert!(scene.instances.is_empty());
        assert!(scene.warnings[0].contains("points and lines"), "{:?}", scene.warnings);
    }
}

#[test]
fn indices_out_of_range_are_refused() {
    let maker = Maker::with_primitive(|maker| {
        json!({"attributes": {"POSITION": maker.floats("VEC3", &SQUARE)},
            "indices": maker.accessor(U8, "SCALAR", 3, &[0, 1, 4])})
    });
    let expected = "made.glb: /meshes/0/primitives/0/indices: \
        wanted indices below the number of vertices, 4, got 4";
    assert_eq!(maker.refusal(), expected);
}

#[test]
fn sparse_values_replace_dense_ones_or_zeros() {
    let moved = [7.0_f32, 8.0, 9.0].map(f32::to_le_bytes).concat();
    for dense in [true, false] {
        let square = load_one(|maker| {
            let indices = maker.view(&[2, 0, 0, 0]);
            let values = maker.view(&moved);
            let position = maker.floats("VEC3", &SQUARE);
            let accessor = &mut maker.json["accessors"][position];
            if !dense {
                accessor.as_object_mut().unwrap().remove("bufferView");
            }
            accessor["sparse"] = json!({"count": 1,
                "indices": {"bufferView": indices, "componentType": U32},
                "values": {"bufferView": values}});
            json!({"attributes": {"POSITION": position}})
        });
        let mut expected = if dense { corners() } else { [Vec3::ZERO; 4] };
        expected[2] = Vec3::new(7.0, 8.0, 9.0);
        assert_eq!(square.positions, expected);
    }
}

#[test]
fn interleaved_vertices_are_told_apart() {
    let square = load_one(|maker| {
        let mut bytes = Vec::new();
        for (corner, number) in SQUARE.chunks(3).zip(0_u8..) {
            bytes.extend(corner.iter().flat_map(|x| x.to_le_bytes()));
            bytes.extend([number * 85, 0, 255, 0]);
        }
        let view = maker.view(&bytes);
        maker.json["bufferViews"][view]["byteStride"] = json!(16);
        let mut attribute = |component: u32, offset: usize| {
            maker.push(
                "accessors",
                json!({"bufferView": view, "byteOffset": offset, "count": 4,
                "componentType": component, "type": "VEC3", "normalized": component == U8}),
            )
        };
        json!({"attributes": {"POSITION": attribute(5126, 0), "COLOR_0": attribute(U8, 12)}})
    });
    assert_eq!(square.positions, corners());
    let reds: Vec<f32> = square.colors.iter().map(|color| color.x).collect();
    assert_eq!(reds, [0.0, 1.0 / 3.0, 2.0 / 3.0, 1.0]);
    assert_eq!(square.colors[3], Vec4::new(1.0, 0.0, 1.0, 1.0), "RGB has alpha 1");
}

/// glTF 2.0 §3.11: c / 255, c / 65535, max(c / 127, −1).
#[test]
fn normalised_integers_are_fractions() {
    let square = load_one(|maker| {
        let color = [0_u16, 65535, 13107, 65535].map(u16::to_le_bytes).concat().repeat(4);
        let color = maker.accessor(U16, "VEC4", 4, &color);
        let normal = maker.accessor(I8, "VEC3", 4, &[128, 0, 0].repeat(4));
        let uv = maker.accessor(U8, "VEC2", 4, &[51, 255].repeat(4));
        for accessor in [color, normal, uv] {
            maker.json["accessors"][accessor]["normalized"] = json!(true);
        }
        json!({"attributes": {"POSITION": maker.floats("VEC3", &SQUARE), "COLOR_0": color,
            "NORMAL": normal, "TEXCOORD_1": uv}})
    });
    assert_eq!(square.colors[0], Vec4::new(0.0, 1.0, 0.2, 1.0));
    assert_eq!(square.normals[0], Vec3::NEG_X);
    assert_eq!(square.uvs[1][0], Vec2::new(0.2, 1.0));
    assert!(square.uvs[0].is_empty());
}

/// KHR_mesh_quantization: integers that are not normalised are numbers.
#[test]
fn quantised_positions_are_whole_numbers() {
    let square = load_one(|maker| {
        maker.json["extensionsRequired"] = json!(["KHR_mesh_quantization"]);
        let position = [0, 0, 0, 100, 0, 0, 156, 100, 0];
        json!({"attributes": {"POSITION": maker.accessor(I8, "VEC3", 3, &position)}})
    });
    assert_eq!(square.positions[1], Vec3::X * 100.0);
    assert_eq!(square.positions[2], Vec3::new(-100.0, 100.0, 0.0));
}

#[test]
fn triangles_with_infinite_corners_are_left_out() {
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1e30] {
        let mut positions = SQUARE;
        positions[3] = bad;
        let scene = Maker::with_primitive(|maker| {
            json!({"attributes": {"POSITION": maker.floats("VEC3", &positions)},
                "indices": maker.accessor(U8, "SCALAR", 6, &[0, 1, 2, 0, 2, 3])})
        })
        .load();
        assert_eq!(mesh(&scene, 0).triangles, [[0, 2, 3]], "{bad}");
        assert!(scene.warnings[0].contains("infinite or NaN"), "{:?}", scene.warnings);
    }
}

/// One primitive with normals, one without, in one mesh: the second gets the normals of its faces.
#[test]
fn primitives_without_normals_beside_some_with_them_are_flat() {
    let mut maker = Maker::with_primitive(|maker| {
        let normal = maker.floats("VEC3", &[0.0, 0.6, 0.8].repeat(4));
        json!({"attributes": {"POSITION": maker.floats("VEC3", &SQUARE), "NORMAL": normal}})
    });
    let primitive = json!({"attributes": {"POSITION": 1}, "mode": 6});
    maker.json["meshes"][0]["primitives"].as_array_mut().unwrap().push(primitive);
    let scene = maker.load();
    let square = mesh(&scene, 0);
    assert_eq!(square.triangles, [[0, 1, 2], [4, 5, 6], [7, 8, 9]]);
    assert!((square.normals[0] - Vec3::new(0.0, 0.6, 0.8)).length() < 1e-6);
    assert_eq!(square.normals[4..], [Vec3::Z; 6]);
}

#[test]
fn primitives_that_share_vertices_share_them_here() {
    let mut maker = Maker::with_primitive(|maker| {
        json!({"attributes": {"POSITION": maker.floats("VEC3", &SQUARE)},
            "indices": maker.accessor(U8, "SCALAR", 3, &[0, 1, 2]), "material": 0})
    });
    let indices = maker.accessor(U8, "SCALAR", 3, &[0, 2, 3]);
    let second = json!({"attributes": {"POSITION": 0}, "indices": indices});
    maker.json["meshes"][0]["primitives"].as_array_mut().unwrap().push(second);
    maker.push("materials", json!({"name": "first"}));
    let scene = maker.load();
    assert_eq!(mesh(&scene, 0).positions.len(), 4);
    assert_eq!(mesh(&scene, 0).triangles, [[0, 1, 2], [0, 2, 3]]);
    let materials = mesh(&scene, 0).triangle_materials.iter();
    assert!(materials.eq([0, 1]), "the second has the default material");
    assert_eq!(scene.materials.len(), 2);
    assert_eq!(scene.materials[1].metallic, 0.0);
}

#[test]
fn attributes_of_other_lengths_are_refused() {
    let maker = Maker::with_primitive(|maker| {
        let normal = maker.floats("VEC3", &[0.0, 0.0, 1.0].repeat(3));
        json!({"attributes": {"POSITION": maker.floats("VEC3", &SQUARE), "NORMAL": normal}})
    });
    assert!(maker.refusal().contains("/meshes/0/primitives/0/attributes/NORMAL"));
}

/// Of the same accessors; another material makes another mesh.
#[test]
fn the_same_mesh_twice_in_the_file_is_one_geometry() {
    let mut maker = Maker::with_primitive(
        |maker| json!({"attributes": {"POSITION": maker.floats("VEC3", &SQUARE)}}),
    );
    let mesh = maker.json["meshes"][0].clone();
    let red = json!({"primitives": [{"attributes": {"POSITION": 0}, "material": 0}]});
    maker.json["materials"] = json!([{}]);
    maker.json["meshes"] = json!([mesh, red, mesh]);
    maker.json["nodes"] =
        (0..3).map(|mesh| json!({"mesh": mesh, "translation": [mesh, 0, 0]})).collect();
    let scene = maker.load();
    let geometries: Vec<u32> = scene.instances.iter().map(|one| one.geometry).collect();
    assert_eq!((geometries, scene.geometries.len()), (vec![0, 1, 0], 2));
}

#[test]
fn triangles_with_two_corners_in_one_vertex_are_dropped() {
    let scene = Maker::with_primitive(|maker| {
        let indices: Vec<u8> = [0, 1, 2, 2, 3, 0].to_vec();
        let indices = maker.accessor(U8, "SCALAR", 6, &indices);
        json!({"mode": 5, "indices": indices,
            "attributes": {"POSITION": maker.floats("VEC3", &SQUARE)}})
    })
    .load();
    // Of a strip's four the second and third turn it.
    assert_eq!(mesh(&scene, 0).triangles, [[0, 1, 2], [2, 0, 3]]);
}

#[test]
fn a_mesh_at_two_nodes_is_one_geometry_and_one_at_none_is_dropped() {
    let mut maker = Maker::with_primitive(
        |maker| json!({"attributes": {"POSITION": maker.floats("VEC3", &SQUARE)}}),
    );
    let unused = maker.json["meshes"][0].clone();
    maker.json["meshes"].as_array_mut().unwrap().insert(0, unused);
    maker.json["nodes"] = json!([{"mesh": 1}, {}, {"mesh": 1, "translation": [1, 0, 0]}]);
    let scene = maker.load();
    assert_eq!(scene.geometries.len(), 1);
    let places: Vec<_> = scene.instances.iter().map(|i| (i.node, i.geometry)).collect();
    assert_eq!(places, [(0, 0), (2, 0)]);
}
