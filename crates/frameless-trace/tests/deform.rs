//! Samples of meshes that deform, by the real tracer: found again where the pose says, and pictures made of them.

use std::path::Path;
use std::sync::Arc;

use frameless::{
    Clock, Display, Engine, Pose, ReconstructionKind, Request, Rng, SamplerKind, Size, Time,
};
use frameless_scene::{
    AfterEnd, Animation, Camera, Channel, Deformation, Geometry, Influences, Instance,
    Interpolation, Limits, Material, Mesh, MorphTarget, Node, Projection, Scene, Skin, Target,
    Transform, TriangleMaterials, Values,
};
use frameless_trace::{CpuTracer, Settings, ViewSource, World, render, thread_pool};
use glam::{Affine3A, Quat, Vec3, Vec4};

const SIZE: Size = Size { width: 96, height: 72 };

fn node(x: f32, y: f32, z: f32) -> Node {
    let rest = Transform { translation: Vec3::new(x, y, z), ..Transform::IDENTITY };
    Node { name: String::new(), parent: None, rest }
}

/// A patterned sheet whose right half is bent by a joint and which bulges, until 0.5 s; a camera before it, ambient light.
fn bending_sheet() -> Scene {
    const SIDE: u32 = 24;
    let mut mesh = Mesh::default();
    let (mut joints, mut weights, mut bulge) = (Vec::new(), Vec::new(), Vec::new());
    for k in 0..(SIDE + 1) * (SIDE + 1) {
        let [x, y] = [k % (SIDE + 1), k / (SIDE + 1)].map(|i| 3.0 * i as f32 / SIDE as f32 - 1.5);
        mesh.positions.push(Vec3::new(x, y, 0.0));
        let pattern = 0.5 + 0.3 * (8.0 * x).sin() * (7.0 * y).cos();
        mesh.colors.push(Vec4::new(pattern, 0.4, 1.0 - pattern, 1.0));
        let turned = (0.5 + x).clamp(0.0, 1.0);
        joints.push([0, 1, 0, 0]);
        weights.push([1.0 - turned, turned, 0.0, 0.0]);
        bulge.push(Vec3::new(0.0, 0.0, 0.3 * (x * x + y * y - 2.0)));
    }
    for (x, y) in (0..SIDE * SIDE).map(|k| (k % SIDE, k / SIDE)) {
        let a = y * (SIDE + 1) + x;
        mesh.triangles.extend([[a, a + 1, a + SIDE + 1], [a + 1, a + SIDE + 2, a + SIDE + 1]]);
    }
    mesh.triangle_materials = TriangleMaterials::all(0, mesh.triangles.len());
    mesh.influences = vec![Influences { joints, weights }];
    mesh.targets = vec![MorphTarget { positions: bulge, ..MorphTarget::default() }];
    let channel = |target, values| Channel {
        target,
        times: vec![0.0, 0.5],
        values,
        interpolation: Interpolation::Linear,
    };
    let turn = Values::Quat(vec![Quat::IDENTITY, Quat::from_rotation_y(0.9)]);
    let swell = Values::Scalar(vec![0.0, 1.0]);
    Scene {
        geometries: vec![Geometry::Mesh(mesh)],
        materials: vec![Material::default()],
        nodes: vec![node(0.0, 0.0, 5.0), node(0.0, 0.0, 0.0), node(0.0, 0.0, 0.0)],
        instances: vec![Instance { node: 1, geometry: 0 }],
        skins: vec![Skin {
            name: String::new(),
            joints: vec![1, 2],
            inverse_bind: vec![Affine3A::IDENTITY; 2],
        }],
        deformations: vec![Deformation { instance: 0, skin: Some(0), weights: 0..1 }],
        morph_weights: vec![0.0],
        cameras: vec![Camera {
            name: String::new(),
            node: 0,
            projection: Projection::Perspective { yfov_rad: 0.8 },
        }],
        ambient: Vec3::ONE,
        sky: [Vec3::splat(0.1); 2],
        animation: Animation {
            duration_secs: 0.5,
            after_end: AfterEnd::Hold,
            channels: vec![
                channel(Target::Rotation(2), turn),
                channel(Target::MorphWeight(0), swell),
            ],
        },
        ..Scene::default()
    }
}

