//! More threads: how much faster the whole loop becomes.

use std::sync::Arc;

use frameless::{
    Answer, Batch, Clock, Engine, Lighting, Pose, ReconstructionKind, SamplerKind, Size, Tracer,
};
use frameless_scene::Limits;
use frameless_trace::{CpuTracer, Settings, ViewSource, World};

use super::table::Row;
use crate::args::BenchArgs;
use crate::failure::Failure;
use crate::input;

/// The first turns of a run learn the batch length and trace what is unknown; they are not counted.
const WARM_UP_SECS: f64 = 0.3;
const SECS_PER_PICTURE: f64 = 1.0 / 60.0;

/// What the loop does beside tracing.
struct Case {
    name: &'static str,
    reconstruction: ReconstructionKind,
}

const CASES: [Case; 2] = [
    Case { name: "", reconstruction: ReconstructionKind::Hold },
    Case { name: ".reproject", reconstruction: ReconstructionKind::REPROJECT },
];

/// Rows `scaling.1_to_N`: how many times as many samples per second with N threads, the loop's own among them, as with one thread that does
/// everything; round by round, for N = 2, 4, 8 … up to the machine's cores. `scaling.serial_share`: of the one thread's time, what only the
/// loop's own thread can do (choose, keep, observe): no number of threads makes the loop faster than one over it. `scaling.reproject.…`: the
/// same with samples that move along, and 60 pictures per second.
pub(super) fn measure(args: &BenchArgs) -> Result<Vec<Row>, Failure> {
    let scene = input::scene(args.scene(), &args.choice(), &Limits::default())?;
    let world = Arc::new(World::new(Arc::new(scene)));
    let mut rows = Vec::new();
    for case in &CASES {
        rows.extend(scaling(&world, case, args));
    }
    Ok(rows)
}

fn scaling(world: &Arc<World>, case: &Case, args: &BenchArgs) -> Vec<Row> {
    let counts = thread_counts();
    let mut speeds = vec![Vec::new(); counts.len()];
    let mut serial_shares = Vec::new();
    for round in 0..args.rounds as usize {
        // Everybody is first as often as last: the machine's speed drifts within a round too.
        for turn in 0..counts.len() {
            let i = (turn + round) % counts.len();
            let speed = run(world, case, args, counts[i], round as u64);
            speeds[i].push(speed.samples_per_sec);
            if counts[i] == 1 {
                serial_shares.push(speed.serial_share);
            }
        }
    }
    let conditions = format!(
        "{}, {}×{}, real clock, adaptive+{}, {} alternating rounds of {} s; threads are counted with the loop's own, which traces while it \
         waits",
        args.scene(),
        args.size.width,
        args.size.height,
        case.reconstruction.name(),
        args.rounds,
        args.secs
    );
    let mut rows = Vec::new();
    for (&threads, rates) in counts.iter().zip(&speeds) {
        let name = format!("scaling{}.samples_per_sec_{threads}", case.name);
        rows.push(Row::new(name, "samples/s", rates, &conditions));
    }
    for (&threads, rates) in counts.iter().zip(&speeds).skip(1) {
        let ratios: Vec<f64> = rates.iter().zip(&speeds[0]).map(|(a, b)| a / b).collect();
        let name = format!("scaling{}.1_to_{threads}", case.name);
        rows.push(Row::new(name, "times", &ratios, &conditions));
    }
    let name = format!("scaling{}.serial_share", case.name);
    rows.push(Row::new(name, "of a thread's time", &serial_shares, &conditions));
    rows
}

/// 1, 2, 4 … and as many as the machine has cores; two at least.
fn thread_counts() -> Vec<usize> {
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let mut counts: Vec<usize> = (0..).map(|k| 1 << k).take_while(|&n| n < cores.max(2)).collect();
    counts.push(cores.max(2));
    counts
}

struct Speed {
    samples_per_sec: f64,
    serial_share: f64,
}

fn run(world: &Arc<World>, case: &Case, args: &BenchArgs, threads: usize, seed: u64) -> Speed {
    let surfaces = case.reconstruction != ReconstructionKind::Hold;
    let settings = Settings { surfaces, ..Settings::default() };
    let tracer = CpuTracer::new(Arc::clone(world), ViewSource::Camera(0), settings, threads);
    let clock = Clock::real();
    let waited = Waited::new(tracer, clock.clone());
    let sampler = SamplerKind::default().build(seed);
    let mut engine = Engine::new(args.size, Clock::real(), sampler, waited);
    engine.set_reconstruction(case.reconstruction.build());
    engine.set_refresh_threads(threads);
    let mut run_for = |secs: f64, has_pictures: bool| {
        let (begin, kept, waited) = (clock.now(), engine.counters().kept, engine.tracer().secs);
        let mut picture_at = begin.secs();
        while clock.now().secs_since(begin) < secs {
            engine.step().expect("the tracer's colours are finite");
            if has_pictures && clock.now().secs() >= picture_at {
                engine.refresh(engine.now());
                picture_at += SECS_PER_PICTURE;
            }
        }
        let elapsed = clock.now().secs_since(begin);
        Speed {
            samples_per_sec: (engine.counters().kept - kept) as f64 / elapsed,
            serial_share: 1.0 - (engine.tracer().secs - waited) / elapsed,
        }
    };
    // A picture of which nothing is known takes longer than there is between two: with them from the beginning one thread would never get far.
    run_for(WARM_UP_SECS, false);
    run_for(args.secs, surfaces)
}

/// Adds up how long the loop's thread is with the renderer.
pub(super) struct Waited {
    tracer: CpuTracer,
    clock: Clock,
    pub(super) secs: f64,
}

impl Waited {
    pub(super) fn new(tracer: CpuTracer, clock: Clock) -> Waited {
        Waited { tracer, clock, secs: 0.0 }
    }
}

impl Tracer for Waited {
    fn submit(&mut self, batch: Batch) {
        self.tracer.submit(batch);
    }

    fn collect(&mut self, wait: bool) -> Option<Answer> {
        let begin = self.clock.now();
        let answer = self.tracer.collect(wait);
        self.secs += self.clock.now().secs_since(begin);
        answer
    }

    fn is_noisy(&self) -> bool {
        self.tracer.is_noisy()
    }

    fn samples_at_once(&self) -> usize {
        self.tracer.samples_at_once()
    }

    fn pose(&mut self, scene_secs: f64, size: Size, pose: &mut Pose) -> bool {
        self.tracer.pose(scene_secs, size, pose)
    }

    fn lighting(&mut self, scene_secs: f64, lighting: &mut Lighting) -> bool {
        self.tracer.lighting(scene_secs, lighting)
    }
}
