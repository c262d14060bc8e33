//! The transform hierarchy, scenes, cameras and lights.

use frameless_scene::{Choice, LightKind, Limits, Projection, Transform, load_chosen};
use glam::{Mat4, Quat, Vec3};
use serde_json::json;

use super::maker::{Maker, SQUARE};

/// The rest pose of a single node with this matrix, and the warnings.
fn load_matrix(matrix: Mat4) -> (Transform, Vec<String>) {
    let mut maker = Maker::new();
    maker.push("nodes", json!({"matrix": matrix.to_cols_array()}));
    let scene = maker.load();
    (scene.nodes[0].rest, scene.warnings)
}

#[test]
fn matrices_become_translation_rotation_and_scale() {
    let rotation = Quat::from_euler(glam::EulerRot::XYZ, 0.3, -1.1, 2.0);
    let translation = Vec3::new(1.0, -2.0, 3.0);
    for scale in [
        Vec3::ONE,
        Vec3::new(2.0, 0.5, 3.0),
        Vec3::new(-1.0, 1.0, 1.0),
        Vec3::new(1.0, -2.0, 3.0),
        Vec3::new(-1.0, -1.0, -1.0),
        Vec3::new(1e-12, 1e-12, 1e-12),
        Vec3::new(1e15, 1e12, 1e15),
        Vec3::new(0.0, 1.0, 2.0),
        Vec3::new(1.0, 0.0, 2.0),
        Vec3::new(0.0, 0.0, 2.0),
        Vec3::new(2.0, 0.0, 0.0),
        Vec3::ZERO,
    ] {
        let matrix = Mat4::from_scale_rotation_translation(scale, rotation, translation);
        let (rest, warnings) = load_matrix(matrix);
        let error = (Mat4::from(rest.affine()) - matrix).to_cols_array();
        let error = error.into_iter().fold(0.0_f32, |error, x| error.max(x.abs()));
        assert!(error <= 1e-5 * scale.abs().max_element(), "{scale}: off by {error}");
        assert!((rest.rotation.length() - 1.0).abs() < 1e-5, "{scale}");
        assert_eq!(warnings, ["the file has nothing to draw"], "{scale}");
    }
}

#[test]
fn sheared_matrices_lose_their_shear_aloud() {
    let mut shear = Mat4::IDENTITY;
    shear.y_axis.x = 0.5;
    let (_, warnings) = load_matrix(shear);
    assert!(warnings[0].contains("sheared"), "{warnings:?}");
}

#[test]
fn a_matrix_counts_more_than_what_else_places_its_node() {
    let matrix = Mat4::from_translation(Vec3::X).to_cols_array();
    for other in ["translation", "rotation", "scale"] {
        let mut maker = Maker::new();
        let numbers = if other == "rotation" { json!([0, 1, 0, 0]) } else { json!([5, 5, 5]) };
        maker.push("nodes", json!({"name": "twice", "matrix": matrix, other: numbers}));
        let scene = maker.load();
        assert_eq!(scene.nodes[0].rest, Transform { translation: Vec3::X, ..Transform::IDENTITY });
        let warning = &scene.warnings[0];
        assert!(warning.contains("the matrix counts") && warning.contains("twice"), "{warning}");
    }
}

#[test]
fn rotations_get_length_one() {
    for (rotation, expected) in [
        ([0.0, 2.0, 0.0, 0.0], Quat::from_xyzw(0.0, 1.0, 0.0, 0.0)),
        ([0.0, 0.0, 1e-30, 0.0], Quat::IDENTITY),
        ([0.0, 0.0, 0.0, 3e38], Quat::IDENTITY),
        ([0.0; 4], Quat::IDENTITY),
    ] {
        let mut maker = Maker::new();
        maker.push("nodes", json!({"rotation": rotation}));
        assert_eq!(maker.load().nodes[0].rest.rotation, expected, "{rotation:?}");
    }
}