/// The sheet above a mirror that lies on the floor.
fn mirrored_sheet() -> Scene {
    let mut scene = bending_sheet();
    let mirror = Material { metallic: 1.0, roughness: 0.0, ..Material::default() };
    scene.materials.push(mirror);
    let corners = [[-4.0, 4.0], [4.0, 4.0], [4.0, -4.0], [-4.0, -4.0]];
    scene.geometries.push(Geometry::Mesh(Mesh {
        positions: corners.map(|[x, z]| Vec3::new(x, -1.7, z)).to_vec(),
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        triangle_materials: TriangleMaterials::all(1, 2),
        ..Mesh::default()
    }));
    scene.instances.push(Instance { node: 1, geometry: 1 });
    scene.nodes[0] = node(0.0, -0.8, 5.0);
    scene
}

/// Of `tries` random samples at `then_secs`: how many hit something that deforms (itself, or its image in a mirror), and how many of those are seen again at
/// `now_secs` at the very pixel and place in the triangle; panics if one is neither seen nor covered.
fn seen_again(
    world: &World,
    in_mirror: bool,
    [then_secs, now_secs]: [f64; 2],
    tries: u32,
) -> [u32; 2] {
    let size = Size::new(512, 384);
    let [then, now] = [then_secs, now_secs].map(|secs| world.moment(secs));
    let [view_then, view_now] = [&then, &now].map(|m| world.scene().view_at(m.state(), 0));
    let mut pose = Pose::default();
    world.pose(&now, &view_now, size, &mut pose);
    let (mut rng, settings) = (Rng::new(7), Settings::default());
    let (mut hits, mut seen) = (0, 0);
    for _ in 0..tries {
        let pixel = rng.below(size.pixels() as u32);
        let offset = [rng.unit_f32() - 0.5, rng.unit_f32() - 0.5];
        let request = Request { pixel, offset, sample_index: 0 };
        let (_, before) = world.trace(&then, &view_then, size, &request, &settings);
        let is_image = before.object as usize >= world.scene().instances.len();
        let deforms = pose.deformed.get(before.object as usize).is_some_and(Option::is_some);
        if !deforms || is_image != in_mirror {
            continue;
        }
        hits += 1;
        // It may have moved out of the mirror.
        let Some(there) = pose.project(&before) else { continue };
        let [x, y] = there.px;
        if !(0.0..size.width as f32).contains(&x) || !(0.0..size.height as f32).contains(&y) {
            continue;
        }
        let offset = [x - x.floor() - 0.5, y - y.floor() - 0.5];
        let request = Request { pixel: size.index(x as u32, y as u32), offset, sample_index: 0 };
        let (_, after) = world.trace(&now, &view_now, size, &request, &settings);
        let off = (0..3).map(|k| (after.position[k] - before.position[k]).abs());
        let same = (after.object, after.primitive) == (before.object, before.primitive);
        if same && off.fold(0.0, f32::max) < 0.02 {
            seen += 1;
            continue;
        }
        let depth = pose.project(&after).map_or(f32::INFINITY, |hit| hit.depth);
        // In front of it, or beside an edge of its triangle.
        assert!(
            depth < there.depth * 1.003,
            "{before:?} should be at {there:?}, where there is {after:?} at {depth}"
        );
    }
    [hits, seen]
}

#[test]
fn samples_of_a_bending_sheet_are_found_again_at_the_right_pixel() {
    let world = World::new(Arc::new(bending_sheet()));
    for times in [[0.0, 0.0], [0.0, 0.2], [0.1, 0.35], [0.5, 0.0]] {
        let [hits, seen] = seen_again(&world, false, times, 3_000);
        assert!(
            hits > 800 && f64::from(seen) > 0.93 * f64::from(hits),
            "{times:?}: {seen} of {hits}"
        );
    }
}

#[test]
fn samples_of_a_bending_sheet_in_a_mirror_are_found_again() {
    let world = World::new(Arc::new(mirrored_sheet()));
    let [hits, seen] = seen_again(&world, true, [0.1, 0.3], 6_000);
    assert!(hits > 200 && f64::from(seen) > 0.8 * f64::from(hits), "{seen} of {hits}");
}

