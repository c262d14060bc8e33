//! Colours against what is known without tracing.

use std::f32::consts::PI;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use frameless::{Answer, Batch, Request, Rng, Size, Surface, Time, Tracer};
use frameless_scene::{
    AlphaMode, Animation, Channel, Filter, Geometry, Image, Interpolation, Layers, Light,
    LightKind, Limits, Material, Minify, Projection, Scene, Target, Texture, TextureRef, Transform,
    Values, View, Volume, Wrap, frame_bounds, look_at,
};
use glam::{Quat, Vec2, Vec3, Vec4};

use crate::kernel::Isa;
use crate::test_scenes::{self as scenes, CAMERA, SIZE};
use crate::{CpuTracer, Integrator, Settings, ViewSource, World, explain, render, thread_pool};

fn picture(scene: Scene) -> Vec<[f32; 3]> {
    let world = World::new(Arc::new(scene));
    render(&world, 0.0, &CAMERA, SIZE, &Settings::default(), &thread_pool(1))
}

fn colour_and_surface(scene: Scene, view: View) -> ([f32; 3], Surface) {
    let world = World::new(Arc::new(scene));
    let size = Size::new(1, 1);
    world.trace(&world.moment(0.0), &view, size, &Request::centre(0), &Settings::default())
}

/// What is seen from `eye` in the direction of `target`.
fn looking(scene: Scene, eye: Vec3, target: Vec3) -> ([f32; 3], Surface) {
    let projection = Projection::Perspective { yfov_rad: 1.0 };
    colour_and_surface(scene, View { world_from_camera: look_at(eye, target, Vec3::Z), projection })
}

fn matte_floor(albedo: f32) -> Scene {
    let mut scene = scenes::empty();
    let material = scenes::add_material(&mut scene, Vec3::splat(albedo), 0.0, 1.0);
    scenes::add(&mut scene, scenes::floor(10.0, 0.0, material), Transform::IDENTITY);
    scene
}

fn assert_near(actual: f32, expected: f32, relative: f32) {
    assert!((actual - expected).abs() <= relative * expected.abs(), "{actual} is not {expected}");
}

#[test]
fn an_empty_scene_is_sky() {
    let mut scene = scenes::empty();
    scene.sky = [Vec3::new(1.0, 0.0, 0.0), Vec3::new(0.0, 0.0, 1.0)];
    let (up, surface) = looking(scene.clone(), Vec3::ZERO, Vec3::Y);
    assert_eq!((up, surface.object), ([0.0, 0.0, 1.0], Surface::SKY));
    assert_eq!(surface.position, [0.0, 1.0, 0.0], "the sky's position is the direction");
    assert_eq!(looking(scene.clone(), Vec3::ZERO, Vec3::NEG_Y).0, [1.0, 0.0, 0.0]);
    assert_eq!(looking(scene.clone(), Vec3::ZERO, Vec3::X).0, [0.5, 0.0, 0.5]);
    assert_eq!(picture(scene).len(), SIZE.pixels());
}

#[test]
fn a_white_furnace_is_white() {
    let mut scene = Scene::clone(&scenes::mixed());
    scene.lights.clear();
    scene.ambient = Vec3::ONE;
    scene.sky = [Vec3::ONE; 2];
    for material in &mut scene.materials {
        material.base_color = glam::Vec4::ONE;
    }
    assert!(picture(scene).iter().all(|&rgb| rgb == [1.0; 3]));
}

#[test]
fn mirrors_in_a_glowing_room_are_invisible() {
    let mut scene = scenes::empty();
    let mirror = scenes::add_material(&mut scene, Vec3::ONE, 1.0, 0.0);
    scene.materials.push(Material {
        base_color: glam::Vec4::new(0.0, 0.0, 0.0, 1.0),
        emissive: Vec3::ONE,
        double_sided: true,
        ..Material::default()
    });
    let room = Transform { scale: Vec3::splat(20.0), ..Transform::IDENTITY };
    scenes::add(&mut scene, Geometry::Sphere { material: mirror }, scenes::at(1.0, 0.0, 0.0));
    scenes::add(&mut scene, scenes::triangle_sphere(8, 12, 1), room);
    assert!(picture(scene).iter().all(|&rgb| rgb == [1.0; 3]));
}

