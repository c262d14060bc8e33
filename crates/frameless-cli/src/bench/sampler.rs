//! The samplers alone: what choosing and observing cost, beside a renderer that costs nothing.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use frameless::{
    Batch, Canvas, Clock, Engine, Function, Observation, ReconstructionKind, Request, Sampler,
    SamplerKind, Size, Time, Tracer,
};
use frameless_scene::Limits;
use frameless_trace::{CpuTracer, Settings, ViewSource, World};

use super::table::Row;
use crate::args::BenchArgs;
use crate::failure::Failure;
use crate::input;

/// Rows `sampler.<sampler>.loop_ns`: nanoseconds per sample of the whole loop on the simulated clock with a renderer that
/// returns a precomputed colour, so that what is left is choosing, keeping and observing.
///
/// Rows `sampler.choose_observe_ns` and `sampler.choose_observe_ns_4k`: nanoseconds per sample of choosing and observing of
/// `adaptive` alone, in a scene with what its changes make of it (holes, fronts, learned rates), and in a picture of 3840×2160
/// of which a tenth changes. Row `sampler.growth_256x`: how much more a sample costs in a picture of 2048×1536 than in one of 128×96.
pub(super) fn measure(args: &BenchArgs) -> Result<Vec<Row>, Failure> {
    let conditions = format!(
        "{}×{}, 938 samples per batch, one thread, {} rounds; a tenth of the picture flickers; \
         includes writing the canvas and measuring the change",
        args.size.width, args.size.height, args.rounds
    );
    let row = |kind: SamplerKind| {
        let rounds: Vec<f64> =
            (0..args.rounds).map(|seed| nanos_per_sample(kind, args, u64::from(seed))).collect();
        Row::new(format!("sampler.{}.loop_ns", kind.name()), "ns/sample", &rounds, &conditions)
    };
    let mut rows: Vec<Row> = SamplerKind::ALL.into_iter().map(row).collect();
    rows.push(in_a_scene(args)?);
    rows.push(in_4k(args));
    rows.extend(growth(args));
    Ok(rows)
}

fn in_a_scene(args: &BenchArgs) -> Result<Row, Failure> {
    let world = Arc::new(World::new(Arc::new(input::scene(
        args.scene(),
        &args.choice(),
        &Limits::default(),
    )?)));
    let rounds = (0..args.rounds).map(|seed| scene_nanos(&world, args, u64::from(seed)));
    let conditions = format!(
        "{}, {}×{}, 938 samples per batch, adaptive+reproject refreshed 60 times a second, one thread, {} rounds of {} s after \
         half a second",
        args.scene(),
        args.size.width,
        args.size.height,
        args.rounds,
        args.secs
    );
    Ok(Row::new(
        "sampler.choose_observe_ns",
        "ns/sample",
        &rounds.collect::<Vec<f64>>(),
        &conditions,
    ))
}

fn in_4k(args: &BenchArgs) -> Row {
    let rounds = (0..args.rounds).map(|seed| nanos_4k(args.secs, u64::from(seed)));
    let conditions = format!(
        "3840×2160, 938 samples per batch, adaptive+hold, never refreshed, from a known picture; in its left tenth the squares of a \
         chessboard change colour ten times a second, which costs nothing to trace; one thread, {} rounds of {} s after half a \
         second",
        args.rounds, args.secs
    );
    Row::new(
        "sampler.choose_observe_ns_4k",
        "ns/sample",
        &rounds.collect::<Vec<f64>>(),
        &conditions,
    )
}

/// Pictures of which one has 256 times the pixels of the other.
const GROWTH: [Size; 2] = [Size { width: 128, height: 96 }, Size { width: 2048, height: 1536 }];

/// What a sample costs in either picture, and how many times as much in the large one, round by round.
fn growth(args: &BenchArgs) -> [Row; 3] {
    let conditions = format!(
        "938 samples per batch, adaptive+hold, never refreshed, from a known picture; the left tenth changes colour from batch to batch, \
         whatever its size, which costs nothing to trace; one thread, {} alternating rounds of {} s after half a second",
        args.rounds, args.secs
    );
    let [mut small, mut large] = [Vec::new(), Vec::new()];
    for round in 0..args.rounds {
        let nanos = |size: Size| flickering_nanos(size, args.secs, u64::from(round));
        // Either is first as often as last: the machine's speed drifts.
        if round % 2 == 0 {
            small.push(nanos(GROWTH[0]));
            large.push(nanos(GROWTH[1]));
        } else {
            large.push(nanos(GROWTH[1]));
            small.push(nanos(GROWTH[0]));
        }
    }
    let growth: Vec<f64> = large.iter().zip(&small).map(|(large, small)| large / small).collect();
    [
        Row::new("sampler.choose_observe_ns_128x96", "ns/sample", &small, &conditions),
        Row::new("sampler.choose_observe_ns_2048x1536", "ns/sample", &large, &conditions),
        Row::new("sampler.growth_256x", "ratio", &growth, &conditions),
    ]
}

/// Samples per second of the sketch: 938 per batch.
pub(super) const RATE: f64 = 900_000.0;