#[test]
fn a_mirror_that_bends_is_no_plane() {
    let mut scene = bending_sheet();
    scene.materials[0] = Material { metallic: 1.0, roughness: 0.0, ..Material::default() };
    let world = World::new(Arc::new(scene));
    let (moment, mut pose) = (world.moment(0.0), Pose::default());
    let view = world.scene().view_at(moment.state(), 0);
    world.pose(&moment, &view, SIZE, &mut pose);
    assert_eq!((pose.windows.len(), pose.picture_from_object.len()), (0, 1));
    let request = Request::centre(SIZE.index(SIZE.width / 2, SIZE.height / 2));
    let (_, surface) = world.trace(&moment, &view, SIZE, &request, &Settings::default());
    assert_eq!(surface.object, 0, "the sheet itself, not what it reflects");
}

#[test]
fn samples_of_real_models_are_found_again() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/scenes");
    if !folder.is_dir() {
        assert_ne!(std::env::var("CI").as_deref(), Ok("true"), "../shared/scenes is missing");
        eprintln!("SKIPPED: ../shared/scenes is missing");
        return;
    }
    for (file, at_least) in [
        ("skinned/Fox.glb", 0.8),
        ("skinned/CesiumMan.glb", 0.7),
        ("skinned/RiggedSimple.glb", 0.9),
        ("morph/AnimatedMorphCube.glb", 0.9),
    ] {
        let scene = frameless_scene::load(&folder.join(file), &Limits::default()).expect(file);
        let world = World::new(Arc::new(scene));
        let [hits, seen] = seen_again(&world, false, [0.5, 0.6], 8_000);
        assert!(hits > 200, "{file}: {hits}");
        assert!(f64::from(seen) > at_least * f64::from(hits), "{file}: {seen} of {hits}");
    }
}

fn play(
    world: &Arc<World>,
    kind: ReconstructionKind,
    samples_per_sec: f64,
    refreshes: u64,
) -> (Vec<[f32; 3]>, f64) {
    let view = ViewSource::Camera(0);
    let tracer = CpuTracer::new(world.clone(), view, Settings::default(), 2);
    let (clock, sampler) = (Clock::simulated(samples_per_sec), SamplerKind::ADAPTIVE.build(1));
    let mut engine = Engine::new(SIZE, clock, sampler, tracer);
    engine.set_reconstruction(kind.build());
    let (mut picture, mut time) = (Vec::new(), Time::ZERO);
    for k in 1..=refreshes {
        time = Time(k * 1_000_000_000 / 60);
        engine.run_until(time).expect("finite colours");
        picture = engine.refresh(time).to_vec();
    }
    (picture, time.secs())
}

fn ideal(world: &World, secs: f64) -> Vec<[f32; 3]> {
    let view = ViewSource::Camera(0);
    let linear = render(world, secs, &view, SIZE, &Settings::default(), &thread_pool(1));
    linear.into_iter().map(|rgb| Display::default().encode(rgb)).collect()
}

fn rmse(a: &[[f32; 3]], b: &[[f32; 3]]) -> f32 {
    let squares = a.iter().flatten().zip(b.iter().flatten()).map(|(a, b)| (a - b).powi(2));
    (squares.sum::<f32>() / (3 * a.len()) as f32).sqrt()
}

#[test]
fn a_sheet_is_followed_while_it_bends() {
    let world = Arc::new(World::new(Arc::new(bending_sheet())));
    let error = |kind| {
        let (picture, secs) = play(&world, kind, 15_000.0, 24);
        rmse(&picture, &ideal(&world, secs))
    };
    let (hold, reproject) = (error(ReconstructionKind::Hold), error(ReconstructionKind::REPROJECT));
    assert!(reproject < 0.6 * hold, "{reproject}, hold {hold}");
}

#[test]
fn a_sheet_that_has_come_to_rest_is_the_held_picture_bit_for_bit() {
    let world = Arc::new(World::new(Arc::new(bending_sheet())));
    let (picture, secs) = play(&world, ReconstructionKind::REPROJECT, 80_000.0, 30 + 60);
    let (held, _) = play(&world, ReconstructionKind::Hold, 80_000.0, 30 + 120);
    assert_eq!(picture, held);
    assert_eq!(picture, ideal(&world, secs));
}