#[test]
fn a_point_light_on_a_matte_plane() {
    let albedo = 0.6;
    for (x, height) in [(0.0, 2.0), (1.5, 2.0), (-3.0, 0.5)] {
        let mut scene = matte_floor(albedo);
        scenes::add_point_light(&mut scene, Vec3::new(0.0, height, 0.0), 7.0);
        let r2 = x * x + height * height;
        let cos = height / r2.sqrt();
        let (rgb, surface) = looking(scene, Vec3::new(x, 1.0, 4.0), Vec3::new(x, 0.0, 0.0));
        assert_near(rgb[0], albedo * 7.0 * cos / (PI * r2), 1e-4);
        assert_eq!(surface.lit, u32::MAX);
        assert_eq!((surface.normal, surface.albedo), ([0.0, 1.0, 0.0], [albedo; 3]));
    }
}

#[test]
fn directional_light_and_emission_add_up() {
    let mut scene = matte_floor(0.5);
    scene.materials[0].emissive = Vec3::new(0.0, 0.25, 0.0);
    // −z turned down.
    let down = Transform { rotation: Quat::from_rotation_x(-PI / 2.0), ..Transform::IDENTITY };
    scene.nodes.push(scenes::node(down));
    let node = scene.nodes.len() as u32 - 1;
    let intensity = Vec3::splat(3.0);
    scene.lights.push(Light {
        node,
        kind: LightKind::Directional,
        intensity,
        range: f32::INFINITY,
    });
    let (rgb, _) = looking(scene, Vec3::new(0.0, 3.0, 1.0), Vec3::ZERO);
    assert_near(rgb[0], 0.5 * 3.0 / PI, 1e-5);
    assert_near(rgb[1], 0.25 + 0.5 * 3.0 / PI, 1e-5);
}

#[test]
fn what_stands_in_between_throws_a_shadow() {
    let mut scene = matte_floor(0.5);
    scenes::add_point_light(&mut scene, Vec3::new(0.0, 4.0, 0.0), 10.0);
    let ball = Transform { scale: Vec3::splat(0.5), ..scenes::at(0.0, 2.0, 0.0) };
    scenes::add(&mut scene, Geometry::Sphere { material: 0 }, ball);
    let (shadow, surface) = looking(scene.clone(), Vec3::new(0.0, 1.0, 5.0), Vec3::ZERO);
    assert_eq!((shadow, surface.lit), ([0.0; 3], !1));
    // The shadow's radius on the floor: the cone from the light that touches the ball has sin = 0.5/2.
    let radius = 4.0 * (0.25f32).asin().tan();
    for (x, is_lit) in [(0.98 * radius, false), (1.02 * radius, true)] {
        let (rgb, _) = looking(scene.clone(), Vec3::new(x, 1.0, 5.0), Vec3::new(x, 0.0, 0.0));
        assert_eq!(rgb[0] > 0.0, is_lit, "at {x}");
    }
}

#[test]
fn a_light_that_is_off_still_has_its_shadow_remembered() {
    let mut scene = matte_floor(0.5);
    scenes::add_point_light(&mut scene, Vec3::new(0.0, 4.0, 0.0), 0.0);
    scenes::add(&mut scene, Geometry::Sphere { material: 0 }, scenes::at(0.0, 2.0, 0.0));
    let (_, surface) = looking(scene, Vec3::new(0.0, 0.5, 5.0), Vec3::ZERO);
    assert_eq!(surface.lit, !1);
}