#[test]
fn children_come_after_their_parents() {
    let mut maker = Maker::new();
    maker.json["nodes"] = json!([{"name": "leaf"}, {"name": "branch", "children": [0]},
        {"name": "root", "children": [1, 3]}, {"name": "other leaf"}]);
    let scene = maker.load();
    let nodes: Vec<_> = scene.nodes.iter().map(|node| (node.name.as_str(), node.parent)).collect();
    let expected =
        [("root", None), ("branch", Some(0)), ("other leaf", Some(0)), ("leaf", Some(1))];
    assert_eq!(nodes[..4], expected);
}

#[test]
fn loops_and_two_parents_are_refused() {
    for (nodes, place) in [
        (json!([{"children": [0]}]), "/nodes/0"),
        (json!([{}, {"children": [2]}, {"children": [1]}]), "/nodes/1"),
        (json!([{"children": [2]}, {"children": [2]}, {}]), "/nodes/1/children/0"),
        (json!([{"children": [1, 1]}, {}]), "/nodes/0/children/1"),
    ] {
        let mut maker = Maker::new();
        maker.json["nodes"] = nodes;
        assert!(
            maker.refusal().starts_with(&format!("made.glb: {place}: ")),
            "{}",
            maker.refusal()
        );
    }
}

#[test]
fn the_default_scene_is_shown_unless_another_is_asked_for() {
    let mut maker = Maker::with_primitive(
        |maker| json!({"attributes": {"POSITION": maker.floats("VEC3", &SQUARE)}}),
    );
    maker.json["nodes"] =
        json!([{"mesh": 0, "name": "a"}, {"mesh": 0, "name": "b"}, {"name": "c"}]);
    maker.json["scenes"] = json!([{"nodes": [0, 2], "name": "7"}, {"nodes": [1], "name": "yard"}]);
    assert_eq!(maker.load().nodes[0].name, "a", "the first, as there is no default");
    maker.json["scene"] = json!(1);
    let scene = maker.load();
    assert_eq!(scene.nodes[0].name, "b");
    assert_eq!(scene.instances.len(), 1);
    assert!(scene.warnings[0].contains("2 scenes"), "{:?}", scene.warnings);
    let path = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("scenes.glb");
    std::fs::write(&path, maker.glb()).unwrap();
    let load = |text: &str| {
        let choice = Choice { scene: text.parse().ok(), ..Choice::default() };
        load_chosen(&path, &choice, &Limits::default())
    };
    let first = load("0").unwrap();
    assert_eq!((first.nodes[0].name.as_str(), first.contents.shown_scene), ("a", Some(0)));
    assert!(first.warnings.is_empty(), "it was asked for: {:?}", first.warnings);
    assert_eq!(load("7").unwrap().nodes[0].name, "a", "a name that is a number");
    assert_eq!(load("yard").unwrap().nodes[0].name, "b");
    let there = "got 2 scenes: 0 \"7\", 1 \"yard\"";
    for (wrong, wanted) in [("2", "scene 2"), ("barn", "scene \"barn\"")] {
        let error = load(wrong).unwrap_err().to_string();
        let expected = format!("/scenes: wanted {wanted}, as was asked for, {there}");
        assert!(error.ends_with(&expected), "{error}");
    }
    maker.json["scene"] = json!(2);
    assert!(maker.refusal().contains("/scene: "));
}

#[test]
fn without_scenes_all_nodes_are_shown() {
    let mut maker = Maker::new();
    maker.json["nodes"] = json!([{"name": "a"}, {"name": "b"}]);
    assert_eq!(maker.load().nodes[1].name, "b");
}

