//! Skins and morph targets: where vertices come to lie, known without running.

use frameless_scene::{Deformed, Interpolation, Limits, Problem, Scene, Target, load_bytes};
use glam::{Affine3A, Quat, Vec3, Vec4};
use serde_json::{Value, json};

use super::maker::{F32, I8, Maker, SQUARE, U8, U16, mesh};

/// Rotation by a right angle about z.
const QUARTER: [f32; 4] =
    [0.0, 0.0, std::f32::consts::FRAC_1_SQRT_2, std::f32::consts::FRAC_1_SQRT_2];

/// Vertices of the arm along x: its begin, its elbow's lower side, its end.
const ARM: [f32; 9] = [0.0, 0.0, 0.0, 1.0, -0.5, 0.0, 2.0, 0.0, 0.0];

/// An arm with an elbow at x = 1, bent there by 90°; its node stands somewhere else, which must not matter.
fn arm(joints: &[u8; 12], weights: &[f32; 12]) -> Maker {
    let mut maker = Maker::new();
    let position = maker.floats("VEC3", &ARM);
    let normal = maker.floats("VEC3", &[0.0, 1.0, 0.0].repeat(3));
    let joints = maker.accessor(U8, "VEC4", 3, joints);
    let weights = maker.floats("VEC4", weights);
    let to_elbow = Affine3A::from_translation(Vec3::NEG_X);
    let bind = [Affine3A::IDENTITY, to_elbow].map(|m| glam::Mat4::from(m).to_cols_array());
    let bind = maker.floats("MAT4", &bind.concat());
    let attributes =
        json!({"POSITION": position, "NORMAL": normal, "JOINTS_0": joints, "WEIGHTS_0": weights});
    maker.json["meshes"] = json!([{"primitives": [{"attributes": attributes}]}]);
    maker.json["skins"] = json!([{"joints": [1, 2], "inverseBindMatrices": bind}]);
    maker.json["nodes"] = json!([
        {"mesh": 0, "skin": 0, "translation": [100.0, 0.0, 0.0], "scale": [7.0, 7.0, 7.0]},
        {"name": "shoulder", "children": [2]},
        {"name": "elbow", "translation": [1.0, 0.0, 0.0], "rotation": QUARTER}]);
    maker
}

/// The begin follows the shoulder, the end the elbow, the elbow's vertex both.
fn bent_arm() -> Maker {
    arm(
        &[0, 0, 0, 0, 0, 1, 0, 0, 1, 0, 0, 0],
        &[1.0, 0.0, 0.0, 0.0, 0.5, 0.5, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0],
    )
}

/// Vertices and normals of deformation `index`, in the world.
fn deformed(scene: &Scene, index: usize, secs: f64) -> (Vec<Vec3>, Vec<Vec3>) {
    let (mut deformed, state) = (Deformed::default(), scene.state_at(secs));
    assert!(scene.deform(index, &state, &mut deformed));
    assert!(!scene.deform(index, &state, &mut deformed), "the pose is the same");
    let instance = scene.deformations[index].instance as usize;
    let world = scene.world_from_instance(instance, &state);
    let positions = deformed.positions().iter();
    let positions = positions.map(|&p| world.transform_point3a(p).into()).collect();
    (positions, deformed.normals().iter().map(|&normal| normal.into()).collect())
}

fn assert_close(came: &[Vec3], expected: &[[f32; 3]]) {
    assert_eq!(came.len(), expected.len());
    for (came, &expected) in came.iter().zip(expected) {
        assert!(came.abs_diff_eq(expected.into(), 1e-6), "{came} instead of {expected:?}");
    }
}

