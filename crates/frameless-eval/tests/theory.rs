//! What the ages of pixels alone say about the error (docs/evaluation.md, "What ages alone would give"), against runs.
//!
//! The camera passes a long striped wall so that its picture moves by [`SPEED_PX`] pixels per second. Where the wall is a ramp, every
//! pixel's display colour is linear in time, and the squared error is (slope · age)². Where it has stripes, black and white,
//! the squared error is (height of the step)² where an edge has passed since the pixel was traced, which has a
//! probability proportional to its age. So the two walls measure the mean of age² and the mean age.

use std::path::Path;

use frameless::{Canvas, Clock, Display, Engine, Request, Sampler, SamplerKind, Time};
use frameless_eval::{Algorithm, Cell, Experiment, Ideals, Subject, refresh_time, rmse, run};

const WIDTH: u32 = 64;
const HEIGHT: u32 = 48;
const SPEED_PX: f64 = 100.0;
const DURATION_SECS: f64 = 8.0;
/// T: seconds that as many samples take as there are pixels. Refreshes fall evenly into it, since it is no simple multiple of theirs.
const PASS_SECS: f64 = 0.103;
const SAMPLES_PER_SEC: f64 = (WIDTH * HEIGHT) as f64 / PASS_SECS;
/// Length of the wall in pixels: what passes by, and the picture's width.
const WALL_PX: f64 = SPEED_PX * DURATION_SECS + 2.0 * WIDTH as f64;
/// How much the ramp rises from end to end, and how high a step between stripes is.
const RISE: f64 = 0.9;
/// Ten passes long: hardly any sample gets so old that a second edge passes.
const STRIPE_PX: f64 = 10.0 * SPEED_PX * PASS_SECS;

/// A wall made of upright or leaning strips, in pixels of the picture from the left and from the middle row up.
#[derive(Default)]
struct Wall {
    /// x, y and linear grey of every vertex; four per strip.
    corners: Vec<[f64; 3]>,
}

impl Wall {
    /// From `left` to `right` at the middle row, leaning to the right by `lean` pixels per row; display greys at its two sides.
    fn strip(&mut self, (left, right): (f64, f64), lean: f64, greys: [f64; 2]) {
        let top = f64::from(HEIGHT);
        let linear = greys.map(|grey| ((grey + 0.055) / 1.055).powf(2.4));
        for (x, y, grey) in [
            (left, -top, linear[0]),
            (right, -top, linear[1]),
            (right, top, linear[1]),
            (left, top, linear[0]),
        ] {
            self.corners.push([x + lean * y, y, grey]);
        }
    }

    /// From 0.05 to 0.95 over its whole length.
    fn ramp() -> Wall {
        const STRIPS: u32 = 250;
        let mut wall = Wall::default();
        for i in 0..STRIPS {
            let [a, b] = [i, i + 1].map(|i| f64::from(i) / f64::from(STRIPS));
            wall.strip((a * WALL_PX, b * WALL_PX), 0.0, [0.05 + RISE * a, 0.05 + RISE * b]);
        }
        wall
    }

    /// Alternating stripes that lean by one period from the lowest row to the highest, so that as many edges are in
    /// every picture.
    fn stripes() -> Wall {
        let lean = 2.0 * STRIPE_PX / f64::from(HEIGHT);
        let beyond = (lean * f64::from(HEIGHT) / STRIPE_PX).ceil() as i32 + 1;
        let last = (WALL_PX / STRIPE_PX).ceil() as i32 + beyond;
        let mut wall = Wall::default();
        for i in -beyond..last {
            let grey = if i % 2 == 0 { 0.05 } else { 0.05 + RISE };
            let left = f64::from(i) * STRIPE_PX;
            wall.strip((left, left + STRIPE_PX), lean, [grey; 2]);
        }
        wall
    }