#[test]
fn cameras_and_lights_stand_at_their_nodes() {
    let mut maker = Maker::new();
    maker.json["cameras"] = json!([{"type": "perspective", "perspective": {"yfov": 0.5, "znear": 1}},
        {"name": "flat", "type": "orthographic", "orthographic": {"ymag": -2.0}}]);
    maker.json["extensions"] = json!({"KHR_lights_punctual": {"lights": [
        {"type": "point", "color": [1.0, 0.5, 0.0], "intensity": 4.0},
        {"type": "directional"},
        {"type": "spot", "range": 3.0, "spot": {"innerConeAngle": 0.5, "outerConeAngle": 0.5}}]}});
    let light = |light: u32| json!({"KHR_lights_punctual": {"light": light}});
    maker.json["nodes"] = json!([{"camera": 1}, {"camera": 0, "name": "eye", "extensions": light(0)},
        {"extensions": light(1)}, {"extensions": light(2)}]);
    let scene = maker.load();
    assert_eq!(scene.notes, [""; 0]);
    assert_eq!(scene.cameras[0].projection, Projection::Orthographic { ymag: 2.0 });
    assert_eq!((scene.cameras[0].name.as_str(), scene.cameras[0].node), ("flat", 0));
    assert_eq!(scene.cameras[1].projection, Projection::Perspective { yfov_rad: 0.5 });
    assert_eq!((scene.cameras[1].name.as_str(), scene.cameras[1].node), ("eye", 1));
    assert_eq!(scene.lights[0].intensity, Vec3::new(4.0, 2.0, 0.0));
    assert_eq!((scene.lights[0].kind, scene.lights[0].node), (LightKind::Point, 1));
    assert_eq!(scene.lights[0].range, f32::INFINITY);
    assert_eq!(
        (scene.lights[1].kind, scene.lights[1].intensity),
        (LightKind::Directional, Vec3::ONE)
    );
    let LightKind::Spot { cos_inner, cos_outer } = scene.lights[2].kind else { panic!("a spot") };
    assert!(cos_outer < cos_inner && (cos_outer - 0.5_f32.cos()).abs() < 1e-6);
    assert_eq!(scene.ambient, Vec3::ZERO);
}

#[test]
fn forbidden_cones_are_drawn_as_far_as_they_can_be() {
    let load = |inner: f32, outer: f32| {
        let mut maker = Maker::new();
        let spot = json!({"innerConeAngle": inner, "outerConeAngle": outer});
        let lights = json!([{"name": "lamp", "type": "spot", "spot": spot}]);
        maker.json["extensions"] = json!({"KHR_lights_punctual": {"lights": lights}});
        maker.push("nodes", json!({"extensions": {"KHR_lights_punctual": {"light": 0}}}));
        let scene = maker.load();
        let LightKind::Spot { cos_inner, cos_outer } = scene.lights[0].kind else {
            panic!("a spot")
        };
        let about = |warning: &&String| warning.contains("cone") && warning.contains("lamp");
        ([cos_inner, cos_outer], scene.warnings.iter().filter(about).count())
    };
    for (inner, outer, border, warnings) in [
        (0.2, 0.5, 0.5f32, 0),
        (0.5, 0.5, 0.5, 1),
        (1.2, 0.5, 0.5, 1),
        (0.2, 2.5, std::f32::consts::FRAC_PI_2, 1),
        (3.0, 2.5, std::f32::consts::FRAC_PI_2, 2),
    ] {
        let ([cos_inner, cos_outer], came) = load(inner, outer);
        let case = format!("{inner}, {outer}: {cos_inner}, {cos_outer}");
        assert_eq!(came, warnings, "{case}");
        assert!((cos_outer - border.cos()).abs() < 1e-6, "{case}");
        assert!(cos_inner > cos_outer, "{case}");
        assert_eq!(inner >= outer, cos_inner < cos_outer + 1e-3, "{case}");
    }
}

/// Seen from the added camera, every corner lies inside a picture of 4:3, which they fill.
#[test]
fn the_added_camera_sees_everything() {
    for (scale, place) in [(1.0, 0.0), (1e-2, 5.0), (1e4, -1e5), (1e-7, 0.0), (100.0, 1e7)] {
        let mut maker = Maker::with_primitive(
            |maker| json!({"attributes": {"POSITION": maker.floats("VEC3", &SQUARE)}, "mode": 6}),
        );
        maker.json["nodes"][0]["scale"] = json!([scale, scale, scale]);
        maker.json["nodes"][0]["translation"] = json!([place, place, place]);
        let scene = maker.load();
        let state = scene.state_at(0.0);
        let camera_from_world = scene.view_at(&state, 0).world_from_camera.inverse();
        let Projection::Perspective { yfov_rad } = scene.cameras[0].projection else {
            panic!("the added camera is a perspective one")
        };
        let mut farthest = 0.0f32;
        let half = (yfov_rad / 2.0).tan();
        for corner in SQUARE.chunks(3) {
            let world = state.world_from_node[0].transform_point3(Vec3::from_slice(corner));
            let seen = camera_from_world.transform_point3(world);
            let slope = (seen.x.abs() / (4.0 / 3.0)).max(seen.y.abs()) / -seen.z;
            assert!(seen.z < 0.0 && slope <= half, "{scale}: {seen}");
            farthest = farthest.max(slope);
        }
        assert!(farthest > 0.3 * half, "{scale}: a speck, {farthest} of {half}");
        assert!(scene.notes[0].contains("camera") && scene.notes[1].contains("light"));
    }
}