#[test]
fn an_arm_bends_at_its_elbow() {
    let scene = bent_arm().load();
    let (positions, normals) = deformed(&scene, 0, 0.0);
    // The elbow's vertex: half stays at (1, −0.5), half turns about (1, 0) to (1.5, 0).
    assert_close(&positions, &[[0.0, 0.0, 0.0], [1.25, -0.25, 0.0], [1.0, 1.0, 0.0]]);
    let slanted = Vec3::new(-1.0, 1.0, 0.0).normalize().to_array();
    assert_close(&normals, &[[0.0, 1.0, 0.0], slanted, [-1.0, 0.0, 0.0]]);
    let bounds = scene.bounds_at(&scene.state_at(0.0)).unwrap();
    assert!(bounds.max.abs_diff_eq(Vec3::new(1.25, 1.0, 0.0), 1e-6), "{bounds:?}");
}

#[test]
fn normals_stay_across_when_a_joint_is_scaled() {
    let mut maker = bent_arm();
    maker.json["nodes"][2] = json!({"translation": [1.0, 0.0, 0.0], "scale": [4.0, 0.25, -1.0]});
    let normal = maker.floats("VEC3", &[0.6, 0.8, 0.0].repeat(3));
    maker.json["meshes"][0]["primitives"][0]["attributes"]["NORMAL"] = json!(normal);
    let (_, normals) = deformed(&maker.load(), 0, 0.0);
    // (n_x / 4, n_y · 4), up to the sign, which tells nothing of a surface that is seen from both sides.
    let expected = Vec3::new(0.15, 3.2, 0.0).normalize();
    assert!((normals[2].dot(expected).abs() - 1.0).abs() < 1e-6, "{:?}", normals[2]);
}

#[test]
fn instances_of_one_mesh_have_skins_of_their_own() {
    let mut maker = bent_arm();
    let bind = maker.json["skins"][0]["inverseBindMatrices"].clone();
    maker.push("skins", json!({"joints": [4, 5], "inverseBindMatrices": bind}));
    maker.push("nodes", json!({"mesh": 0, "skin": 1}));
    maker.push("nodes", json!({"children": [5], "translation": [0.0, 0.0, 3.0]}));
    maker.push("nodes", json!({"translation": [1.0, 0.0, 0.0]}));
    maker.push("nodes", json!({"mesh": 0, "translation": [9.0, 0.0, 0.0]}));
    maker.push("nodes", json!({"mesh": 0, "skin": 0}));
    // It moves later: else the last would be left out as the first one's twin.
    let (times, place) = (maker.floats("SCALAR", &[0.0, 1.0]), maker.floats("VEC3", &[0.0; 6]));
    maker.json["animations"] = json!([{"samplers": [{"input": times, "output": place}],
        "channels": [{"sampler": 0, "target": {"node": 1, "path": "translation"}}]}]);
    let scene = maker.load();
    assert_eq!((scene.geometries.len(), scene.instances.len(), scene.skins.len()), (1, 4, 2));
    assert_eq!(deformed(&scene, 0, 0.0), deformed(&scene, 2, 0.0));
    assert_eq!(scene.deformation_of(2), None, "the third is as it was modelled");
    let (positions, _) = deformed(&scene, 0, 0.0);
    assert_close(&positions[2..], &[[1.0, 1.0, 0.0]]);
    let (positions, _) = deformed(&scene, 1, 0.0);
    assert_close(&positions, &[[0.0, 0.0, 3.0], [1.0, -0.5, 3.0], [2.0, 0.0, 3.0]]);
}

#[test]
fn weights_that_do_not_sum_to_one_are_brought_there() {
    let nan = f32::NAN;
    let weights = [0.0, 0.0, 0.0, 0.0, 3.0, 3.0, 0.0, 0.0, 2.0, nan, -7.0, f32::INFINITY];
    // The first vertex has no weight: it follows its first joint. Joints that do not count may be anything.
    let scene = arm(&[0, 0, 0, 0, 0, 1, 0, 0, 1, 9, 99, 255], &weights).load();
    let (positions, _) = deformed(&scene, 0, 0.0);
    assert_close(&positions, &[[0.0, 0.0, 0.0], [1.25, -0.25, 0.0], [1.0, 1.0, 0.0]]);
    for what in ["negative, infinite or NaN", "without a joint weight"] {
        assert!(scene.warnings.iter().any(|w| w.contains(what)), "{what}: {:?}", scene.warnings);
    }
}

