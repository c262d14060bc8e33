//! `cargo run --release -p frameless-trace --example speed -- [SCENE] [WIDTH HEIGHT]`
//!
//! How fast samples come from the [`CpuTracer`], two batches under way, for random pixels, in random order and clustered in tiles,
//! on one thread and on all. Medians of [`ROUNDS`] rounds with their extremes.

use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use frameless::{Batch, Request, Rng, Size, Time, Tracer};
use frameless_scene::{Limits, Scene};
use frameless_trace::{CpuTracer, Settings, ViewSource, World};

type Failure = Box<dyn std::error::Error>;

const ROUNDS: usize = 9;
const BATCH: usize = 1000;
const BATCHES: u64 = 200;
/// Pixels per side of the square that a clustered batch is in.
const CLUSTER: u32 = 64;

fn main() -> Result<(), Failure> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let name = arguments.first().map_or("sphere", String::as_str);
    let size = match arguments.get(1..3) {
        Some([width, height]) => Size::new(width.parse()?, height.parse()?),
        _ => Size::new(512, 384),
    };
    let world = Arc::new(World::new(Arc::new(scene_named(name)?)));
    let scene = world.scene();
    println!(
        "{name} at {}×{}: {} instances, {} lights; batches of {BATCH}, {BATCHES} a round",
        size.width,
        size.height,
        scene.instances.len(),
        scene.lights.len()
    );
    let unlit = Scene { lights: Vec::new(), ..Scene::clone(scene) };
    let unlit = Arc::new(World::new(Arc::new(unlit)));
    println!("threads  order      lights  M samples/s: median (least, most)");
    for threads in [1, 2] {
        for is_clustered in [false, true] {
            // Without lights a sample is a primary ray (and mirrors) and its shading; the difference is the shadow rays.
            for (world, lights) in [(&world, "on"), (&unlit, "none")] {
                let view = ViewSource::Camera(0);
                let mut tracer = CpuTracer::new(world.clone(), view, Settings::default(), threads);
                let mut rates: Vec<f64> =
                    (0..ROUNDS).map(|_| samples_per_sec(&mut tracer, size, is_clustered)).collect();
                rates.sort_by(f64::total_cmp);
                let [least, median, most] = [0, ROUNDS / 2, ROUNDS - 1].map(|k| rates[k] * 1e-6);
                let order = if is_clustered { "clustered" } else { "random" };
                println!("{threads:7}  {order:9}  {lights:6}  {median:.3} ({least:.3}, {most:.3})");
            }
        }
    }
    Ok(())
}

fn samples_per_sec(tracer: &mut CpuTracer, size: Size, is_clustered: bool) -> f64 {
    let mut rng = Rng::new(1);
    let batches: Vec<Batch> = (0..BATCHES)
        .map(|id| Batch {
            id,
            now: Time::ZERO,
            scene_secs: id as f64 * 1e-3,
            size,
            requests: requests(&mut rng, size, is_clustered),
        })
        .collect();
    let begun = Instant::now();
    let mut traced = 0;
    for batch in batches {
        tracer.submit(batch);
        if traced + 1 < BATCHES && tracer.collect(false).is_some() {
            traced += 1;
        }
    }
    while tracer.collect(true).is_some() {}
    (BATCHES as usize * BATCH) as f64 / begun.elapsed().as_secs_f64()
}

fn requests(rng: &mut Rng, size: Size, is_clustered: bool) -> Vec<Request> {
    let [width, height] =
        [size.width, size.height].map(|s| if is_clustered { s.min(CLUSTER) } else { s });
    let left = rng.below(size.width - width + 1);
    let top = rng.below(size.height - height + 1);
    (0..BATCH)
        .map(|_| Request::centre(size.index(left + rng.below(width), top + rng.below(height))))
        .collect()
}

fn scene_named(name: &str) -> Result<Scene, Failure> {
    match frameless_scene::builtin(name) {
        Some(scene) => Ok(scene),
        None => Ok(frameless_scene::load(Path::new(name), &Limits::default())?),
    }
}