#[test]
fn both_sides_of_a_double_sided_surface_are_drawn() {
    let mut scene = matte_floor(1.0);
    scene.materials[0].double_sided = true;
    scenes::add_point_light(&mut scene, Vec3::new(0.0, -2.0, 0.0), 4.0 * PI);
    let (rgb, surface) = looking(scene, Vec3::new(0.0, -1.0, 0.1), Vec3::ZERO);
    assert_near(rgb[0], 1.0, 1e-4);
    assert_eq!(surface.normal, [0.0, -1.0, 0.0]);
}

/// As viewers do that rasterise; but light does not pass what the camera does.
#[test]
fn the_camera_passes_the_back_of_a_single_sided_surface_and_light_does_not() {
    let mut scene = matte_floor(1.0);
    scenes::add_material(&mut scene, Vec3::ONE, 0.0, 1.0);
    let ceiling = Transform { rotation: Quat::from_rotation_x(PI), ..scenes::at(0.0, 1.0, 0.0) };
    scenes::add(&mut scene, scenes::floor(1.0, 0.0, 1), ceiling);
    scenes::add_point_light(&mut scene, Vec3::new(0.0, 3.0, 0.0), 4.0 * PI);
    // From above the ceiling's back is not there; the floor below it is, in its shadow.
    let (rgb, surface) = looking(scene.clone(), Vec3::new(0.0, 4.0, 0.1), Vec3::ZERO);
    assert_eq!((rgb, surface.object), ([0.0; 3], 0));
    // Mirrored in x it has another front: that of its mirrored triangles, as glTF 2.0 §3.7.4 has it.
    let node = scene.instances[1].node as usize;
    scene.nodes[node].rest.scale = Vec3::new(1.0, -1.0, 1.0);
    let (rgb, surface) = looking(scene.clone(), Vec3::new(0.0, 4.0, 0.1), Vec3::ZERO);
    assert_eq!((rgb[0] > 0.0, surface.object), (true, 1));
    scene.nodes[node].rest.scale = Vec3::ONE;
    scene.materials[1].double_sided = true;
    let (rgb, surface) = looking(scene, Vec3::new(0.0, 4.0, 0.1), Vec3::ZERO);
    assert_eq!((rgb[0] > 0.0, surface.object), (true, 1));
}

/// The tiles of TextureSettingsTest and NegativeScaleTest: two single-sided squares face to face, the upper one seen through. So close, they
/// are one sheet; farther apart the upper one keeps the light from the lower, and so it does where it hangs before a wall at right angles.
#[test]
fn what_lies_close_behind_a_back_is_lit_as_if_nothing_were_before_it() {
    let seen = |apart: f32, is_turned: bool, integrator| {
        let mut scene = matte_floor(0.8);
        scene.sky = [Vec3::ONE; 2];
        let white = scenes::add_material(&mut scene, Vec3::splat(0.8), 0.0, 1.0);
        scene.materials[white as usize].specular = 0.0;
        scene.materials[0].specular = 0.0;
        let rotation = Quat::from_rotation_x(if is_turned { 0.6 * PI } else { PI });
        let place = Transform { rotation, ..scenes::at(0.0, apart, 0.0) };
        scenes::add(&mut scene, scenes::floor(1.0, 0.0, white), place);
        scenes::add_point_light(&mut scene, Vec3::new(0.0, 6.0, 0.0), 36.0 * PI);
        let world = World::new(Arc::new(scene));
        let world_from_camera = look_at(Vec3::new(0.0, 4.0, 0.1), Vec3::ZERO, Vec3::Z);
        let projection = Projection::Perspective { yfov_rad: 0.01 };
        let (settings, moment) =
            (Settings { integrator, ..Settings::default() }, world.moment(0.0));
        let sample = |k| {
            let view = View { world_from_camera, projection };
            let request = Request { sample_index: k, ..Request::centre(0) };
            let (rgb, surface) = world.trace(&moment, &view, Size::new(1, 1), &request, &settings);
            assert_eq!(surface.object, 0, "the floor is what is seen");
            rgb[0]
        };
        (0..1024).map(sample).sum::<f32>() / 1024.0
    };
    // Of the light 36 π / 6² · 0.8 / π, and with paths 0.8 of the sky.
    for (integrator, want) in [(Integrator::Direct, 0.8), (Integrator::Path, 1.6)] {
        assert_near(seen(0.1, false, integrator), want, 0.01);
        assert!(seen(1.0, false, integrator) < 0.7 * want);
        assert!(seen(0.1, true, integrator) < 0.7 * want);
    }
}