#[test]
fn weights_may_be_bytes_or_shorts() {
    for (component, bytes) in [
        (U8, [[255, 0, 0, 0], [128, 128, 0, 0], [255, 0, 0, 0]].concat()),
        (
            U16,
            [
                [255, 255, 0, 0, 0, 0, 0, 0],
                [0, 128, 0, 128, 0, 0, 0, 0],
                [255, 255, 0, 0, 0, 0, 0, 0],
            ]
            .concat(),
        ),
    ] {
        let mut maker = bent_arm();
        let weights = maker.accessor(component, "VEC4", 3, &bytes);
        maker.json["accessors"][weights]["normalized"] = json!(true);
        maker.json["meshes"][0]["primitives"][0]["attributes"]["WEIGHTS_0"] = json!(weights);
        let joints = [[0_u16; 4], [0, 1, 0, 0], [1, 0, 0, 0]].concat();
        let joints: Vec<u8> = joints.into_iter().flat_map(u16::to_le_bytes).collect();
        let joints = maker.accessor(U16, "VEC4", 3, &joints);
        maker.json["meshes"][0]["primitives"][0]["attributes"]["JOINTS_0"] = json!(joints);
        let (positions, _) = deformed(&maker.load(), 0, 0.0);
        assert_close(&positions, &[[0.0, 0.0, 0.0], [1.25, -0.25, 0.0], [1.0, 1.0, 0.0]]);
    }
}

#[test]
fn more_than_four_joints_carry_a_vertex() {
    let mut maker = bent_arm();
    // A quarter each of shoulder, shoulder, shoulder and (in the second set) elbow.
    let weights = maker.floats("VEC4", &[0.25, 0.25, 0.25, 0.0].repeat(3));
    let more_weights = maker.floats("VEC4", &[0.0, 0.25, 0.0, 0.0].repeat(3));
    let joints = maker.accessor(U8, "VEC4", 3, &[0; 12]);
    let more_joints = maker.accessor(U8, "VEC4", 3, &[0, 1, 0, 0].repeat(3));
    let attributes = &mut maker.json["meshes"][0]["primitives"][0]["attributes"];
    (attributes["JOINTS_0"], attributes["WEIGHTS_0"]) = (json!(joints), json!(weights));
    (attributes["JOINTS_1"], attributes["WEIGHTS_1"]) = (json!(more_joints), json!(more_weights));
    let scene = maker.load();
    assert_eq!(mesh(&scene, 0).influences.len(), 2);
    let (positions, _) = deformed(&scene, 0, 0.0);
    assert_close(&positions[2..], &[[0.75 * 2.0 + 0.25 * 1.0, 0.25, 0.0]]);
}

#[test]
fn joints_that_the_skin_does_not_have_are_refused() {
    let joints = [0, 0, 0, 0, 0, 2, 0, 0, 1, 0, 0, 0];
    let refusal = arm(&joints, &[0.5; 12]).refusal();
    let expected = "/nodes/0/skin: wanted a skin of more than 2 joints, as the mesh names that one";
    assert!(refusal.contains(expected), "{refusal}");
    let mut maker = bent_arm();
    maker.json["skins"][0]["joints"] = json!([1, 9]);
    assert!(maker.refusal().contains("/skins/0/joints/1: wanted an index"), "{}", maker.refusal());
    maker.json["skins"][0]["joints"] = json!([]);
    assert!(maker.refusal().contains("at least one joint"), "{}", maker.refusal());
    maker.json["skins"][0]["joints"] = json!([1, 2, 2]);
    let refusal = maker.refusal();
    assert!(
        refusal.contains("/inverseBindMatrices: wanted a matrix for each of the 3"),
        "{refusal}"
    );
    let mut maker = bent_arm();
    maker.json["nodes"][2]["children"] = json!([1]);
    assert!(maker.refusal().contains("its own descendant"), "{}", maker.refusal());
    let mut maker = bent_arm();
    maker.json["meshes"][0]["primitives"][0]["attributes"]["JOINTS_0"] = json!(3);
    assert!(maker.refusal().contains("VEC4 of 5121 or 5123 as joints"), "{}", maker.refusal());
}

