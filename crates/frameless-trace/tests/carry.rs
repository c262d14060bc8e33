//! Samples of the real tracer, carried along: what `pose` says against what the tracer's own rays hit, and pictures made of it.

use std::sync::Arc;

use frameless::{
    Clock, Display, Engine, Lighting, Pose, ReconstructionKind, Request, Rng, SamplerKind, Size,
    Surface, Time,
};
use frameless_scene::{Projection, Scene, View, builtin};
use frameless_trace::{CpuTracer, Settings, ViewSource, World, render, thread_pool};
use glam::{Affine3A, Vec3};

const SIZE: Size = Size { width: 96, height: 72 };

fn world(name: &str) -> Arc<World> {
    Arc::new(World::new(Arc::new(builtin(name).expect("a built-in scene"))))
}

fn request_at(size: Size, [x, y]: [f32; 2]) -> Option<Request> {
    let inside = x >= 0.0 && y >= 0.0 && x < size.width as f32 && y < size.height as f32;
    let offset = [x - x.floor() - 0.5, y - y.floor() - 0.5];
    inside.then(|| Request { pixel: size.index(x as u32, y as u32), offset, sample_index: 0 })
}

/// How many of 2,000 random samples at `then_secs` are seen again at `now_secs`; panics if one is neither seen nor covered. `views`:
/// from where it is looked then and now; `None`: through the scene's camera.
fn seen_again(name: &str, [then_secs, now_secs]: [f64; 2], views: Option<[View; 2]>) -> u32 {
    let size = Size::new(512, 384);
    let world = world(name);
    let [then, now] = [then_secs, now_secs].map(|secs| world.moment(secs));
    let [view_then, view_now] =
        views.unwrap_or_else(|| [&then, &now].map(|m| world.scene().view_at(m.state(), 0)));
    let mut pose = Pose::default();
    world.pose(&now, &view_now, size, &mut pose);
    let mut rng = Rng::new(7);
    let mut seen = 0;
    for _ in 0..2000 {
        let pixel = rng.below(size.pixels() as u32);
        let offset = [rng.unit_f32() - 0.5, rng.unit_f32() - 0.5];
        let request = Request { pixel, offset, sample_index: 0 };
        let (_, before) = world.trace(&then, &view_then, size, &request, &Settings::default());
        let Some(there) = pose.project(&before) else { continue };
        let Some(request) = request_at(size, there.px) else { continue };
        let (_, after) = world.trace(&now, &view_now, size, &request, &Settings::default());
        let off = (0..3).map(|k| (after.position[k] - before.position[k]).abs());
        if after.object == before.object && off.fold(0.0, f32::max) < 1e-3 {
            seen += 1;
            continue;
        }
        let depth = pose.project(&after).map_or(0.0, |hit| hit.depth);
        assert!(
            depth < there.depth * (1.0 - 1e-4),
            "{name}: {before:?} should be at {there:?}, where there is {after:?} at {depth}"
        );
    }
    seen
}

#[test]
fn what_was_hit_is_hit_again_where_it_is_said_to_be() {
    // Nothing moves; a sphere rolls; spheres and boxes fly and spin; the camera goes round; all of that.
    assert!(seen_again("sphere", [0.4, 0.4], None) > 1990);
    for name in ["sphere", "many", "orbit", "mix"] {
        let seen = seen_again(name, [0.4, 0.45], None);
        assert!(seen > 1700, "{name}: {seen} of 2000");
    }
}

#[test]
fn what_was_seen_in_a_mirror_is_seen_again_where_its_image_is() {
    // Near the standing mirror, which fills most of the picture; past its edge; from behind it.
    let here = view(Vec3::new(-1.9, 1.8, 4.9), 0.4);
    for (there, least) in [
        (here, 1980),
        (view(Vec3::new(-1.7, 1.9, 4.8), 0.45), 1500),
        (view(Vec3::new(-1.0, 1.7, 4.6), 0.9), 400),
        (view(Vec3::new(-4.0, 1.8, -0.2), 0.4 + std::f32::consts::PI), 0),
    ] {
        let still = seen_again("shadow", [0.4, 0.4], Some([here, there]));
        assert!(still >= least, "{there:?}: {still} of 2000");
        let moving = seen_again("shadow", [0.4, 0.45], Some([here, there]));
        assert!(moving + 100 >= least, "{there:?}: {moving} of 2000");
    }
}