#[test]
fn a_mirror_shows_what_is_opposite() {
    let mut scene = matte_floor(1.0);
    scene.materials[0] = Material { metallic: 1.0, roughness: 0.0, ..Material::default() };
    scene.materials[0].base_color = glam::Vec4::new(0.5, 1.0, 1.0, 1.0);
    scene.materials.push(Material { emissive: Vec3::new(1.0, 2.0, 3.0), ..Material::default() });
    scenes::add(&mut scene, Geometry::Sphere { material: 1 }, scenes::at(4.0, 4.0, 0.0));
    scene.sky = [Vec3::ZERO, Vec3::splat(0.25)];
    // In at 45°, out at 45°, to the glowing ball, tinted.
    let (rgb, surface) = looking(scene.clone(), Vec3::new(-4.0, 4.0, 0.0), Vec3::ZERO);
    // The ball's image in the front of the only mirror: after two objects and the floor's image.
    assert_eq!((rgb, surface.object), ([0.5, 2.0, 3.0], 3));
    let (rgb, _) = looking(scene.clone(), Vec3::new(-0.01, 4.0, 0.0), Vec3::ZERO);
    assert_near(rgb[1], 0.25, 1e-3);
    let no_mirrors = Settings { max_depth: 0, ..Settings::default() };
    let world = World::new(Arc::new(scene));
    let projection = Projection::Perspective { yfov_rad: 1.0 };
    let world_from_camera = look_at(Vec3::new(-4.0, 4.0, 0.0), Vec3::ZERO, Vec3::Y);
    let view = View { world_from_camera, projection };
    let request = Request::centre(0);
    let (rgb, _) = world.trace(&world.moment(0.0), &view, Size::new(1, 1), &request, &no_mirrors);
    assert_eq!(rgb, [0.0; 3], "matte at depth 0, and there is no light");
}

#[test]
fn parallel_mirrors_end_at_max_depth() {
    let mut scene = scenes::empty();
    let mirror = scenes::add_material(&mut scene, Vec3::ONE, 1.0, 0.0);
    scenes::add(&mut scene, scenes::floor(100.0, 0.0, mirror), Transform::IDENTITY);
    scenes::add(&mut scene, scenes::floor(100.0, 2.0, mirror), Transform::IDENTITY);
    scene.ambient = Vec3::ONE;
    assert_eq!(looking(scene, Vec3::new(0.0, 1.0, 0.0), Vec3::new(0.1, 0.0, 0.0)).0, [1.0; 3]);
}

#[test]
fn no_surface_shadows_itself() {
    // Far from the origin, tiny, huge: a lit convex body must not have a dark pixel on its lit side.
    for (centre, scale) in [(0.0, 1.0), (1000.0, 1.0), (0.0, 1e-3), (500.0, 100.0), (5.0, 1e4)] {
        for sphere in [false, true] {
            let mut scene = scenes::empty();
            let white = scenes::add_material(&mut scene, Vec3::ONE, 0.0, 1.0);
            let shape = if sphere {
                Geometry::Sphere { material: white }
            } else {
                scenes::triangle_sphere(20, 30, white)
            };
            let centre = Vec3::new(centre, -centre, 0.5 * centre);
            let rest =
                Transform { translation: centre, scale: Vec3::splat(scale), ..Transform::IDENTITY };
            scenes::add(&mut scene, shape, rest);
            let eye = centre + scale * Vec3::new(0.0, 0.0, 5.0);
            // The light is the viewer: all that is seen is lit.
            scenes::add_point_light(&mut scene, eye, scale * scale);
            let world = World::new(Arc::new(scene));
            let world_from_camera = look_at(eye, centre, Vec3::Y);
            let view =
                View { world_from_camera, projection: Projection::Perspective { yfov_rad: 0.6 } };
            let settings = Settings::default();
            let size = Size::new(64, 64);
            let image =
                render(&world, 0.0, &ViewSource::Free(view), size, &settings, &thread_pool(1));
            let moment = world.moment(0.0);
            for (pixel, rgb) in image.iter().enumerate() {
                let request = Request::centre(pixel as u32);
                let (_, surface) = world.trace(&moment, &view, size, &request, &settings);
                assert!(
                    surface.object != 0 || surface.lit & 1 == 1,
                    "{centre} {scale} {pixel} {rgb:?}"
                );
            }
        }
    }
}

