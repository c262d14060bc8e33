//! Keyframe animation.

use frameless_scene::{Choice, Interpolation, Limits, Scene, Target, Values, load_chosen};
use glam::{Quat, Vec3};
use serde_json::{Value, json};

use super::maker::Maker;

/// A document with one node that is moved along `path` by the given keys.
fn moved(path: &str, interpolation: &str, times: &[f32], values: &[f32]) -> Maker {
    let mut maker = Maker::new();
    maker.push("nodes", json!({}));
    add_animation(&mut maker, path, interpolation, times, values);
    maker
}

fn add_animation(
    maker: &mut Maker,
    path: &str,
    interpolation: &str,
    times: &[f32],
    values: &[f32],
) {
    let input = maker.floats("SCALAR", times);
    let output = maker.floats(if path == "rotation" { "VEC4" } else { "VEC3" }, values);
    let animation: Value = json!({"name": "an animation",
        "channels": [{"sampler": 0, "target": {"node": 0, "path": path}}],
        "samplers": [{"input": input, "output": output, "interpolation": interpolation}]});
    maker.push("animations", animation);
}

/// Where node 0 is at `secs`.
fn place(maker: &Maker, secs: f64) -> Vec3 {
    maker.load().state_at(secs).world_from_node[0].translation.into()
}

#[test]
fn steps_and_lines_between_keys() {
    let values = [0.0, 0.0, 0.0, 4.0, 0.0, 0.0];
    let line = moved("translation", "LINEAR", &[0.0, 2.0], &values);
    assert_eq!(line.load().animation.duration_secs, 2.0);
    assert_eq!(place(&line, 0.5), Vec3::X);
    let step = moved("translation", "STEP", &[0.0, 2.0], &values);
    assert_eq!(place(&step, 1.5), Vec3::ZERO);
}

/// Appendix C: halfway between values 0 and 1 with tangents 0 is 1/2; an out-tangent of 8 adds t_d · 8 / 8.
#[test]
fn cubic_splines_have_three_values_per_key() {
    let key = |x: f32, out: f32| [[0.0; 3], [x, 0.0, 0.0], [out, 0.0, 0.0]].concat();
    let values = [key(0.0, 8.0), key(1.0, 0.0)].concat();
    let spline = moved("translation", "CUBICSPLINE", &[0.0, 2.0], &values);
    assert_eq!(place(&spline, 1.0), Vec3::X * (0.5 + 2.0 * 8.0 / 8.0));
    let scene = spline.load();
    let Values::Vec3(values) = &scene.animation.channels[0].values else { panic!("positions") };
    assert_eq!((values.len(), values[2]), (6, Vec3::X * 8.0));
}

/// Tangents keep their length; the value between them is brought to one.
#[test]
fn spline_rotations_are_normalised_but_not_their_tangents() {
    let key = [[3.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 2.0], [0.0, 5.0, 0.0, 0.0]].concat();
    let scene = moved("rotation", "CUBICSPLINE", &[1.0], &key).load();
    let Values::Quat(values) = &scene.animation.channels[0].values else { panic!("rotations") };
    let expected = [Quat::from_xyzw(3.0, 0.0, 0.0, 0.0), Quat::IDENTITY];
    assert_eq!(values[..2], expected);
    assert_eq!(values[2].y, 5.0);
}

#[test]
fn rotations_may_be_normalised_shorts() {
    let mut maker = moved("rotation", "LINEAR", &[1.0], &[0.0; 4]);
    let bytes = [0_i16, 32767, 0, 0].map(i16::to_le_bytes).concat();
    let output = maker.accessor(5122, "VEC4", 1, &bytes);
    maker.json["accessors"][output]["normalized"] = json!(true);
    maker.json["animations"][0]["samplers"][0]["output"] = json!(output);
    let scene = maker.load();
    let Values::Quat(values) = &scene.animation.channels[0].values else { panic!("rotations") };
    assert_eq!(values[..], [Quat::from_xyzw(0.0, 1.0, 0.0, 0.0)]);
}

#[test]
fn unusable_keys_are_left_out_aloud() {
    let times = [0.0, -1.0, 1.0, 1.0, 0.5, f32::NAN, 3.0, 4.0, f32::INFINITY];
    let mut values: Vec<f32> = (0..times.len()).flat_map(|key| [key as f32; 3]).collect();
    values[3 * 7] = f32::NAN;
    let scene = moved("scale", "LINEAR", &times, &values).load();
    let channel = &scene.animation.channels[0];
    assert_eq!(channel.times, [0.0, 1.0, 3.0]);
    let Values::Vec3(values) = &channel.values else { panic!("scales") };
    assert_eq!(values[..], [Vec3::ZERO, Vec3::splat(2.0), Vec3::splat(6.0)]);
    assert!(scene.warnings[0].contains("\"an animation\""), "{:?}", scene.warnings);
}

