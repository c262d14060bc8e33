//! What is known of the built-in scenes without looking at them.

use frameless_scene::{BUILTIN_DESCRIPTIONS, BUILTIN_NAMES, Projection, Scene, State, builtin};
use glam::{Vec2, Vec3};

/// Rows of the picture for which the scenes were laid out.
const ROWS: f32 = 384.0;

fn named(name: &str) -> Scene {
    builtin(name).expect("one of BUILTIN_NAMES")
}

fn node(scene: &Scene, name: &str) -> usize {
    scene.nodes.iter().position(|node| node.name == name).expect("a node of that name")
}

fn position(scene: &Scene, name: &str, secs: f64) -> Vec3 {
    scene.state_at(secs).world_from_node[node(scene, name)].translation.into()
}

/// In pixels from the picture's middle, y up, and the pixels per metre at that depth.
fn project(scene: &Scene, state: &State, point: Vec3) -> (Vec2, f32) {
    let view = scene.view_at(state, 0);
    let Projection::Perspective { yfov_rad } = view.projection else { panic!("a perspective") };
    let p = view.world_from_camera.inverse().transform_point3(point);
    let px_per_metre = 0.5 * ROWS / (0.5 * yfov_rad).tan() / -p.z;
    (p.truncate() * px_per_metre, px_per_metre)
}

fn largest_difference(a: &State, b: &State) -> f32 {
    let nodes = a.world_from_node.iter().zip(&b.world_from_node).flat_map(|(a, b)| {
        let (a, b) = (a.to_cols_array(), b.to_cols_array());
        a.into_iter().zip(b).map(|(a, b)| (a - b).abs()).collect::<Vec<_>>()
    });
    let lights = a.light_intensity.iter().zip(&b.light_intensity);
    nodes.chain(lights.map(|(a, b)| (*a - *b).length())).fold(0.0, f32::max)
}

#[test]
fn every_scene_keeps_the_promises_of_scene() {
    assert!(builtin("").is_none() && builtin("Sphere").is_none());
    for (name, description) in BUILTIN_NAMES.into_iter().zip(BUILTIN_DESCRIPTIONS) {
        let scene = named(name);
        scene.check().unwrap_or_else(|why| panic!("{name}: {why}"));
        assert_eq!(scene.name, name);
        assert!(scene.animation.duration_secs >= 2.5, "{name} is scored up to 2.5 s");
        assert!(!description.contains('\n'));
        let Projection::Perspective { yfov_rad } = scene.cameras[0].projection else {
            panic!("{name}: a perspective")
        };
        assert!((yfov_rad.to_degrees() - 50.0).abs() < 1e-3);
        for i in 0..200 {
            let state = scene.state_at(f64::from(i) * 0.0371 - 1.0);
            assert!(state.world_from_node.iter().all(|matrix| matrix.is_finite()), "{name}");
        }
    }
}

#[test]
fn loops_have_no_jump_except_where_jumps_are_the_point() {
    for name in BUILTIN_NAMES.into_iter().filter(|&name| name != "sudden") {
        let scene = named(name);
        let end = scene.animation.duration_secs;
        let across = largest_difference(&scene.state_at(end - 1e-6), &scene.state_at(0.0));
        assert!(across < 1e-3, "{name} jumps by {across} at its end");
        let moved = largest_difference(&scene.state_at(0.6), &scene.state_at(0.3));
        assert!(moved > 0.01, "{name} does not move");
    }
}

#[test]
fn nothing_moves_further_in_a_millisecond_than_it_should() {
    // The fastest: movers at 4.5 m/s along the widest axis, somewhat more where all axes add up; spinning
    // things turn their unit vectors by up to 9 rad/s.
    const METRES_PER_MILLISECOND: f32 = 0.012;
    for name in BUILTIN_NAMES.into_iter().filter(|&name| name != "sudden") {
        let scene = named(name);
        let mut before = scene.state_at(0.0);
        let mut now = State::default();
        for i in 1..3000 {
            scene.update_state(f64::from(i) * 1e-3, &mut now);
            let step = largest_difference(&before, &now);
            assert!(step < METRES_PER_MILLISECOND, "{name}: {step} m at {i} ms");
            std::mem::swap(&mut before, &mut now);
        }
    }
}

#[test]
fn the_sphere_crosses_250_pixels_per_second_and_rolls_without_slipping() {
    let scene = named("sphere");
    let sphere = node(&scene, "sphere");
    let (a, b) = (scene.state_at(0.7), scene.state_at(0.8));
    let centre = |state: &State| Vec3::from(state.world_from_node[sphere].translation);
    let (a_px, px_per_metre) = project(&scene, &a, centre(&a));
    let (b_px, _) = project(&scene, &b, centre(&b));
    let speed = (b_px - a_px).length() / 0.1;
    assert!((speed - 250.0).abs() < 5.0, "{speed} px/s");
    let radius = a.world_from_node[sphere].matrix3.x_axis.length();
    assert!((radius * px_per_metre - 60.0).abs() < 2.0, "{} px", radius * px_per_metre);
    // The surface point that touches the floor at 0.7 s stands still at that moment: after a little
    // time s it has moved by only (v s)² / 2r upwards.
    let local = a.world_from_node[sphere].inverse().transform_point3(centre(&a) - Vec3::Y * radius);
    let little = scene.state_at(0.701);
    let moved = little.world_from_node[sphere].transform_point3(local);
    assert!((moved - (centre(&a) - Vec3::Y * radius)).length() < 1e-4);
}

