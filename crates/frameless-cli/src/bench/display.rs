//! The picture alone: what a refresh costs, with the pattern of samples and holes that a real scene leaves.

use std::sync::Arc;

use frameless::{Clock, Engine, ReconstructionKind, SamplerKind, Time};
use frameless_scene::Limits;
use frameless_trace::{CpuTracer, Settings, ViewSource, World};

use super::sampler::RATE;
use super::table::{Row, median};
use crate::args::BenchArgs;
use crate::failure::Failure;
use crate::input;

const REFRESHES_PER_SEC: u64 = 60;
/// Until the picture is complete.
const WARM_UP_REFRESHES: u64 = 30;

/// What moves.
struct Case {
    name: &'static str,
    scene: &'static str,
    is_at_rest: bool,
}

const CASES: [Case; 3] = [
    Case { name: "camera_moves", scene: "orbit", is_at_rest: false },
    Case { name: "object_moves", scene: "sphere", is_at_rest: false },
    Case { name: "at_rest", scene: "sphere", is_at_rest: true },
];

/// The row of the worst case has this name alone, that of each case its own behind a dot.
const NAME: &str = "display.reproject_gather_ns_per_px";

/// Nanoseconds per pixel of `Engine::refresh` (warp, gather, holes), each round's median over its refreshes: of each case, and first of
/// the one that takes most.
pub(super) fn measure(args: &BenchArgs) -> Result<Vec<Row>, Failure> {
    let conditions = format!(
        "{}×{}, adaptive+reproject, simulated clock at {RATE} samples/s, {REFRESHES_PER_SEC} refreshes/s, one thread; \
         {} rounds of {} s; orbit, sphere, and sphere standing still; \
         without a suffix the worst of them",
        args.size.width, args.size.height, args.rounds, args.secs
    );
    let row = |case: &Case| {
        let world = Arc::new(World::new(Arc::new(input::scene(
            case.scene,
            &Default::default(),
            &Limits::default(),
        )?)));
        let rounds: Vec<f64> = (0..args.rounds)
            .map(|seed| nanos_per_pixel(&world, case, args, u64::from(seed)))
            .collect();
        Ok(Row::new(format!("{NAME}.{}", case.name), "ns/px", &rounds, &conditions))
    };
    let mut rows = CASES.iter().map(row).collect::<Result<Vec<Row>, Failure>>()?;
    if let Some(worst) = rows.iter().max_by(|a, b| a.value.total_cmp(&b.value)).cloned() {
        rows.insert(0, Row { name: NAME.into(), ..worst });
    }
    Ok(rows)
}

fn nanos_per_pixel(world: &Arc<World>, case: &Case, args: &BenchArgs, seed: u64) -> f64 {
    let tracer =
        CpuTracer::new(Arc::clone(world), ViewSource::Camera(0), Settings::default(), args.threads);
    let sampler = SamplerKind::ADAPTIVE.build(seed);
    let mut engine = Engine::new(args.size, Clock::simulated(RATE), sampler, tracer);
    engine.set_reconstruction(ReconstructionKind::REPROJECT.build());
    let real = Clock::real();
    let mut refresh = |number: u64| {
        let time = Time((number + 1) * 1_000_000_000 / REFRESHES_PER_SEC);
        if case.is_at_rest && number == WARM_UP_REFRESHES / 2 {
            engine.timeline_mut().pause(time);
        }
        engine.run_until(time).expect("the tracer's colours are finite");
        let begin = real.now();
        engine.refresh(time);
        1e9 * real.now().secs_since(begin) / args.size.pixels() as f64
    };
    (0..WARM_UP_REFRESHES).for_each(|number| _ = refresh(number));
    let measured = ((args.secs * REFRESHES_PER_SEC as f64) as u64).max(1);
    let mut nanos: Vec<f64> =
        (WARM_UP_REFRESHES..WARM_UP_REFRESHES + measured).map(refresh).collect();
    nanos.sort_by(f64::total_cmp);
    median(&nanos)
}
