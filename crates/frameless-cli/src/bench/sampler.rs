//! The samplers alone: what choosing and observing cost, beside a renderer that costs nothing.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use frameless::{
    Batch, Canvas, Clock, Engine, Function, Observation, ReconstructionKind, Request, Sampler,
    SamplerKind, Time,
};
use frameless_trace::{CpuTracer, Settings, ViewSource, World};

use super::table::Row;
use crate::args::BenchArgs;
use crate::failure::Failure;
use crate::input;

/// Rows `sampler.<sampler>.loop_ns`: nanoseconds per sample of the whole loop on the simulated clock with a renderer that
/// returns a precomputed colour, so that what is left is choosing, keeping and observing.
///
/// Row `sampler.adaptive.ns`: nanoseconds per sample of choosing and observing alone, with what the scene's changes make
/// of it (holes, fronts, learned rates).
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
    let world = Arc::new(World::new(Arc::new(input::scene(&args.scene)?)));
    let rounds: Vec<f64> =
        (0..args.rounds).map(|seed| choosing_nanos(&world, args, u64::from(seed))).collect();
    let conditions = format!(
        "{}, {}×{}, 938 samples per batch, adaptive+reproject, one thread, {} rounds of {} s",
        args.scene, args.size.width, args.size.height, args.rounds, args.secs
    );
    rows.push(Row::new("sampler.adaptive.ns", "ns/sample", &rounds, &conditions));
    Ok(rows)
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

    fn rates(&self) -> Option<&frameless::Rates> {
        self.sampler.rates()
    }
}

fn choosing_nanos(world: &Arc<World>, args: &BenchArgs, seed: u64) -> f64 {
    let (view, settings) = (ViewSource::Camera(0), Settings::default());
    let tracer = CpuTracer::new(Arc::clone(world), view, settings, args.threads);
    let nanos = Arc::new(AtomicU64::new(0));
    let sampler = SamplerKind::ADAPTIVE.build(seed);
    let timed = Timed { sampler, real: Clock::real(), nanos: Arc::clone(&nanos) };
    let mut engine = Engine::new(args.size, Clock::simulated(RATE), Box::new(timed), tracer);
    engine.set_reconstruction(ReconstructionKind::REPROJECT.build());
    let mut refreshes = 0;
    let mut run_until = |secs: f64| {
        while engine.now().secs() < secs {
            refreshes += 1;
            let time = Time(refreshes * 1_000_000_000 / 60);
            engine.run_until(time).expect("the tracer's colours are finite");
            engine.refresh(time);
        }
        (nanos.load(Ordering::Relaxed), engine.counters().kept)
    };
    let (warm_nanos, warm_kept) = run_until(0.5);
    let (nanos, kept) = run_until(0.5 + args.secs);
    (nanos - warm_nanos) as f64 / (kept - warm_kept) as f64
}
