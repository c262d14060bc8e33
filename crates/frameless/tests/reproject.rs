//! The adaptive sampler and its reconstructions, on a world whose picture is known in closed form.
//!
//! A textured plane (object 0) without any red, and before it a red disc (object 1), seen by a camera that moves in the plane: so
//! every pixel's ideal colour is a formula, and a mixture of the two objects shows at once.

use frameless::{
    Answer, Batch, Canvas, Clock, Engine, Pose, Projection, ReconstructionKind, ReprojectOptions,
    Request, SamplerKind, Size, Surface, Time, Tracer,
};

const SIZE: Size = Size { width: 96, height: 72 };

/// Picture from plane at a time: column = a·x + b·y + c, row = d·x + e·y + f.
type Camera = fn(f64) -> [[f32; 3]; 2];

#[derive(Clone, Copy)]
struct World {
    camera: Camera,
    /// Middle and radius of the disc on the plane.
    disc: fn(f64) -> [f32; 3],
    /// Whether surfaces are told.
    surfaces: fn(u32) -> bool,
}

const STILL: Camera = |_| [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
const NO_DISC: fn(f64) -> [f32; 3] = |_| [0.0, 0.0, -1.0];

fn translating(secs: f64) -> [[f32; 3]; 2] {
    let secs = secs as f32;
    [[1.0, 0.0, 40.0 * secs], [0.0, 1.0, -25.0 * secs]]
}

fn rotating(secs: f64) -> [[f32; 3]; 2] {
    let (sin, cos) = (secs as f32).sin_cos();
    let (x, y) = (48.0, 36.0);
    [[cos, -sin, x - cos * x + sin * y], [sin, cos, y - sin * x - cos * y]]
}

fn zooming(secs: f64) -> [[f32; 3]; 2] {
    let scale = 1.0 + 0.8 * secs as f32;
    [[scale, 0.0, 48.0 * (1.0 - scale)], [0.0, scale, 36.0 * (1.0 - scale)]]
}

impl World {
    fn plane_from_picture(&self, secs: f64, [column, row]: [f32; 2]) -> [f32; 2] {
        let [[a, b, c], [d, e, f]] = (self.camera)(secs);
        let (column, row, det) = (column - c, row - f, a * e - b * d);
        [(e * column - b * row) / det, (a * row - d * column) / det]
    }

    fn trace(&self, secs: f64, request: &Request) -> ([f32; 3], Surface) {
        let [x, y] = self.plane_from_picture(secs, request.position_px(SIZE));
        let [cx, cy, radius] = (self.disc)(secs);
        let (dx, dy) = (x - cx, y - cy);
        let is_disc = radius > 0.0 && dx * dx + dy * dy < radius * radius;
        let (object, position, rgb) = if is_disc {
            (1, [dx, dy, 0.0], [0.8, 0.0, 0.0])
        } else {
            let texture = 0.3 + 0.2 * (0.35 * x).sin() * (0.3 * y).cos();
            (0, [x, y, 0.0], [0.0, texture, 0.5 * texture])
        };
        let normal = [0.0, 0.0, 1.0];
        (
            rgb,
            Surface {
                object,
                primitive: 0,
                position,
                normal,
                albedo: rgb,
                direct: [0.0; 3],
                lit: 1,
            },
        )
    }

    fn pose(&self, secs: f64) -> Pose {
        let [[a, b, c], [d, e, f]] = (self.camera)(secs);
        let [x, y, _] = (self.disc)(secs);
        let plane = |depth: f32, [x, y]: [f32; 2]| {
            Projection([
                [a, b, 0.0, a * x + b * y + c],
                [d, e, 0.0, d * x + e * y + f],
                [0.0, 0.0, 0.0, depth],
                [0.0, 0.0, 0.0, 1.0],
            ])
        };
        let picture_from_object = vec![plane(10.0, [0.0; 2]), plane(5.0, [x, y])];
        Pose { picture_from_object, ..Pose::default() }
    }

    fn ideal(&self, secs: f64) -> Vec<[f32; 3]> {
        let display = frameless::Display::default();
        let pixels = 0..SIZE.pixels() as u32;
        pixels.map(|p| display.encode(self.trace(secs, &Request::centre(p)).0)).collect()
    }
}

struct Renderer {
    world: World,
    answers: Vec<Answer>,
}

impl Tracer for Renderer {
    fn submit(&mut self, batch: Batch) {
        let (rgb, surfaces): (Vec<_>, Vec<_>) =
            batch.requests.iter().map(|r| self.world.trace(batch.scene_secs, r)).unzip();
        let tells = (self.world.surfaces)(batch.id as u32);
        self.answers.push(Answer::to(batch, rgb, if tells { surfaces } else { Vec::new() }));
    }

    fn collect(&mut self, _wait: bool) -> Option<Answer> {
        self.answers.pop()
    }

    fn pose(&mut self, scene_secs: f64, _size: Size, pose: &mut Pose) -> bool {
        *pose = self.world.pose(scene_secs);
        true
    }
}

fn world(camera: Camera, disc: fn(f64) -> [f32; 3]) -> World {
    World { camera, disc, surfaces: |_| true }
}

fn engine(world: World, kind: ReconstructionKind, samples_per_sec: f64) -> Engine<Renderer> {
    let renderer = Renderer { world, answers: Vec::new() };
    let sampler = SamplerKind::ADAPTIVE.build(1);
    let clock = Clock::simulated(samples_per_sec);
    let mut engine = Engine::with_canvas(Canvas::new(SIZE), clock, sampler, renderer);
    engine.set_reconstruction(kind.build());
    engine
}

/// Runs for so many refreshes of 1/60 s; the last picture and its time.
fn play(engine: &mut Engine<Renderer>, refreshes: u64) -> (Vec<[f32; 3]>, f64) {
    let first = (engine.now().0 * 60).div_ceil(1_000_000_000);
    let mut picture = Vec::new();
    let mut time = Time::ZERO;
    for k in first..first + refreshes {
        time = Time((k + 1) * 1_000_000_000 / 60);
        engine.run_until(time).expect("finite colours");
        picture = engine.refresh(time).to_vec();
    }
    (picture, time.secs())
}

fn rmse(a: &[[f32; 3]], b: &[[f32; 3]]) -> f32 {
    let sum: f32 = a.iter().flatten().zip(b.iter().flatten()).map(|(a, b)| (a - b).powi(2)).sum();
    (sum / (3 * a.len()) as f32).sqrt()
}

/// How many pixels differ, and by how much at most.
fn differences(a: &[[f32; 3]], b: &[[f32; 3]]) -> (usize, f32) {
    let off =
        |(a, b): (&[f32; 3], &[f32; 3])| (0..3).map(|k| (a[k] - b[k]).abs()).fold(0.0, f32::max);
    let offs = a.iter().zip(b).map(off);
    (offs.clone().filter(|off| *off > 0.0).count(), offs.fold(0.0, f32::max))
}

const KINDS: [ReconstructionKind; 4] =
    [ReconstructionKind::Hold, ReconstructionKind::Filter, ReconstructionKind::REPROJECT, DEEP];

const DEEP: ReconstructionKind = ReconstructionKind::Reproject(ReprojectOptions {
    deep: true,
    relight: false,
    antialias: false,
});

#[test]
fn samples_follow_a_camera_that_translates_turns_and_zooms() {
    for camera in [translating, rotating, zooming] {
        let world = world(camera, NO_DISC);
        // A fifth of the pixels per refresh.
        let error = |kind| {
            let (picture, secs) = play(&mut engine(world, kind, 83_000.0), 40);
            rmse(&picture, &world.ideal(secs))
        };
        let [hold, filter, reproject, deep] = KINDS.map(error);
        assert!(filter < hold, "{filter} {hold}");
        assert!(reproject < 0.5 * hold, "{reproject} {hold}");
        assert!(deep < 0.5 * hold, "{deep} {hold}");
    }
}

#[test]
fn no_sample_of_one_object_is_gathered_for_another() {
    let disc = |secs: f64| [20.0 + 60.0 * secs as f32, 36.0, 14.0];
    for kind in [ReconstructionKind::REPROJECT, DEEP] {
        let mut engine = engine(world(rotating, disc), kind, 60_000.0);
        play(&mut engine, 10);
        let red = frameless::Display::default().encode([0.8, 0.0, 0.0])[0];
        for _ in 0..30 {
            let (picture, secs) = play(&mut engine, 1);
            for (pixel, rgb) in picture.iter().enumerate() {
                let is_disc = (rgb[0] - red).abs() < 1e-5 && rgb[1] < 1e-5 && rgb[2] < 1e-5;
                assert!(is_disc || rgb[0] == 0.0, "pixel {pixel} at {secs} s is mixed: {rgb:?}");
            }
        }
    }
}

#[test]
fn a_picture_at_rest_is_the_held_one_bit_for_bit_also_after_motion() {
    let stopping: Camera = |secs| rotating(secs.min(0.4));
    let disc = |secs: f64| [20.0 + 60.0 * secs.min(0.4) as f32, 36.0, 14.0];
    for kind in KINDS {
        let world = world(stopping, disc);
        let mut engine = engine(world, kind, 83_000.0);
        let (picture, secs) = play(&mut engine, 24 + 40);
        assert_eq!(differences(&picture, &world.ideal(secs)), (0, 0.0), "{kind:?}");
        let again = engine.refresh(Time::from_secs(secs));
        assert_eq!(differences(&picture, again), (0, 0.0), "{kind:?}");
    }
}

#[test]
fn no_pixel_grows_older_than_its_share_of_the_even_part_allows() {
    let disc = |secs: f64| [48.0 + 30.0 * (5.0 * secs).sin() as f32, 36.0, 10.0];
    // Of every batch holes take at most 40 %, fronts 60 % of the rest, and the even part is a fifth of what is left.
    let (rate, least_share) = (83_000.0, 0.6 * 0.4 * 0.2);
    let bound_secs = 1.5 * SIZE.pixels() as f64 / (rate * least_share);
    for kind in KINDS {
        let mut engine = engine(world(STILL, disc), kind, rate);
        let (_, secs) = play(&mut engine, 180);
        let oldest = engine.canvas().time().iter().min().expect("pixels");
        let age_secs = Time::from_secs(secs).secs_since(*oldest);
        assert!(age_secs < bound_secs, "{kind:?}: {age_secs} s, at most {bound_secs} s");
    }
}

#[test]
fn equal_seeds_make_equal_pictures() {
    let disc = |secs: f64| [20.0 + 60.0 * secs as f32, 36.0, 14.0];
    for kind in KINDS {
        let run = || play(&mut engine(world(rotating, disc), kind, 50_000.0), 12).0;
        assert_eq!(differences(&run(), &run()), (0, 0.0), "{kind:?}");
    }
}

#[test]
fn colours_without_surfaces_stay_where_they_are_among_those_with() {
    let world = World { camera: STILL, disc: NO_DISC, surfaces: |batch| batch % 2 == 0 };
    for kind in KINDS {
        let mut engine = engine(world, kind, 83_000.0);
        let (picture, secs) = play(&mut engine, 40);
        assert_eq!(differences(&picture, &world.ideal(secs)), (0, 0.0), "{kind:?}");
    }
}

#[test]
fn from_one_sample_per_batch_to_ten_times_the_picture() {
    let disc = |secs: f64| [20.0 + 60.0 * secs as f32, 36.0, 14.0];
    for kind in KINDS {
        for rate in [960.0, 960.0 * 70_000.0] {
            let mut engine = engine(world(rotating, disc), kind, rate);
            let (picture, _) = play(&mut engine, 2);
            assert!(picture.iter().flatten().all(|c| (0.0..=1.0).contains(c)), "{kind:?} {rate}");
        }
    }
}

#[test]
fn a_cut_leaves_nothing_of_the_picture_before() {
    let cutting: Camera =
        |secs| if secs < 0.3 { STILL(secs) } else { [[1.0, 0.0, 5000.0], [0.0, 1.0, 0.0]] };
    for kind in KINDS {
        let world = world(cutting, |_| [48.0, 36.0, 20.0]);
        let mut engine = engine(world, kind, 83_000.0);
        let (picture, secs) = play(&mut engine, 18 + 40);
        assert_eq!(differences(&picture, &world.ideal(secs)), (0, 0.0), "{kind:?}");
    }
}

#[test]
fn a_picture_of_which_nothing_is_known_appears_everywhere_at_once() {
    let world = world(STILL, NO_DISC);
    let mut engine = engine(world, ReconstructionKind::REPROJECT, 83_000.0);
    // A fifth of the pixels: every pixel has a neighbour that was traced.
    let (picture, secs) = play(&mut engine, 1);
    let error = rmse(&picture, &world.ideal(secs));
    assert!(error < 0.05, "{error}");
    assert!(picture.iter().all(|c| c[1] > 0.1), "no pixel is black");
}