#[test]
fn an_animated_instance_moves() {
    let mut scene = scenes::empty();
    scene.materials.push(Material { emissive: Vec3::ONE, ..Material::default() });
    let ball = scenes::add(&mut scene, Geometry::Sphere { material: 0 }, Transform::IDENTITY);
    let node = scene.instances[ball as usize].node;
    scene.animation = Animation {
        duration_secs: 2.0,
        channels: vec![Channel {
            target: Target::Translation(node),
            times: vec![0.0, 2.0],
            values: Values::Vec3(vec![Vec3::X * -2.0, Vec3::X * 2.0]),
            interpolation: Interpolation::Linear,
        }],
        ..Animation::default()
    };
    let world = World::new(Arc::new(scene));
    let pool = thread_pool(1);
    let at = |secs| render(&world, secs, &CAMERA, SIZE, &Settings::default(), &pool);
    let column = |image: &[[f32; 3]]| {
        let lit: Vec<f32> =
            (0..image.len()).filter(|&p| image[p][0] > 0.0).map(|p| (p % 32) as f32).collect();
        lit.iter().sum::<f32>() / lit.len() as f32
    };
    assert!(column(&at(0.1)) < 14.0 && column(&at(1.9)) > 17.0);
    // A moment used again shows the same as a new one.
    let mut moment = world.moment(0.1);
    world.update_moment(1.9, &mut moment);
    let view = CAMERA.at(world.scene(), moment.state());
    for (pixel, &expected) in at(1.9).iter().enumerate() {
        let request = Request::centre(pixel as u32);
        assert_eq!(world.trace(&moment, &view, SIZE, &request, &Settings::default()).0, expected);
    }
}

#[test]
fn degenerate_transforms_hide_an_instance_and_hurt_nobody() {
    for scale in [Vec3::ZERO, Vec3::new(1.0, 0.0, 1.0), Vec3::splat(1e-30), Vec3::splat(1e30)] {
        let mut scene = Scene::clone(&scenes::mixed());
        let count = scene.nodes.len();
        for node in &mut scene.nodes[2..count - 2] {
            node.rest.scale = scale;
        }
        assert!(picture(scene).iter().flatten().all(|c| c.is_finite() && *c >= 0.0));
    }
}

fn answers(world: &Arc<World>, threads: usize) -> Vec<Answer> {
    let mut tracer = CpuTracer::new(world.clone(), CAMERA, Settings::default(), threads);
    let mut rng = Rng::new(3);
    for id in 0..20 {
        let requests = (0..777)
            .map(|_| Request {
                pixel: rng.below(SIZE.pixels() as u32),
                offset: [rng.unit_f32() - 0.5; 2],
                sample_index: 0,
            })
            .collect();
        let (now, scene_secs) = (Time(id), id as f64 * 0.01);
        tracer.submit(Batch { id, now, scene_secs, size: SIZE, requests });
    }
    std::iter::from_fn(|| tracer.collect(true)).collect()
}

