//! Animation and hierarchy against values worked out by hand.

use std::f32::consts::{FRAC_PI_2, FRAC_PI_4};

use frameless_scene::{
    AfterEnd, Animation, Bounds, Camera, Channel, Geometry, Instance, Interpolation, Light,
    LightKind, Material, Node, Projection, Scene, State, Target, Transform, Values, frame_bounds,
    look_at,
};
use glam::{Affine3A, Quat, Vec3};

/// A root node with a child 1 m along x, a unit sphere at the child, driven by `channels` for 10 s.
fn scene(channels: Vec<Channel>) -> Scene {
    let node = |parent, translation| Node {
        name: String::new(),
        parent,
        rest: Transform { translation, ..Transform::IDENTITY },
    };
    let scene = Scene {
        materials: vec![Material::default()],
        geometries: vec![Geometry::Sphere { material: 0 }],
        nodes: vec![node(None, Vec3::ZERO), node(Some(0), Vec3::X)],
        instances: vec![Instance { node: 1, geometry: 0 }],
        cameras: vec![Camera {
            name: String::new(),
            node: 1,
            projection: Projection::Perspective { yfov_rad: 1.0 },
        }],
        lights: vec![Light {
            node: 0,
            kind: LightKind::Point,
            intensity: Vec3::ONE,
            range: f32::INFINITY,
        }],
        animation: Animation { duration_secs: 10.0, channels, ..Animation::default() },
        ..Scene::default()
    };
    scene.check().expect("a sound scene");
    scene
}

fn translation(interpolation: Interpolation, times: &[f32], values: &[Vec3]) -> Channel {
    Channel {
        target: Target::Translation(0),
        times: times.to_vec(),
        values: Values::Vec3(values.to_vec()),
        interpolation,
    }
}

fn rotation(interpolation: Interpolation, times: &[f32], values: &[Quat]) -> Channel {
    Channel {
        target: Target::Rotation(0),
        times: times.to_vec(),
        values: Values::Quat(values.to_vec()),
        interpolation,
    }
}

fn root(scene: &Scene, secs: f64) -> Affine3A {
    scene.state_at(secs).world_from_node[0]
}

#[track_caller]
fn assert_near(actual: impl Into<Vec3>, expected: Vec3) {
    let actual = actual.into();
    assert!((actual - expected).length() < 1e-5, "{actual} instead of {expected}");
}

#[test]
fn step_keeps_the_earlier_key_until_the_next() {
    let keys = [Vec3::X, Vec3::Y, Vec3::Z];
    let scene = scene(vec![translation(Interpolation::Step, &[1.0, 1.6, 3.0], &keys)]);
    for (secs, expected) in [
        (0.0, Vec3::X),
        (1.0, Vec3::X),
        (1.599999, Vec3::X),
        (1.6, Vec3::Y),
        (2.999, Vec3::Y),
        (3.0, Vec3::Z),
        (9.9, Vec3::Z),
        (10.5, Vec3::X),
        (11.6, Vec3::Y),
        (-8.4, Vec3::Y),
    ] {
        assert_eq!(Vec3::from(root(&scene, secs).translation), expected, "at {secs} s");
    }
}

#[test]
fn linear_translation_is_held_outside_its_keys_and_repeats() {
    let keys = [Vec3::ZERO, Vec3::new(4.0, 0.0, -2.0)];
    let scene = scene(vec![translation(Interpolation::Linear, &[2.0, 4.0], &keys)]);
    for (secs, expected) in [
        (0.0, keys[0]),
        (2.0, keys[0]),
        (2.5, Vec3::new(1.0, 0.0, -0.5)),
        (4.0, keys[1]),
        (8.0, keys[1]),
        (12.5, Vec3::new(1.0, 0.0, -0.5)),
        (-7.5, Vec3::new(1.0, 0.0, -0.5)),
        // Ten years.
        (10.0 * 31_557_600.0 + 2.5, Vec3::new(1.0, 0.0, -0.5)),
    ] {
        assert_near(root(&scene, secs).translation, expected);
    }
}