#[test]
fn the_forty_movers_are_fast_and_inside_the_court() {
    let scene = named("many");
    let flying: Vec<usize> =
        (0..scene.nodes.len()).filter(|&i| scene.nodes[i].name.starts_with("flying")).collect();
    assert_eq!(flying.len(), 40);
    let mut fastest = vec![0.0f32; flying.len()];
    for i in 0..800 {
        let secs = f64::from(i) * 0.01;
        let (a, b) = (scene.state_at(secs), scene.state_at(secs + 0.005));
        for (speed, &node) in fastest.iter_mut().zip(&flying) {
            let at = |state: &State| Vec3::from(state.world_from_node[node].translation);
            assert!(at(&a).y > 0.2 && at(&a).z < 6.5, "{}", at(&a));
            let moved = project(&scene, &b, at(&b)).0 - project(&scene, &a, at(&a)).0;
            *speed = speed.max(moved.length() / 0.005);
        }
    }
    let of_all = fastest.iter().copied().fold(0.0, f32::max);
    assert!((300.0..900.0).contains(&of_all), "{of_all} px/s");
    assert!(fastest.iter().all(|&speed| speed > 60.0), "{fastest:?}");
}

#[test]
fn orbit_and_stopgo_move_the_camera_alone() {
    for name in ["orbit", "stopgo"] {
        let scene = named(name);
        let (a, b) = (scene.state_at(0.0), scene.state_at(1.2));
        for instance in &scene.instances {
            let node = instance.node as usize;
            assert_eq!(a.world_from_node[node], b.world_from_node[node], "{name}");
        }
        let moved = scene.view_at(&b, 0).world_from_camera.translation
            - scene.view_at(&a, 0).world_from_camera.translation;
        assert!(moved.length() > 1.0, "{name}: {moved}");
    }
}

#[test]
fn stopgo_rests_to_the_last_bit_from_0_35_to_0_7_seconds() {
    let scene = named("stopgo");
    let view = |secs: f64| scene.view_at(&scene.state_at(secs), 0);
    for step in 0..6 {
        let start = 0.7 * f64::from(step);
        let rest = view(start + 0.36);
        for secs in [0.4, 0.5, 0.6, 0.699] {
            assert_eq!(view(start + secs), rest, "step {step}, {secs} s");
        }
        assert_ne!(view(start + 0.17), rest);
        assert_ne!(view(start + 0.75), rest);
    }
}

#[test]
fn the_camera_keeps_its_distance_while_it_orbits() {
    for name in ["orbit", "stopgo", "mix"] {
        let scene = named(name);
        for i in 0..200 {
            let secs = f64::from(i) * 0.1;
            let eye = scene.view_at(&scene.state_at(secs), 0).world_from_camera.translation;
            let distance = (eye.x * eye.x + eye.z * eye.z).sqrt();
            assert!((distance - 8.8).abs() < 1e-3 && (eye.y - 2.6).abs() < 1e-3, "{name}: {eye}");
        }
    }
}

#[test]
fn sudden_changes_the_light_at_1_s_and_the_box_at_1_6_s_and_nothing_else() {
    let scene = named("sudden");
    let light = scene.lights[0].node as usize;
    let lamp = |secs| {
        let state = scene.state_at(secs);
        (state.world_from_node[light].translation, state.light_intensity[0])
    };
    assert_eq!(lamp(0.0), lamp(0.999_999));
    assert_ne!(lamp(0.999_999).0, lamp(1.0).0);
    assert_ne!(lamp(0.999_999).1, lamp(1.0).1);
    assert_eq!(lamp(1.0), lamp(3.999));
    assert_eq!(lamp(4.0), lamp(0.0));
    let cube = |secs| position(&scene, "box", secs);
    assert_eq!(cube(0.0), cube(1.599_999));
    assert!((cube(1.6) - cube(1.599_999)).length() > 3.0);
    assert_eq!(cube(1.6), cube(3.999));
    let resting = largest_difference(&scene.state_at(1.0), &scene.state_at(1.5));
    assert_eq!(resting, 0.0);
}

#[test]
fn shadow_moves_its_light_and_something_behind_the_camera() {
    let scene = named("shadow");
    assert!((position(&scene, "light", 1.0) - position(&scene, "light", 0.0)).length() > 2.0);
    for i in 0..70 {
        let state = scene.state_at(f64::from(i) * 0.1);
        let ball = &state.world_from_node[node(&scene, "behind the camera")];
        let view = scene.view_at(&state, 0).world_from_camera;
        let seen = view.inverse().transform_point3(ball.translation.into());
        let radius = ball.matrix3.x_axis.length();
        assert!(seen.z > radius, "in front of the camera: {seen}");
        assert!(ball.translation.z + radius < 12.0, "in the wall: {}", ball.translation);
    }
    let mirrors = scene.materials.iter().filter(|m| m.metallic == 1.0 && m.roughness == 0.0);
    assert_eq!(mirrors.count(), 1);
}

#[test]
fn settle_rests_to_the_last_bit_after_0_8_s() {
    let scene = named("settle");
    let moving = largest_difference(&scene.state_at(0.70), &scene.state_at(0.79));
    assert!(moving > 0.1);
    let rest = scene.state_at(0.8);
    for i in 0..184 {
        let state = scene.state_at(0.8 + f64::from(i) * 0.1);
        assert_eq!(state.world_from_node, rest.world_from_node, "at {} s", state.secs);
        assert_eq!(state.light_intensity, rest.light_intensity);
    }
}

#[test]
fn mix_moves_everything() {
    let scene = named("mix");
    let (a, b) = (scene.state_at(0.5), scene.state_at(0.9));
    let moved = |i: usize| !a.world_from_node[i].abs_diff_eq(b.world_from_node[i], 1e-3);
    for name in ["sphere", "light", "camera", "flying box", "flying ball"] {
        assert!(moved(node(&scene, name)), "{name}");
    }
    let flying = scene.nodes.iter().filter(|node| node.name.starts_with("flying"));
    assert_eq!(flying.count(), 10);
}