    /// A glTF file, lit from the front so that radiance is the vertices' grey.
    fn write(&self, folder: &Path) {
        let mut bytes: Vec<u8> = Vec::new();
        let corners = &self.corners;
        let positions = corners.iter().flat_map(|&[x, y, _]| [x as f32, y as f32, 0.0]);
        bytes.extend(positions.flat_map(f32::to_le_bytes));
        let greys = corners.iter().flat_map(|&[_, _, grey]| [grey as f32; 3]);
        bytes.extend(greys.flat_map(f32::to_le_bytes));
        let n = corners.len();
        let indices = (0..n as u32).step_by(4).flat_map(|c| [0, 1, 2, 0, 2, 3].map(|i| c + i));
        bytes.extend(indices.flat_map(u32::to_le_bytes));
        let (x_max, x_min) = corners
            .iter()
            .map(|c| c[0] as f32)
            .fold((f32::MIN, f32::MAX), |(max, min), x| (max.max(x), min.min(x)));
        let gltf = serde_json::json!({
            "asset": { "version": "2.0" },
            "extensionsUsed": ["KHR_lights_punctual"],
            "extensions": { "KHR_lights_punctual": { "lights": [
                { "type": "directional", "intensity": std::f32::consts::PI }
            ] } },
            "scenes": [{ "nodes": [0, 1] }],
            "nodes": [
                { "mesh": 0 },
                { "extensions": { "KHR_lights_punctual": { "light": 0 } } }
            ],
            "materials": [{ "pbrMetallicRoughness": { "metallicFactor": 0.0 } }],
            "meshes": [{ "primitives": [{
                "attributes": { "POSITION": 0, "COLOR_0": 1 }, "indices": 2, "material": 0
            }] }],
            "buffers": [{ "uri": "wall.bin", "byteLength": bytes.len() }],
            "bufferViews": [
                { "buffer": 0, "byteOffset": 0, "byteLength": 12 * n },
                { "buffer": 0, "byteOffset": 12 * n, "byteLength": 12 * n },
                { "buffer": 0, "byteOffset": 24 * n, "byteLength": 6 * n }
            ],
            "accessors": [
                { "bufferView": 0, "componentType": 5126, "count": n, "type": "VEC3",
                  "min": [x_min, -f64::from(HEIGHT), 0.0], "max": [x_max, f64::from(HEIGHT), 0.0] },
                { "bufferView": 1, "componentType": 5126, "count": n, "type": "VEC3" },
                { "bufferView": 2, "componentType": 5125, "count": n / 4 * 6, "type": "SCALAR" }
            ]
        });
        std::fs::write(folder.join("wall.bin"), bytes).expect("a folder to write to");
        std::fs::write(folder.join("wall.gltf"), gltf.to_string()).expect("a folder to write to");
    }
}

/// A wall that passes by, ready to be run.
struct Passing {
    experiment: Experiment,
    subject: Subject,
    ideals: Ideals,
}

impl Passing {
    /// From half the picture's height away at 90°, so that a unit of length is a pixel.
    fn by(wall: &Wall) -> Passing {
        let folder = tempfile::tempdir().expect("a folder to write to");
        wall.write(folder.path());
        let (start, distance) = (f64::from(WIDTH), f64::from(HEIGHT) / 2.0);
        let end = start + SPEED_PX * DURATION_SECS;
        let text = format!(
            "title = \"theory\"\nsamples_per_sec = [1]\nwidth = {WIDTH}\nheight = {HEIGHT}\n\
             duration_secs = {DURATION_SECS:?}\nunscored_secs = 1.5\n\
             [[scenes]]\nscene = \"wall.gltf\"\n[scenes.camera]\nyfov_degrees = 90\nkeyframes = [\n\
             {{ time = 0, eye = [{start:?}, 0, {distance:?}], target = [{start:?}, 0, 0] }},\n\
             {{ time = {DURATION_SECS:?}, eye = [{end:?}, 0, {distance:?}], target = [{end:?}, 0, 0] }}]\n\
             [output]\nvideo = false"
        );
        let experiment = Experiment::parse(&text, folder.path()).expect("valid");
        let subject = Subject::load(&experiment.scenes[0]).expect("a valid file");
        let ideals = Ideals::trace(&subject, &experiment, &|| (), &|| false).expect("not stopped");
        Passing { experiment, subject, ideals }
    }