#[test]
fn an_animation_that_holds_stays_at_its_end() {
    let keys = [Vec3::ZERO, Vec3::X];
    let mut scene = scene(vec![translation(Interpolation::Linear, &[0.0, 10.0], &keys)]);
    scene.animation.after_end = AfterEnd::Hold;
    assert_near(root(&scene, -3.0).translation, Vec3::ZERO);
    assert_near(root(&scene, 5.0).translation, Vec3::X * 0.5);
    assert_near(root(&scene, 13.0).translation, Vec3::X);
}

#[test]
fn without_a_duration_everything_rests() {
    let mut scene = scene(vec![translation(Interpolation::Step, &[0.0], &[Vec3::X])]);
    scene.animation.duration_secs = 0.0;
    assert_near(root(&scene, 5.0).translation, Vec3::ZERO);
}

#[test]
fn linear_rotation_turns_at_constant_speed() {
    let keys = [Quat::IDENTITY, Quat::from_rotation_z(FRAC_PI_2)];
    let scene = scene(vec![rotation(Interpolation::Linear, &[0.0, 3.0], &keys)]);
    // 30° after a third of the way; normalised linear interpolation would give 28.7°.
    let third = root(&scene, 1.0).transform_vector3(Vec3::X);
    assert_near(third, Vec3::new(0.75f32.sqrt(), 0.5, 0.0));
}

#[test]
fn linear_rotation_takes_the_shorter_arc() {
    let keys = [Quat::IDENTITY, -Quat::from_rotation_z(FRAC_PI_2)];
    let scene = scene(vec![rotation(Interpolation::Linear, &[0.0, 2.0], &keys)]);
    let half = root(&scene, 1.0).transform_vector3(Vec3::X);
    assert_near(half, Vec3::new(FRAC_PI_4.cos(), FRAC_PI_4.sin(), 0.0));
}

#[test]
fn cubic_spline_follows_its_tangents() {
    // From 0 to 8 within 2 s, leaving with 1 m/s and arriving with 3 m/s. By hand, at u = 1/4:
    // h01 = 3/16 − 2/64 = 0.15625, h10 = 1/64 − 2/16 + 1/4 = 0.140625, h11 = 1/64 − 1/16 = −0.046875
    // x = 8 · 0.15625 + 2 · (1 · 0.140625 − 3 · 0.046875) = 1.25
    let unused = Vec3::splat(99.0);
    let values = [unused, Vec3::ZERO, Vec3::X, Vec3::X * 3.0, Vec3::X * 8.0, unused];
    let scene = scene(vec![translation(Interpolation::CubicSpline, &[1.0, 3.0], &values)]);
    assert_near(root(&scene, 0.5).translation, Vec3::ZERO);
    assert_near(root(&scene, 1.0).translation, Vec3::ZERO);
    assert_near(root(&scene, 1.5).translation, Vec3::X * 1.25);
    // u = 1/2: 8/2 + 2 · (1/8 − 3/8) = 3.5
    assert_near(root(&scene, 2.0).translation, Vec3::X * 3.5);
    assert_near(root(&scene, 3.0).translation, Vec3::X * 8.0);
}

#[test]
fn cubic_spline_rotation_has_unit_length() {
    let zero = Quat::from_xyzw(0.0, 0.0, 0.0, 0.0);
    let turned = Quat::from_rotation_y(FRAC_PI_2);
    let values = [zero, Quat::IDENTITY, zero, zero, turned, zero];
    let scene = scene(vec![rotation(Interpolation::CubicSpline, &[0.0, 2.0], &values)]);
    // Without tangents, half-way is the mean of both: 45° once it is normalised.
    let half = root(&scene, 1.0);
    assert_near(half.transform_vector3(Vec3::Z), Vec3::new(FRAC_PI_4.sin(), 0.0, FRAC_PI_4.cos()));
}