#[test]
fn a_skin_that_cannot_be_used_leaves_the_shape_aloud() {
    let mut elsewhere = bent_arm();
    elsewhere.json["scenes"] = json!([{"nodes": [0]}]);
    let mut jointless = bent_arm();
    let attributes = &mut jointless.json["meshes"][0]["primitives"][0]["attributes"];
    attributes.as_object_mut().unwrap().remove("JOINTS_0");
    for (maker, why) in [(elsewhere, "not in the scene"), (jointless, "name no joints")] {
        let scene = maker.load();
        assert!(scene.deformations.is_empty());
        assert!(scene.warnings.iter().any(|w| w.contains(why)), "{:?}", scene.warnings);
    }
}

#[test]
fn infinite_bind_matrices_are_left_out_aloud() {
    let mut maker = bent_arm();
    let bind = maker.floats("MAT4", &[[f32::NAN; 16], [f32::INFINITY; 16]].concat());
    maker.json["skins"][0]["inverseBindMatrices"] = json!(bind);
    let scene = maker.load();
    assert!(scene.warnings.iter().any(|w| w.contains("bind matrices")), "{:?}", scene.warnings);
}

/// A square at a node, with a target that lifts it by 2 and one that shifts it by 4.
fn morphed(edit: impl FnOnce(&mut Maker, &mut Value)) -> Maker {
    let mut maker = Maker::new();
    let position = maker.floats("VEC3", &SQUARE);
    let normal = maker.floats("VEC3", &[0.0, 0.0, 1.0].repeat(4));
    let color = maker.floats("VEC4", &[0.5, 0.5, 0.5, 1.0].repeat(4));
    let lift = maker.floats("VEC3", &[0.0, 0.0, 2.0].repeat(4));
    let turn = maker.floats("VEC3", &[1.0, 0.0, 0.0].repeat(4));
    let redden = maker.floats("VEC3", &[2.0, 0.0, -0.5].repeat(4));
    let shift = maker.floats("VEC3", &[4.0, 0.0, 0.0].repeat(4));
    let mut primitive = json!({"mode": 6,
        "attributes": {"POSITION": position, "NORMAL": normal, "COLOR_0": color},
        "targets": [{"POSITION": lift, "NORMAL": turn, "COLOR_0": redden}, {"POSITION": shift}]});
    edit(&mut maker, &mut primitive);
    maker.json["meshes"] = json!([{"primitives": [primitive]}]);
    maker.json["nodes"] = json!([{"mesh": 0, "translation": [0.0, 10.0, 0.0]}]);
    maker
}