#[test]
fn what_is_seen_in_a_mirror_is_shaded_where_it_is() {
    let world = world("shadow");
    let (moment, here) = (world.moment(0.4), view(Vec3::new(-1.9, 1.8, 4.9), 0.4));
    let mut lighting = Lighting::default();
    world.lighting(&moment, &mut lighting);
    let objects = world.scene().instances.len() as u32;
    let mut images = 0;
    for pixel in 0..SIZE.pixels() as u32 {
        let request = Request::centre(pixel);
        let (_, surface) = world.trace(&moment, &here, SIZE, &request, &Settings::default());
        let Some(direct) = lighting.direct(&surface) else { continue };
        images += u32::from(surface.object >= objects);
        for (direct, want) in direct.into_iter().zip(surface.direct) {
            assert!((direct - want).abs() <= 1e-3 * want.max(0.01), "{surface:?}: {direct}");
        }
    }
    assert!(images > SIZE.pixels() as u32 / 4, "{images} pixels show something in the mirror");
}

fn view(position: Vec3, yaw_rad: f32) -> View {
    let turned = Affine3A::from_rotation_y(yaw_rad);
    View {
        world_from_camera: Affine3A::from_translation(position) * turned,
        projection: Projection::Perspective { yfov_rad: 0.9 },
    }
}

fn engine(world: &Arc<World>, view: View, samples_per_sec: f64) -> Engine<CpuTracer> {
    let tracer = CpuTracer::new(world.clone(), ViewSource::Free(view), Settings::default(), 1);
    let (clock, sampler) = (Clock::simulated(samples_per_sec), SamplerKind::ADAPTIVE.build(1));
    let mut engine = Engine::new(SIZE, clock, sampler, tracer);
    engine.set_reconstruction(ReconstructionKind::REPROJECT.build());
    engine
}

/// The picture at refresh `k`, seen from `view` since the one before.
fn play(engine: &mut Engine<CpuTracer>, k: u64, view: View) -> Vec<[f32; 3]> {
    let time = Time(k * 1_000_000_000 / 60);
    engine.tracer_mut().set_view(ViewSource::Free(view));
    engine.run_until(time).expect("finite colours");
    engine.refresh(time).to_vec()
}

fn ideal(world: &World, view: View, secs: f64) -> Vec<[f32; 3]> {
    let pool = thread_pool(1);
    let linear = render(world, secs, &ViewSource::Free(view), SIZE, &Settings::default(), &pool);
    linear.into_iter().map(|rgb| Display::default().encode(rgb)).collect()
}

fn rmse(a: &[[f32; 3]], b: &[[f32; 3]]) -> f32 {
    let squares = a.iter().flatten().zip(b.iter().flatten()).map(|(a, b)| (a - b).powi(2));
    (squares.sum::<f32>() / (3 * a.len()) as f32).sqrt()
}

#[test]
fn any_number_of_threads_makes_the_same_picture() {
    let world = world("shadow");
    let play = |threads: usize| {
        let mut engine = engine(&world, view(Vec3::new(0.0, 1.0, 6.0), 0.0), 80_000.0);
        engine.set_reconstruction(ReconstructionKind::default().build());
        engine.set_refresh_threads(threads);
        let at = |k: u64| view(Vec3::new(0.02 * k as f32, 1.0, 6.0), 0.01 * k as f32);
        let pictures = (1..=20).map(|k| play(&mut engine, k, at(k))).collect::<Vec<_>>();
        (pictures, engine.canvas().holes().to_vec())
    };
    let alone = play(1);
    assert!(alone.0[5] != alone.0[19] && !alone.1.is_empty());
    assert!(alone == play(2) && alone == play(7));
}