#[test]
fn a_spline_through_zero_is_still_a_rotation() {
    let zero = Quat::from_xyzw(0.0, 0.0, 0.0, 0.0);
    let values = [zero, Quat::IDENTITY, zero, zero, -Quat::IDENTITY, zero];
    let scene = scene(vec![rotation(Interpolation::CubicSpline, &[0.0, 2.0], &values)]);
    assert_near(root(&scene, 1.0).transform_vector3(Vec3::X), Vec3::X);
}

#[test]
fn a_spline_between_equal_keys_stands_still_to_the_last_bit() {
    let zero = Quat::from_xyzw(0.0, 0.0, 0.0, 0.0);
    let tilted = Quat::from_euler(glam::EulerRot::XYZ, 0.3, 0.7, -1.1);
    let values = [zero, tilted, zero, zero, tilted, zero];
    let spline = scene(vec![rotation(Interpolation::CubicSpline, &[0.0, 10.0], &values)]);
    let linear = scene(vec![rotation(Interpolation::Linear, &[0.0, 10.0], &[tilted, tilted])]);
    for i in 0..100 {
        let secs = f64::from(i) * 0.0973;
        assert_eq!(root(&spline, secs), root(&spline, 0.0));
        assert_eq!(root(&linear, secs), root(&linear, 0.0));
    }
}

#[test]
fn a_parent_moves_turns_and_scales_its_child() {
    let mut scene = scene(vec![translation(Interpolation::Step, &[0.0], &[Vec3::Y * 5.0])]);
    scene.nodes[0].rest.rotation = Quat::from_rotation_z(FRAC_PI_2);
    scene.nodes[0].rest.scale = Vec3::splat(2.0);
    let state = scene.state_at(0.0);
    // The child's (1, 0, 0), doubled, turned towards +y, then lifted by 5.
    assert_near(state.world_from_node[1].translation, Vec3::new(0.0, 7.0, 0.0));
    let bounds = scene.bounds_at(&state).expect("a sphere");
    assert_near(bounds.min, Vec3::new(-2.0, 5.0, -2.0));
    assert_near(bounds.max, Vec3::new(2.0, 9.0, 2.0));
}

#[test]
fn light_intensity_is_driven() {
    let scene = scene(vec![Channel {
        target: Target::LightIntensity(0),
        times: vec![0.0, 4.0],
        values: Values::Vec3(vec![Vec3::ZERO, Vec3::new(8.0, 4.0, 0.0)]),
        interpolation: Interpolation::Linear,
    }]);
    assert_near(scene.state_at(1.0).light_intensity[0], Vec3::new(2.0, 1.0, 0.0));
}

#[test]
fn a_state_used_again_is_as_good_as_new_and_allocates_nothing() {
    let keys = [Vec3::ZERO, Vec3::X];
    let scene = scene(vec![translation(Interpolation::Linear, &[0.0, 10.0], &keys)]);
    let mut state = State::default();
    scene.update_state(3.0, &mut state);
    let memory = (state.world_from_node.as_ptr(), state.parent_from_node.as_ptr());
    scene.update_state(7.0, &mut state);
    assert_eq!(memory, (state.world_from_node.as_ptr(), state.parent_from_node.as_ptr()));
    assert_eq!(state.world_from_node, scene.state_at(7.0).world_from_node);
    assert_eq!(state.secs, 7.0);
}

#[test]
fn a_scaled_camera_node_gives_a_rigid_view() {
    let mut scene = scene(Vec::new());
    scene.nodes[0].rest.scale = Vec3::new(3.0, 0.5, 2.0);
    scene.nodes[1].rest.rotation = Quat::from_rotation_y(0.7);
    let state = scene.state_at(0.0);
    let view = scene.view_at(&state, 0).world_from_camera;
    let identity = view.matrix3.transpose() * view.matrix3;
    assert!(identity.abs_diff_eq(glam::Mat3A::IDENTITY, 1e-6), "{identity}");
    assert!(view.matrix3.determinant() > 0.999);
    assert_near(view.transform_vector3(Vec3::Y), Vec3::Y);
    let forward = Vec3::new(-3.0 * 0.7f32.sin(), 0.0, -2.0 * 0.7f32.cos()).normalize();
    assert_near(view.transform_vector3(Vec3::NEG_Z), forward);
}

