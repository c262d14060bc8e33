//! The samplers alone: what choosing and observing cost, beside a renderer that costs nothing.

use frameless::{Batch, Clock, Engine, Function, SamplerKind};

use super::table::Row;
use crate::args::BenchArgs;

/// Rows `sampler.<sampler>.loop_ns`: nanoseconds per sample of the whole loop on the simulated clock with a renderer that
/// returns a precomputed colour, so that what is left is choosing, keeping and observing.
pub(super) fn measure(args: &BenchArgs) -> Vec<Row> {
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
    SamplerKind::ALL.into_iter().map(row).collect()
}

/// Samples per second of the sketch: 938 per batch.
const RATE: f64 = 900_000.0;

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