#[test]
fn objects_may_come_through_the_camera() {
    // Through the scene from front to back, within blocks and spheres on the way.
    let world = world("orbit");
    let at = |k: u64| view(Vec3::new(0.3, 0.8, 9.0 - 0.4 * k.min(40) as f32), 0.0);
    let mut engine = engine(&world, at(0), 80_000.0);
    let mut picture = Vec::new();
    for k in 1..=40 + 40 {
        picture = play(&mut engine, k, at(k));
        assert!(picture.iter().flatten().all(|c| (0.0..=1.0).contains(c)), "refresh {k}");
    }
    assert!(engine.canvas().holes().is_empty(), "{} wait", engine.canvas().holes().len());
    // The scene itself is at rest.
    assert_eq!(rmse(&picture, &ideal(&world, at(40), 80.0 / 60.0)), 0.0);
}

#[test]
fn a_mirror_at_rest_shows_what_it_should_after_a_flight_around_it() {
    let world = world("shadow");
    // From before the mirror to behind it, and back.
    let at = |k: u64| {
        let k = k.min(40) as f32;
        let z = 4.9 - 5.0 * (k * std::f32::consts::PI / 40.0).sin();
        view(Vec3::new(-1.6, 1.8, z), 0.5)
    };
    let mut engine = engine(&world, at(0), 80_000.0);
    for k in 1..=40 {
        play(&mut engine, k, at(k));
    }
    let (now, scene_secs) = (engine.now(), 40.0 / 60.0);
    engine.timeline_mut().seek(now, scene_secs);
    engine.timeline_mut().pause(now);
    let mut picture = Vec::new();
    for k in 41..=100 {
        picture = play(&mut engine, k, at(k));
    }
    assert_eq!(rmse(&picture, &ideal(&world, at(40), scene_secs)), 0.0);
}

#[test]
fn what_is_behind_the_camera_has_no_place_in_the_picture() {
    let world = world("orbit");
    let (moment, mut pose) = (world.moment(0.0), Pose::default());
    let (here, beyond) =
        (view(Vec3::new(0.0, 1.0, 9.0), 0.0), view(Vec3::new(0.0, 1.0, -9.0), 0.0));
    world.pose(&moment, &beyond, SIZE, &mut pose);
    for x in 0..SIZE.width {
        let request = Request::centre(SIZE.index(x, SIZE.height * 3 / 4));
        let (_, floor) = world.trace(&moment, &here, SIZE, &request, &Settings::default());
        assert_ne!(floor.object, Surface::SKY);
        assert_eq!(pose.project(&floor), None);
    }
}

#[test]
fn a_sky_without_objects_follows_the_camera() {
    let sky = [Vec3::new(0.1, 0.1, 0.3), Vec3::new(0.9, 0.5, 0.2)];
    let world = Arc::new(World::new(Arc::new(Scene { sky, ..Scene::default() })));
    let at = |k: u64| {
        let turn = 0.03 * k.min(40) as f32;
        let View { world_from_camera, projection } = view(Vec3::ZERO, turn);
        View { world_from_camera: world_from_camera * Affine3A::from_rotation_x(turn), projection }
    };
    let mut engine = engine(&world, at(0), 80_000.0);
    for k in 1..=40 + 30 {
        let picture = play(&mut engine, k, at(k));
        let error = rmse(&picture, &ideal(&world, at(k), 0.0));
        assert!(k < 10 || error < 0.01, "refresh {k}: {error}");
        assert!(k < 70 || error == 0.0, "at rest: {error}");
    }
    assert!(engine.canvas().holes().is_empty(), "{} wait", engine.canvas().holes().len());
}

#[test]
fn batches_of_one_sample_and_of_a_million() {
    let world = world("sphere");
    let size = Size::new(8, 6);
    for batch in [1, 1_000_000] {
        let tracer = CpuTracer::new(world.clone(), ViewSource::Camera(0), Settings::default(), 1);
        let clock = Clock::simulated(f64::from(batch) * f64::from(frameless::BATCHES_PER_SEC));
        let mut engine = Engine::new(size, clock, SamplerKind::ADAPTIVE.build(1), tracer);
        engine.set_reconstruction(ReconstructionKind::REPROJECT.build());
        assert_eq!(engine.step().expect("finite colours"), batch as usize);
        let picture = engine.refresh(Time::from_secs(1.0 / 60.0));
        assert!(picture.iter().flatten().all(|c| (0.0..=1.0).contains(c)));
    }
}