#[test]
fn look_at_looks_there_even_straight_down() {
    let eye = Vec3::new(1.0, 5.0, 2.0);
    for (target, up) in
        [(Vec3::ZERO, Vec3::Y), (Vec3::new(1.0, 0.0, 2.0), Vec3::Y), (eye, Vec3::Y), (eye, Vec3::Z)]
    {
        let view = look_at(eye, target, up);
        assert_near(view.translation, eye);
        assert!((view.matrix3.determinant() - 1.0).abs() < 1e-5);
        let forward = (target - eye).normalize_or(Vec3::NEG_Z);
        assert_near(view.transform_vector3(Vec3::NEG_Z), forward);
    }
}

#[test]
fn framed_bounds_fit_the_picture() {
    let block = Bounds { min: Vec3::new(-3.0, 0.0, -1.0), max: Vec3::new(5.0, 2.0, 1.0) };
    let sign = Bounds { max: Vec3::new(5.0, 2.0, -0.5), ..block };
    for (bounds, aspect) in [(block, 0.5), (block, 1.0), (block, 2.4), (sign, 1.0)] {
        let view = frame_bounds(bounds, 0.9, aspect);
        let camera_from_world = view.world_from_camera.inverse();
        let half_y = 0.45f32.tan();
        let is_frontal = view.world_from_camera.transform_vector3(Vec3::Z) == Vec3::Z;
        assert_eq!(is_frontal, bounds == sign);
        let mut nearest_border: f32 = 0.0;
        for corner in 0..8 {
            let pick = |axis: usize| {
                let far = corner >> axis & 1 == 1;
                if far { bounds.max[axis] } else { bounds.min[axis] }
            };
            let p = camera_from_world.transform_point3(Vec3::from_array([0, 1, 2].map(pick)));
            assert!(p.z < 0.0 && (p.y / p.z).abs() <= half_y, "{p}");
            assert!((p.x / p.z).abs() <= half_y * aspect, "{p}");
            let [x, y] = [p.x / p.z / (half_y * aspect), p.y / p.z / half_y].map(f32::abs);
            nearest_border = nearest_border.max(x).max(y);
        }
        assert!(nearest_border > 0.85, "{bounds:?} fills {nearest_border} of the picture");
    }
    let point = Bounds { min: Vec3::ONE, max: Vec3::ONE };
    assert!(frame_bounds(point, 0.9, 1.0).world_from_camera.is_finite());
}

#[test]
fn check_names_what_is_broken() {
    type Damage = fn(&mut Scene);
    let damages: [(&str, Damage); 8] = [
        ("node 0", |scene| scene.nodes[0].parent = Some(1)),
        ("node 1", |scene| scene.nodes[1].rest.translation.x = f32::NAN),
        ("instance 0", |scene| scene.instances[0].geometry = 1),
        ("geometry 0", |scene| scene.geometries[0] = Geometry::Sphere { material: 1 }),
        ("channel 0", |scene| scene.animation.channels[0].times = vec![1.0, 1.0]),
        ("channel 0", |scene| scene.animation.channels[0].target = Target::Rotation(0)),
        ("at most once", |scene| {
            let twice = scene.animation.channels[0].clone();
            scene.animation.channels.push(twice);
        }),
        ("a camera", |scene| scene.cameras.clear()),
    ];
    for (expected, damage) in damages {
        let keys = [Vec3::ZERO, Vec3::X];
        let mut scene = scene(vec![translation(Interpolation::Linear, &[0.0, 1.0], &keys)]);
        damage(&mut scene);
        let error = scene.check().expect_err(expected);
        assert!(error.contains(expected), "{error}");
    }
}