#[test]
fn any_number_of_threads_gives_the_same_answers_in_order() {
    let world = Arc::new(World::new(scenes::mixed()));
    let one = answers(&world, 1);
    assert_eq!(
        one.iter().map(|answer| answer.batch).collect::<Vec<_>>(),
        (0..20).collect::<Vec<_>>()
    );
    for threads in [2, 3] {
        assert_eq!(one, answers(&world, threads));
    }
    let portable = Arc::new(World::with_isa(scenes::mixed(), Isa::Portable));
    assert_eq!(one, answers(&portable, 1));
    // And the same as one by one.
    let moment = world.moment(one[5].scene_secs);
    let view = CAMERA.at(world.scene(), moment.state());
    for (k, request) in one[5].requests.iter().enumerate() {
        let sample = world.trace(&moment, &view, SIZE, request, &Settings::default());
        assert_eq!(sample, (one[5].rgb[k], one[5].surfaces[k]));
    }
    // Paths as well.
    let (there, path) = (
        portable.moment(one[5].scene_secs),
        Settings { integrator: Integrator::Path, ..Settings::default() },
    );
    for request in &one[5].requests {
        let fast = world.trace(&moment, &view, SIZE, request, &path);
        assert_eq!(fast, portable.trace(&there, &view, SIZE, request, &path));
    }
}

/// Glass that absorbs, what blends and what is masked, single-sided walls seen from behind, mirrors, and something that moves before all of it.
fn with_holes() -> Scene {
    let mut scene = Scene::clone(&scenes::mixed());
    let cut = {
        scene.images.push(Image {
            width: 4,
            height: 4,
            rgba: (0..16).map(|k| [200, 255, 90, if k % 3 == 0 { 0 } else { 160 }]).collect(),
        });
        let (wrap, filter) = ([Wrap::Repeat; 2], Filter::Linear);
        scene.textures.push(Texture { image: 0, wrap, filter, minify: Minify::default() });
        Some(TextureRef::plain(scene.textures.len() as u32 - 1))
    };
    let mut layers = Layers { transmission: 0.9, ..Layers::default() };
    layers.volume = Some(Volume::attenuating(Vec3::new(0.5, 0.9, 0.7), 1.0));
    let glass = Material { layers: Some(Box::new(layers)), ..Material::default() };
    let veil = Material { base_color: Vec4::new(0.9, 0.4, 0.2, 0.5), ..Material::default() };
    let materials = [
        glass,
        Material { alpha_mode: AlphaMode::Blend, double_sided: true, ..veil.clone() },
        Material { alpha_mode: AlphaMode::Blend, base_color_texture: cut, ..veil.clone() },
        Material { alpha_mode: AlphaMode::Mask { cutoff: 0.4 }, base_color_texture: cut, ..veil },
    ];
    for (k, material) in (0..).zip(materials) {
        scene.materials.push(material);
        let number = scene.materials.len() as u32 - 1;
        let x = 1.3 * (k as f32 - 1.5);
        let turned = Transform {
            translation: Vec3::new(x, 0.3, 2.0),
            rotation: Quat::from_rotation_x(1.2 + 0.4 * k as f32),
            scale: Vec3::splat(0.7),
        };
        let geometry = match k {
            0 => scenes::triangle_sphere(10, 14, number),
            _ => scenes::floor(1.0, 0.0, number),
        };
        let Geometry::Mesh(mut mesh) = geometry else { unreachable!("both are meshes") };
        mesh.uvs[0] = mesh.positions.iter().map(|p| Vec2::new(p.x, p.z) * 2.0).collect();
        scenes::add(&mut scene, Geometry::Mesh(mesh), turned);
    }
    let ball = scenes::triangle_sphere(8, 9, 1);
    let mover = scenes::add(&mut scene, ball, scenes::at(-1.0, 0.5, 1.0));
    scene.animation = Animation {
        duration_secs: 2.0,
        channels: vec![Channel {
            target: Target::Translation(scene.instances[mover as usize].node),
            times: vec![0.0, 2.0],
            values: Values::Vec3(vec![Vec3::new(-2.0, 0.5, 1.0), Vec3::new(2.0, 0.5, 1.0)]),
            interpolation: Interpolation::Linear,
        }],
        ..Animation::default()
    };
    scene.check().unwrap();
    scene
}

