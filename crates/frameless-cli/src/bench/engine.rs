//! The whole loop on the real clock: samples per second of every sampler, in alternating rounds.

use std::sync::Arc;

use frameless::{Clock, Engine, SamplerKind};
use frameless_scene::Limits;
use frameless_trace::{CpuTracer, Settings, ViewSource, World};

use super::scaling::Waited;
use super::table::Row;
use crate::args::BenchArgs;
use crate::failure::Failure;
use crate::input;

// The first turns of a run learn the batch length; they are not counted.
const WARM_UP_SECS: f64 = 0.2;

/// Rows `engine.<sampler>_samples_per_sec` and `engine.<sampler>_over_random`, the ratio round by round; and
/// `engine.update_share`: what bringing the scene to a batch's time takes, of the time from batch to batch. `engine.not_tracing_share`: that, and all
/// that the loop's thread does beside the renderer with the default sampler (choosing, keeping, observing), of all threads' time.
pub(super) fn measure(args: &BenchArgs) -> Result<Vec<Row>, Failure> {
    let world = Arc::new(World::new(Arc::new(input::scene(
        args.scene(),
        &args.choice(),
        &Limits::default(),
    )?)));
    let mut rates = SamplerKind::ALL.map(|_| Vec::new());
    let (mut update_shares, mut not_tracing_shares) = (Vec::new(), Vec::new());
    let threads = super::threads(args) as f64;
    for round in 0..args.rounds {
        // Everybody is first as often as last: the machine's speed drifts within a round too.
        for turn in 0..SamplerKind::ALL.len() {
            let i = (turn + round as usize) % SamplerKind::ALL.len();
            let kind = SamplerKind::ALL[i];
            let speed = speed(&world, kind, args, u64::from(round));
            rates[i].push(speed.samples_per_sec);
            if kind == SamplerKind::default() {
                let update_secs = update_secs(&world, speed.batches_per_sec, args.secs);
                let update_share = update_secs * speed.batches_per_sec;
                update_shares.push(update_share);
                not_tracing_shares.push((update_share + speed.beside_share) / threads);
            }
        }
    }
    let conditions = format!(
        "{}, {}×{}, real clock, {} threads, {} alternating rounds of {} s; surfaces are not asked for",
        args.scene(),
        args.size.width,
        args.size.height,
        super::threads(args),
        args.rounds,
        args.secs
    );
    let random = &rates[0];
    let mut rows = Vec::new();
    for (kind, rates) in SamplerKind::ALL.into_iter().zip(&rates) {
        let name = format!("engine.{}_samples_per_sec", kind.name());
        rows.push(Row::new(name, "samples/s", rates, &conditions));
    }
    for (kind, rates) in SamplerKind::ALL.into_iter().zip(&rates).skip(1) {
        let ratios: Vec<f64> = rates.iter().zip(random).map(|(a, b)| a / b).collect();
        let name = format!("engine.{}_over_random", kind.name());
        rows.push(Row::new(name, "ratio", &ratios, &conditions));
    }
    rows.push(Row::new("engine.update_share", "of a batch's time", &update_shares, &conditions));
    let name = "engine.not_tracing_share";
    rows.push(Row::new(name, "of all threads' time", &not_tracing_shares, &conditions));
    Ok(rows)
}

/// How fast the loop ran.
struct Speed {
    samples_per_sec: f64,
    batches_per_sec: f64,
    /// The part of its time that the loop's thread is not with the renderer.
    beside_share: f64,
}

fn speed(world: &Arc<World>, kind: SamplerKind, args: &BenchArgs, seed: u64) -> Speed {
    let settings = Settings { surfaces: false, ..Settings::default() };
    let view = ViewSource::Camera(0);
    let tracer = CpuTracer::new(Arc::clone(world), view, settings, args.threads).in_real_time();
    let tracer = Waited::new(tracer, Clock::real());
    let mut engine = Engine::new(args.size, Clock::real(), kind.build(seed), tracer);
    let mut run_for = |secs: f64| {
        let (begin, before, waited) = (engine.now(), engine.counters(), engine.tracer().secs);
        while engine.now().secs_since(begin) < secs {
            engine.step().expect("the tracer's colours are finite");
        }
        let (elapsed, after) = (engine.now().secs_since(begin), engine.counters());
        Speed {
            samples_per_sec: (after.kept - before.kept) as f64 / elapsed,
            batches_per_sec: (after.batches - before.batches) as f64 / elapsed,
            beside_share: 1.0 - (engine.tracer().secs - waited) / elapsed,
        }
    };
    run_for(WARM_UP_SECS);
    run_for(args.secs)
}

/// Seconds that it takes to bring everything to the time of the next batch, on one thread: the mean over `secs` of the scene.
fn update_secs(world: &World, batches_per_sec: f64, secs: f64) -> f64 {
    let mut moment = world.moment(0.0);
    let updates = (secs * batches_per_sec).ceil().max(1.0) as u32;
    let clock = Clock::real();
    let begin = clock.now();
    for update in 1..=updates {
        world.update_moment(f64::from(update) / batches_per_sec, &mut moment);
    }
    clock.now().secs_since(begin) / f64::from(updates)
}