    /// Mean squared error over pixels and scored refreshes.
    fn mse(&self, algorithm: &str) -> f64 {
        let cell = Cell {
            scene: "wall".into(),
            algorithm: Algorithm::from_name(algorithm).expect(algorithm),
            samples_per_sec: SAMPLES_PER_SEC,
            seed: 1,
        };
        let Passing { experiment, subject, ideals } = self;
        let result = run(&cell, experiment, subject, ideals, &mut |_, _| true).expect("finite");
        self.mean_square(result.rmse.values.into_iter().map(|rmse| rmse.expect("measured")))
    }

    /// The same for any sampler, shown by hold.
    fn mse_of_sampler(&self, sampler: Box<dyn Sampler>) -> f64 {
        let canvas = Canvas::from_picture(self.experiment.size, self.ideals.start.clone());
        let clock = Clock::simulated(SAMPLES_PER_SEC);
        let mut engine = Engine::with_canvas(canvas, clock, sampler, self.subject.tracer(false));
        let display = Display::default();
        self.mean_square(self.ideals.pictures.iter().enumerate().map(|(k, ideal)| {
            engine.run_until(refresh_time(k, self.experiment.display_hz)).expect("finite");
            let shown: Vec<_> =
                engine.canvas().rgb().iter().map(|&rgb| display.encode(rgb)).collect();
            rmse(&shown, ideal)
        }))
    }

    fn mean_square(&self, rmse: impl Iterator<Item = f64>) -> f64 {
        let squares: Vec<f64> = rmse.skip(self.experiment.unscored).map(|r| r * r).collect();
        squares.iter().sum::<f64>() / squares.len() as f64
    }
}

/// Row by row, again and again: a permutation whose order stays the same.
struct Sequential {
    next: u32,
}

impl Sampler for Sequential {
    fn choose(&mut self, _: Time, canvas: &Canvas, count: usize, requests: &mut Vec<Request>) {
        let pixels = canvas.size().pixels() as u32;
        requests.extend((0..count as u32).map(|i| Request::centre((self.next + i) % pixels)));
        self.next = (self.next + count as u32) % pixels;
    }
}

fn assert_theory(name: &str, measured: f64, theory: f64) {
    let ratio = measured / theory;
    eprintln!("{name}: {ratio:.4} of the theory");
    assert!((ratio - 1.0).abs() < 0.03, "{name}: measured {measured}, theory {theory}");
}

#[test]
fn error_that_grows_linearly_with_age_has_the_second_moments_of_age() {
    let ramp = Passing::by(&Wall::ramp());
    // What one pass of the picture is worth: slope per second · T.
    let unit = (RISE / WALL_PX * SPEED_PX * PASS_SECS).powi(2);
    for (name, moment) in [
        ("framed", 7.0 / 3.0),
        ("framed-single", 7.0 / 6.0),
        ("random", 2.0),
        ("permutation", 1.0 / 2.0),
    ] {
        assert_theory(name, ramp.mse(name), moment * unit);
    }
    let sequential = ramp.mse_of_sampler(Box::new(Sequential { next: 0 }));
    assert_theory("sequential", sequential, unit / 3.0);
}

#[test]
fn squared_error_that_grows_linearly_with_age_is_three_two_one() {
    let stripes = Passing::by(&Wall::stripes());
    // Part of the pixels that an edge passes in T, times the squared step.
    let unit = SPEED_PX * PASS_SECS / STRIPE_PX * RISE * RISE;
    for (name, moment) in [
        ("framed", 3.0 / 2.0),
        ("framed-single", 1.0),
        ("random", 1.0),
        ("permutation", 7.0 / 12.0),
    ] {
        assert_theory(name, stripes.mse(name), moment * unit);
    }
    let sequential = stripes.mse_of_sampler(Box::new(Sequential { next: 0 }));
    assert_theory("sequential", sequential, unit / 2.0);
}

#[test]
fn a_sampler_is_measured_alike_by_hand_and_by_a_run() {
    let ramp = Passing::by(&Wall::ramp());
    let by_hand = ramp.mse_of_sampler(SamplerKind::Random.build(1));
    assert!((by_hand / ramp.mse("random") - 1.0).abs() < 1e-9);
}