/// Whether neighbours are traced together or each of them alone is seen in nothing but time.
#[test]
fn samples_in_groups_are_what_each_is_alone() {
    let mut subjects: Vec<(String, Scene)> =
        vec![("mixed".into(), Scene::clone(&scenes::mixed())), ("holes".into(), with_holes())];
    for name in ["orbit", "shadow", "mix"] {
        subjects.push((name.into(), frameless_scene::builtin(name).expect("it is built in")));
    }
    if let Some(folder) = shared_scenes() {
        let path = folder.join("architecture/DreamApartment.glb");
        let apartment = frameless_scene::load(&path, &Limits::default()).expect("it can be read");
        subjects.push(("apartment".into(), apartment));
    }
    let size = Size::new(150, 110);
    let mut rng = Rng::new(21);
    for (name, scene) in subjects {
        let scene = Arc::new(scene);
        let world = World::with_isa(scene.clone(), Isa::detect());
        let portable = World::with_isa(scene, Isa::Portable);
        for (secs, integrator) in [(0.3, Integrator::Direct), (1.1, Integrator::Path)] {
            let moment = world.moment(secs);
            let view = CAMERA.at(world.scene(), moment.state());
            let settings = Settings { integrator, ..Settings::default() };
            // A part of the picture, dense, across the borders of tiles; and some from everywhere.
            let count = if integrator == Integrator::Path { 1000 } else { 4000 };
            let request = |k: u32| {
                let near = size.index(20 + rng.below(40), 10 + rng.below(30));
                let pixel = if k.is_multiple_of(4) { rng.below(150 * 110) } else { near };
                Request::in_sequence(pixel, rng.below(9))
            };
            let requests: Vec<Request> = (0..count).map(request).collect();
            let (rgb, surfaces) = world.trace_all(&moment, &view, size, &requests, &settings);
            for (k, request) in requests.iter().enumerate() {
                let alone = world.trace(&moment, &view, size, request, &settings);
                assert_eq!(alone, (rgb[k], surfaces[k]), "{name}: {request:?}");
            }
            let there = portable.moment(secs);
            let same = portable.trace_all(&there, &view, size, &requests, &settings);
            assert!(same == (rgb, surfaces), "{name}: portable code gives something else");
        }
    }
}

/// A tracer of a sky that is white above and black below, seen from inside, and a batch of one pixel of it.
fn sky_tracer() -> (CpuTracer, impl Fn(u64) -> Batch, impl Fn(Vec3) -> ViewSource) {
    let mut scene = scenes::empty();
    scene.sky = [Vec3::ZERO, Vec3::ONE];
    let world = Arc::new(World::new(Arc::new(scene)));
    let projection = Projection::Perspective { yfov_rad: 0.1 };
    let towards = move |target| {
        ViewSource::Free(View {
            world_from_camera: look_at(Vec3::ZERO, target, Vec3::Z),
            projection,
        })
    };
    let settings = Settings { surfaces: false, ..Settings::default() };
    let tracer = CpuTracer::new(world, towards(Vec3::Y), settings, 1);
    let batch = |id| Batch {
        id,
        now: Time::ZERO,
        scene_secs: 0.0,
        size: Size::new(1, 1),
        requests: vec![Request::centre(0)],
    };
    (tracer, batch, towards)
}