#[test]
fn half_a_target_is_half_the_way() {
    let mut maker = morphed(|_, _| ());
    let (positions, _) = deformed(&maker.load(), 0, 0.0);
    assert_close(&positions[2..3], &[[1.0, 11.0, 0.0]]);
    maker.json["meshes"][0]["weights"] = json!([0.5, 0.0]);
    let scene = maker.load();
    let (positions, normals) = deformed(&scene, 0, 0.0);
    assert_close(&positions[2..3], &[[1.0, 11.0, 1.0]]);
    assert_close(&normals[2..3], &[Vec3::new(0.5, 0.0, 1.0).normalize().to_array()]);
    let mut now = Deformed::default();
    scene.deform(0, &scene.state_at(0.0), &mut now);
    assert_eq!(now.colors()[0], Vec4::new(1.0, 0.5, 0.25, 1.0), "clamped to 1");
    maker.json["nodes"][0]["weights"] = json!([0.0, -0.25]);
    let (positions, _) = deformed(&maker.load(), 0, 0.0);
    assert_close(&positions[2..3], &[[0.0, 11.0, 0.0]]);
    for (pointer, list) in [("/meshes/0/weights", "meshes"), ("/nodes/0/weights", "nodes")] {
        let mut wrong = morphed(|_, _| ());
        wrong.json[list][0]["weights"] = json!([1.0]);
        let expected = format!("{pointer}: wanted a weight for each of the 2 morph targets, got 1");
        assert!(wrong.refusal().contains(&expected), "{}", wrong.refusal());
    }
}

#[test]
fn targets_may_be_sparse_and_quantised() {
    let maker = morphed(|maker, primitive| {
        // Of four vertices only number 2 moves, by (1, −1, 0) in normalised bytes.
        let (indices, values) = (maker.view(&[2, 0]), maker.view(&[127, 0x81, 0]));
        let accessor = json!({"componentType": I8, "type": "VEC3", "count": 4, "normalized": true,
            "sparse": {"count": 1, "indices": {"bufferView": indices, "componentType": U16},
                "values": {"bufferView": values}}});
        primitive["targets"][1]["POSITION"] = json!(maker.push("accessors", accessor));
    });
    let mut maker = maker;
    maker.json["nodes"][0]["weights"] = json!([0.0, 1.0]);
    let (positions, _) = deformed(&maker.load(), 0, 0.0);
    assert_close(&positions[1..3], &[[1.0, 10.0, 0.0], [2.0, 10.0, 0.0]]);
}

#[test]
fn targets_that_do_not_fit_are_refused() {
    let shorter = morphed(|maker, primitive| {
        primitive["targets"][1]["POSITION"] = json!(maker.floats("VEC3", &[0.0; 9]));
    });
    let expected = "/meshes/0/primitives/0/targets/1/POSITION: wanted as many elements as POSITION";
    assert!(shorter.refusal().contains(expected), "{}", shorter.refusal());
    let flat = morphed(|maker, primitive| {
        primitive["targets"][1]["POSITION"] = json!(maker.floats("VEC2", &[0.0; 8]));
    });
    assert!(flat.refusal().contains("wanted 3 components"), "{}", flat.refusal());
    let mut fewer = morphed(|_, _| ());
    let mut second = fewer.json["meshes"][0]["primitives"][0].clone();
    second["targets"].as_array_mut().unwrap().pop();
    fewer.json["meshes"][0]["primitives"].as_array_mut().unwrap().push(second);
    let expected = "/meshes/0/primitives/1: wanted 2 morph targets";
    assert!(fewer.refusal().contains(expected), "{}", fewer.refusal());
    let endless = morphed(|maker, primitive| {
        let accessor = json!({"componentType": F32, "type": "VEC3", "count": 1_u64 << 40});
        primitive["targets"][1]["POSITION"] = json!(maker.push("accessors", accessor));
    });
    assert!(endless.try_load().is_err());
}

#[test]
fn every_instance_that_deforms_counts_against_the_limits() {
    let mut maker = bent_arm();
    for _ in 0..100 {
        maker.push("nodes", json!({"mesh": 0, "skin": 0}));
    }
    let limits = frameless_scene::Limits { vertices: 200, ..Default::default() };
    let error = frameless_scene::load_bytes("many.glb", &maker.glb(), None, &limits).unwrap_err();
    assert!(matches!(error.problem, Problem::Limit { what: "vertices", .. }), "{error}");
}

fn animate_weights(maker: &mut Maker, interpolation: &str, times: &[f32], values: &[f32]) {
    let (input, output) = (maker.floats("SCALAR", times), maker.floats("SCALAR", values));
    maker.push(
        "animations",
        json!({"channels": [{"sampler": 0, "target": {"node": 0, "path": "weights"}}],
            "samplers": [{"input": input, "output": output, "interpolation": interpolation}]}),
    );
}