fn nanos_per_sample(kind: SamplerKind, args: &BenchArgs, seed: u64) -> f64 {
    let flickering = args.size.width / 10;
    let render = |batch: &Batch| -> Vec<[f32; 3]> {
        let bright = (batch.id % 2) as f32;
        let colour = |pixel: u32| if pixel % batch.size.width < flickering { bright } else { 0.5 };
        batch.requests.iter().map(|request| [colour(request.pixel); 3]).collect()
    };
    let mut engine =
        Engine::new(args.size, Clock::simulated(RATE), kind.build(seed), Function::new(render));
    let real = Clock::real();
    let mut run_for = |secs: f64| {
        let (begin, kept) = (real.now(), engine.counters().kept);
        while real.now().secs_since(begin) < secs {
            engine.step().expect("finite colours");
        }
        1e9 * real.now().secs_since(begin) / (engine.counters().kept - kept) as f64
    };
    run_for(0.2 * args.secs);
    run_for(args.secs)
}

/// Adds up how long it takes.
struct Timed {
    sampler: Box<dyn Sampler>,
    real: Clock,
    nanos: Arc<AtomicU64>,
}

impl Timed {
    fn add(&self, begin: Time) {
        self.nanos.fetch_add(self.real.now().0 - begin.0, Ordering::Relaxed);
    }
}

impl Sampler for Timed {
    fn choose(&mut self, now: Time, canvas: &Canvas, count: usize, requests: &mut Vec<Request>) {
        let begin = self.real.now();
        self.sampler.choose(now, canvas, count, requests);
        self.add(begin);
    }

    fn observe(&mut self, canvas: &Canvas, observations: &[Observation]) {
        let begin = self.real.now();
        self.sampler.observe(canvas, observations);
        self.add(begin);
    }

    fn refines(&self) -> bool {
        self.sampler.refines()
    }

    fn rates(&self) -> Option<&frameless::Rates> {
        self.sampler.rates()
    }
}

/// What a sampler has cost so far.
struct Cost {
    nanos: u64,
    kept: u64,
}

impl Cost {
    fn per_sample_since(&self, before: &Cost) -> f64 {
        (self.nanos - before.nanos) as f64 / (self.kept - before.kept) as f64
    }
}

/// `adaptive` on the simulated clock, and the nanoseconds that it takes.
fn timed_engine<T: Tracer>(canvas: Canvas, tracer: T, seed: u64) -> (Engine<T>, Arc<AtomicU64>) {
    let nanos = Arc::new(AtomicU64::new(0));
    let sampler = SamplerKind::ADAPTIVE.build(seed);
    let timed = Timed { sampler, real: Clock::real(), nanos: Arc::clone(&nanos) };
    (Engine::with_canvas(canvas, Clock::simulated(RATE), Box::new(timed), tracer), nanos)
}

/// Simulated seconds before a measurement, in which rates are learned.
const WARM_SECS: f64 = 0.5;

fn scene_nanos(world: &Arc<World>, args: &BenchArgs, seed: u64) -> f64 {
    let (view, settings) = (ViewSource::Camera(0), Settings::default());
    let tracer = CpuTracer::new(Arc::clone(world), view, settings, args.threads);
    let (mut engine, nanos) = timed_engine(Canvas::new(args.size), tracer, seed);
    engine.set_reconstruction(ReconstructionKind::REPROJECT.build());
    let mut refreshes = 0;
    let mut run_until = |secs: f64| {
        while engine.now().secs() < secs {
            refreshes += 1;
            let time = Time(refreshes * 1_000_000_000 / 60);
            engine.run_until(time).expect("the tracer's colours are finite");
            engine.refresh(time);
        }
        Cost { nanos: nanos.load(Ordering::Relaxed), kept: engine.counters().kept }
    };
    let warm = run_until(WARM_SECS);
    run_until(WARM_SECS + args.secs).per_sample_since(&warm)
}

fn nanos_4k(secs: f64, seed: u64) -> f64 {
    let render = |batch: &Batch| -> Vec<[f32; 3]> {
        let turn = (batch.scene_secs * 10.0) as u32;
        let colour = |request: &Request| {
            let (x, y) = batch.size.xy(request.pixel);
            let is_bright = (x / 32 + y / 32 + turn).is_multiple_of(2);
            if x < batch.size.width / 10 { f32::from(u8::from(is_bright)) } else { 0.5 }
        };
        batch.requests.iter().map(|request| [colour(request); 3]).collect()
    };
    held_nanos(Size::new(3840, 2160), render, secs, seed)
}

fn flickering_nanos(size: Size, secs: f64, seed: u64) -> f64 {
    let render = |batch: &Batch| -> Vec<[f32; 3]> {
        let bright = (batch.id % 2) as f32;
        let colour = |pixel: u32| if pixel % size.width < size.width / 10 { bright } else { 0.5 };
        batch.requests.iter().map(|request| [colour(request.pixel); 3]).collect()
    };
    held_nanos(size, render, secs, seed)
}

/// From a known picture, never refreshed.
fn held_nanos(
    size: Size,
    render: impl FnMut(&Batch) -> Vec<[f32; 3]>,
    secs: f64,
    seed: u64,
) -> f64 {
    let canvas = Canvas::from_picture(size, vec![[0.5; 3]; size.pixels()]);
    let (mut engine, nanos) = timed_engine(canvas, Function::new(render), seed);
    let mut run_until = |secs: f64| {
        engine.run_until(Time::from_secs(secs)).expect("finite colours");
        Cost { nanos: nanos.load(Ordering::Relaxed), kept: engine.counters().kept }
    };
    let warm = run_until(WARM_SECS);
    run_until(WARM_SECS + secs).per_sample_since(&warm)
}