#[test]
fn values_that_do_not_match_the_keys_are_refused() {
    for (interpolation, values) in [("LINEAR", 3), ("STEP", 1), ("CUBICSPLINE", 2)] {
        let maker = moved("scale", interpolation, &[0.0, 1.0], &vec![1.0; 3 * values]);
        let refusal = maker.refusal();
        assert!(refusal.contains("/animations/0/channels/0/sampler: wanted"), "{refusal}");
    }
    let mut maker = moved("scale", "LINEAR", &[0.0], &[1.0; 3]);
    maker.json["animations"][0]["channels"][0]["target"]["path"] = json!("rotation");
    let refusal = maker.refusal();
    let expected = "/animations/0/channels/0/sampler: wanted 4 components per element (VEC4)";
    assert!(refusal.contains(expected), "{refusal}");
    assert!(refusal.contains("got VEC3 of /accessors/1"), "{refusal}");
}

#[test]
fn the_animation_that_moves_a_node_beyond_all_numbers_is_named() {
    let mut maker = moved("scale", "LINEAR", &[0.0, 1.0], &[3e38; 6]);
    maker.json["nodes"] = json!([{"children": [1]}, {"scale": [1e10, 1, 1]}]);
    let refusal = maker.refusal();
    let expected = "/nodes/1: wanted a node with a finite place in the world, got /nodes/1 infinitely large or far \
        away at time 0, as animation \"an animation\" (/animations/0) moves it";
    assert!(refusal.contains(expected), "{refusal}");
}

#[test]
fn animations_play_together_or_the_first_alone() {
    let mut maker = moved("translation", "LINEAR", &[0.0, 1.0], &[0.0; 6]);
    add_animation(&mut maker, "scale", "LINEAR", &[0.0, 3.0], &[1.0; 6]);
    let scene = maker.load();
    assert_eq!(driven(&scene), [Target::Translation(0), Target::Scale(0)]);
    assert_eq!((scene.animation.duration_secs, scene.contents.played), (3.0, vec![0, 1]));
    assert!(!scene.warnings.iter().any(|warning| warning.contains("animation")));
    add_animation(&mut maker, "translation", "LINEAR", &[0.0, 9.0], &[5.0; 6]);
    let scene = maker.load();
    assert_eq!(driven(&scene), [Target::Translation(0)], "the first and the last compete");
    assert_eq!(scene.animation.duration_secs, 1.0, "that of what is played");
    assert!(
        scene.warnings[0].contains("only animation \"an animation\" (/animations/0) is played")
    );
    assert_eq!(scene.animation.channels[0].interpolation, Interpolation::Linear);
}

fn driven(scene: &Scene) -> Vec<Target> {
    scene.animation.channels.iter().map(|channel| channel.target).collect()
}

#[test]
fn animations_may_be_chosen() {
    let mut maker = moved("translation", "LINEAR", &[0.0, 1.0], &[0.0; 6]);
    add_animation(&mut maker, "scale", "LINEAR", &[0.0, 3.0], &[1.0; 6]);
    add_animation(&mut maker, "translation", "LINEAR", &[0.0, 9.0], &[5.0; 6]);
    maker.json["animations"][2]["name"] = json!("jump");
    let path = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("animations.glb");
    std::fs::write(&path, maker.glb()).unwrap();
    let load = |text: &str| {
        let animation = text.parse().unwrap_or_default();
        load_chosen(&path, &Choice { animation, ..Choice::default() }, &Limits::default())
    };
    for (text, played, secs) in [
        ("none", vec![], 0.0),
        ("1", vec![1], 3.0),
        ("jump", vec![2], 9.0),
        ("all", vec![0, 1, 2], 3.0),
    ] {
        let scene = load(text).unwrap();
        assert_eq!(
            (scene.contents.played, scene.animation.duration_secs),
            (played, secs),
            "{text}"
        );
    }
    let all = load("all").unwrap();
    assert!(all.warnings[0].contains("earlier animation"), "{:?}", all.warnings);
    let error = load("swim").unwrap_err().to_string();
    assert!(error.contains("wanted animation \"swim\"") && error.contains("2 \"jump\""), "{error}");
}

#[test]
fn a_key_at_time_zero_alone_is_a_pose() {
    let maker = moved("translation", "LINEAR", &[0.0], &[1.0, 2.0, 3.0]);
    assert_eq!(place(&maker, 0.0), Vec3::new(1.0, 2.0, 3.0));
    assert!(maker.load().animation.channels.is_empty());
}

#[test]
fn nodes_outside_the_scene_are_not_moved() {
    let mut maker = moved("translation", "LINEAR", &[0.0, 1.0], &[0.0; 6]);
    maker.push("nodes", json!({"name": "shown"}));
    maker.push("scenes", json!({"nodes": [1]}));
    let scene = maker.load();
    assert!(scene.animation.channels.is_empty());
    assert_eq!(scene.nodes[0].name, "shown");
}

#[test]
fn weights_of_nothing_and_pointers_are_left_out_aloud() {
    for path in ["weights", "pointer"] {
        let mut maker = moved("translation", "LINEAR", &[0.0], &[0.0; 3]);
        maker.json["animations"][0]["channels"][0]["target"] = json!({"node": 0, "path": path});
        let scene = maker.load();
        assert!(scene.animation.channels.is_empty());
        assert!(scene.warnings[0].contains(path), "{:?}", scene.warnings);
    }
}