/// How far the square's third corner is lifted and shifted at `secs`.
fn lifted_and_shifted(scene: &Scene, secs: f64) -> [f32; 2] {
    let (positions, _) = deformed(scene, 0, secs);
    [positions[2].z / 2.0, (positions[2].x - 1.0) / 4.0]
}

#[test]
fn weights_are_animated_each_on_its_own() {
    let keys = [0.0, 1.0, 0.5, 0.0];
    let mut line = morphed(|_, _| ());
    animate_weights(&mut line, "LINEAR", &[0.0, 2.0], &keys);
    let scene = line.load();
    assert_eq!(scene.animation.channels[1].target, Target::MorphWeight(1));
    assert_eq!(lifted_and_shifted(&scene, 1.0), [0.25, 0.5]);
    let mut step = morphed(|_, _| ());
    animate_weights(&mut step, "STEP", &[0.0, 2.0], &keys);
    assert_eq!(lifted_and_shifted(&step.load(), 1.5), [0.0, 1.0]);
    assert_eq!(step.load().animation.channels[0].interpolation, Interpolation::Step);
}

/// Appendix C, half way, t_d = 2: (v₀ + v₁)/2 + t_d (b₀ − a₁)/8. Per key: both in-tangents, both values, both out-tangents.
#[test]
fn weights_follow_splines() {
    let first = [[9.0, 9.0], [0.0, 1.0], [0.5, -0.25]].concat();
    let second = [[1.0, 0.25], [0.5, 0.0], [9.0, 9.0]].concat();
    let mut maker = morphed(|_, _| ());
    animate_weights(&mut maker, "CUBICSPLINE", &[0.0, 2.0], &[first, second].concat());
    let scene = maker.load();
    let expected = [0.25 + 2.0 * (0.5 - 1.0) / 8.0, 0.5 + 2.0 * (-0.25 - 0.25) / 8.0];
    assert_eq!(lifted_and_shifted(&scene, 1.0), expected);
}

#[test]
fn weights_that_do_not_match_the_keys_are_refused() {
    for (interpolation, values) in [("LINEAR", 3), ("STEP", 5), ("CUBICSPLINE", 4)] {
        let mut maker = morphed(|_, _| ());
        animate_weights(&mut maker, interpolation, &[0.0, 2.0], &vec![0.0; values]);
        let refusal = maker.refusal();
        assert!(refusal.contains("/animations/0/channels/0/sampler: wanted"), "{refusal}");
    }
    let mut maker = morphed(|_, _| ());
    let values = [0.0, 0.0, f32::NAN, 1.0, 1.0, 1.0];
    animate_weights(&mut maker, "LINEAR", &[0.0, 1.0, 2.0], &values);
    let scene = maker.load();
    assert_eq!(scene.animation.channels[0].times, [0.0, 2.0], "without the key that is none");
    assert_eq!(scene.animation.channels[1].times, [0.0, 1.0, 2.0]);
}

#[test]
fn morphing_comes_before_skinning() {
    let mut maker = bent_arm();
    let swell = maker.floats("VEC3", &[0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0]);
    maker.json["meshes"][0]["primitives"][0]["targets"] = json!([{"POSITION": swell}]);
    maker.json["meshes"][0]["weights"] = json!([0.5]);
    // The end is at x = 2.5 before the elbow turns it.
    let (positions, _) = deformed(&maker.load(), 0, 0.0);
    assert_close(&positions[2..], &[[1.0, 1.5, 0.0]]);
}