#[test]
fn what_no_camera_can_show_is_warned_of() {
    for (scale, place, warning) in [
        (0.0, 1.0, "told from a point"),
        (1.0, 1e9, "told from a point"),
        (1e13, 0.0, "farther than 1e12 m"),
    ] {
        let mut maker = Maker::with_primitive(
            |maker| json!({"attributes": {"POSITION": maker.floats("VEC3", &SQUARE)}, "mode": 6}),
        );
        maker.json["nodes"][0]["scale"] = json!([scale, scale, scale]);
        maker.json["nodes"][0]["translation"] = json!([place, place, place]);
        let warnings = maker.load().warnings;
        assert!(warnings.iter().any(|w| w.contains(warning)), "{scale}: {warnings:?}");
    }
}

#[test]
fn an_empty_file_is_a_scene_that_says_so() {
    let scene = Maker::new().load();
    assert_eq!(scene.warnings, ["the file has nothing to draw"]);
    assert_eq!(scene.cameras.len(), 1);
}

/// A square at every node, and the material that it has.
fn squares(nodes: serde_json::Value, material: serde_json::Value) -> Maker {
    let mut maker = Maker::with_primitive(
        |maker| json!({"attributes": {"POSITION": maker.floats("VEC3", &SQUARE)}, "mode": 6, "material": 0}),
    );
    maker.json["materials"] = json!([material]);
    maker.json["nodes"] = nodes;
    maker
}

/// How many squares are drawn, and what is said of the others.
fn drawn(nodes: serde_json::Value, material: serde_json::Value) -> (usize, Option<String>) {
    let scene = squares(nodes, material).load();
    let said = scene.warnings.iter().find(|warning| warning.contains("left out"));
    (scene.instances.len(), said.cloned())
}

#[test]
fn what_stands_in_the_same_place_many_times_is_drawn_once() {
    let same = json!({"mesh": 0, "translation": [1, 2, 3]});
    let other = json!({"mesh": 0, "translation": [1, 2, 3.000001]});
    let nodes = json!([same, same, other, {"mesh": 0, "translation": [1, 2, 3], "scale": [1, 1, 1]}, other]);
    let said = "3 instances were left out, as the same mesh stands in the same place already";
    assert_eq!(drawn(nodes, json!({})), (2, Some(said.into())));
    // As many veils as are seen one behind the other.
    let veil = json!({"alphaMode": "BLEND"});
    let veils = drawn(json!(vec![same.clone(); 20]), veil.clone());
    assert_eq!((veils.0, veils.1.is_some()), (16, true));
    assert_eq!(drawn(json!(vec![same; 16]), veil), (16, None));
}

#[test]
fn what_moves_is_nobodys_twin() {
    let same = json!({"mesh": 0});
    // The first stands in the others' place only when the animation begins.
    let mut maker = squares(json!([same, same, same]), json!({}));
    let times = maker.floats("SCALAR", &[0.0, 1.0]);
    let places = maker.floats("VEC3", &[0.0, 0.0, 0.0, 5.0, 0.0, 0.0]);
    maker.json["animations"] = json!([{
        "samplers": [{"input": times, "output": places}],
        "channels": [{"sampler": 0, "target": {"node": 0, "path": "translation"}}]}]);
    let scene = maker.load();
    let nodes: Vec<u32> = scene.instances.iter().map(|instance| instance.node).collect();
    assert_eq!(nodes, [0, 1]);
}