#[test]
fn a_batch_is_seen_from_where_the_camera_is_when_its_tracing_begins() {
    let (mut tracer, batch, towards) = sky_tracer();
    tracer.submit(batch(0));
    let first = tracer.collect(true).unwrap();
    // Nobody traces before somebody waits.
    (1..3).for_each(|id| tracer.submit(batch(id)));
    tracer.set_view(towards(Vec3::NEG_Y));
    let second = tracer.collect(true).unwrap();
    tracer.viewpoint().set(towards(Vec3::Y));
    tracer.submit(batch(3));
    // The third may have been traced while the second was waited for.
    let _third = tracer.collect(true).unwrap();
    let last = tracer.collect(true).unwrap();
    assert_eq!([first.rgb[0], second.rgb[0], last.rgb[0]], [[1.0; 3], [0.0; 3], [1.0; 3]]);
    assert!(first.surfaces.is_empty());
    assert_eq!(tracer.collect(true), None);
}

#[test]
fn an_explanation_adds_up_to_the_colour() {
    let world = World::new(scenes::mixed());
    for integrator in Integrator::ALL {
        let settings = Settings { integrator, ..Settings::default() };
        let mut longest = 0;
        for pixel in 0..SIZE.pixels() as u32 {
            let request = Request::in_sequence(pixel, 3);
            let lines = explain(&world, 0.0, &CAMERA, SIZE, &request, &settings);
            let moment = world.moment(0.0);
            let view = CAMERA.at(world.scene(), moment.state());
            let (rgb, _) = world.trace(&moment, &view, SIZE, &request, &settings);
            assert!(lines.last().unwrap().contains(&format!("{rgb:?}")), "{lines:#?}");
            let sum: Vec3 = lines.iter().filter_map(|line| added(line)).sum();
            // Printed with six digits after the point, at most six terms.
            assert!((sum - Vec3::from(rgb)).abs().max_element() < 6e-6, "{sum} {lines:#?}");
            longest = longest.max(lines.len());
        }
        assert!(longest > 20, "mirrors have something to tell: {longest} lines");
    }
}

/// What a line of an explanation says that it adds: `… adds [r, g, b]`.
fn added(line: &str) -> Option<Vec3> {
    let list = line.split_once(": adds [")?.1.strip_suffix(']')?;
    let channels: Vec<f32> = list.split(", ").map(|n| n.parse().unwrap()).collect();
    Some(Vec3::new(channels[0], channels[1], channels[2]))
}

fn shared_scenes() -> Option<PathBuf> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/scenes");
    if path.is_dir() {
        return Some(path);
    }
    assert!(std::env::var("CI").as_deref() != Ok("true"), "CI needs ../shared");
    eprintln!("SKIPPED: ../shared is missing, real files were not traced");
    None
}

fn gltf_files(folder: &Path, files: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).unwrap().flatten() {
        let path = entry.path();
        if path.is_dir() {
            gltf_files(&path, files);
        } else if path.extension().is_some_and(|e| e == "gltf" || e == "glb") {
            files.push(path);
        }
    }
}

#[test]
fn real_files_give_numbers_and_something_to_see() {
    let Some(folder) = shared_scenes() else { return };
    let mut files = Vec::new();
    gltf_files(&folder, &mut files);
    let pool = thread_pool(0);
    let mut traced = 0;
    for file in files {
        let Ok(scene) = frameless_scene::load(&file, &Limits::default()) else { continue };
        let world = World::new(Arc::new(scene));
        for secs in [0.0, 0.37] {
            let image = render(&world, secs, &CAMERA, SIZE, &Settings::default(), &pool);
            let bad = image.iter().flatten().find(|c| !c.is_finite() || **c < 0.0);
            assert_eq!(bad, None, "{}", file.display());
        }
        let moment = world.moment(0.0);
        if let Some(bounds) = world.scene().bounds_at(moment.state()) {
            let view = frame_bounds(bounds, 0.8, 4.0 / 3.0);
            let hit = (0..SIZE.pixels() as u32).any(|pixel| {
                let request = Request::centre(pixel);
                let (_, surface) =
                    world.trace(&moment, &view, SIZE, &request, &Settings::default());
                surface.object != Surface::SKY
            });
            assert!(hit, "{}: nothing to be seen", file.display());
        }
        traced += 1;
    }
    assert!(traced > 20, "only {traced} files");
}