#[test]
fn a_mesh_may_stand_at_many_places_of_its_node() {
    let mut maker = morphed(|_, primitive| {
        primitive.as_object_mut().unwrap().remove("targets");
    });
    let places = maker.floats("VEC3", &[0.0, 0.0, 0.0, 5.0, 0.0, 0.0, f32::NAN, 0.0, 0.0]);
    let turns = maker.floats("VEC4", &[[0.0; 4], QUARTER, QUARTER].concat());
    let sizes = maker.floats("VEC3", &[[1.0; 3], [-2.0, 2.0, 2.0], [1.0; 3]].concat());
    let attributes = json!({"TRANSLATION": places, "ROTATION": turns, "SCALE": sizes, "_ID": 0});
    maker.json["nodes"][0]["extensions"] =
        json!({"EXT_mesh_gpu_instancing": {"attributes": attributes}});
    assert!(maker.refusal().contains("/_ID: wanted as many elements"), "{}", maker.refusal());
    let extension = &mut maker.json["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"];
    extension["attributes"].as_object_mut().unwrap().remove("_ID");
    let scene = maker.load();
    assert_eq!((scene.geometries.len(), scene.instances.len()), (1, 2), "{:?}", scene.warnings);
    assert!(scene.warnings.iter().any(|w| w.contains("infinite or NaN places")));
    let world = scene.world_from_instance(1, &scene.state_at(0.0));
    // (1, 0, 0) · −2, turned to −2 y, moved by (5, 0, 0) and by the node's (0, 10, 0).
    assert_close(&[world.transform_point3(Vec3::X)], &[[5.0, 8.0, 0.0]]);
    let turn = Quat::from_array(QUARTER);
    assert!(scene.nodes[scene.instances[1].node as usize].rest.rotation.abs_diff_eq(turn, 1e-6));
    // They are instances, not nodes.
    let limited = |nodes, instances| {
        let limits = Limits { nodes, instances, ..Limits::default() };
        load_bytes("many.glb", &maker.glb(), None, &limits).map_err(|error| error.to_string())
    };
    assert!(limited(1, 3).is_ok());
    assert!(limited(1, 2).unwrap_err().contains("3 instances, more than the limit of 2"));
}

/// Of a mesh that deforms the pose counts, too: weights are compared, and a skin's own place.
#[test]
fn only_the_same_pose_in_the_same_place_is_a_twin() {
    let mut maker = morphed(|_, _| ());
    let place = maker.json["nodes"][0].clone();
    let weights = |w: f32| {
        let mut node = place.clone();
        node["weights"] = json!([w, 0]);
        node
    };
    maker.json["nodes"] = json!([weights(0.25), weights(0.5), weights(0.25), weights(0.5)]);
    maker.json.as_object_mut().unwrap().remove("animations");
    let scene = maker.load();
    assert_eq!((scene.instances.len(), scene.deformations.len()), (2, 2));
    let instances: Vec<u32> = scene.deformations.iter().map(|d| d.instance).collect();
    assert_eq!(instances, [0, 1]);
}

#[test]
fn what_morphs_or_bends_to_infinity_is_told_of() {
    let said = |maker: &Maker| {
        let warnings = maker.load().warnings;
        warnings.into_iter().find(|warning| warning.contains("infinitely far away"))
    };
    let mut maker = morphed(|_, _| ());
    maker.json["nodes"][0]["weights"] = json!([1e37, 0.0]);
    assert_eq!(said(&maker).as_deref(), Some(LOST_ALL));
    maker.json["nodes"][0]["weights"] = json!([1e3, 0.0]);
    assert_eq!(said(&maker), None);
    // The shoulder carries the arm's begin, the elbow its end, and both its middle.
    let mut maker = bent_arm();
    maker.json["nodes"][2]["scale"] = json!([1e37, 1e37, 1e37]);
    assert!(said(&maker).is_some_and(|text| text.ends_with("/nodes/0 (2 of 3)")));
}

const LOST_ALL: &str = "vertices that morph targets or joints bring infinitely far away are not drawn: /nodes/0 (4 of 4)";
