//! temporary
use frameless::*;
use frameless_trace::{CpuTracer, Settings, ViewSource, World};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};
struct Timed(Box<dyn Sampler>, Arc<[AtomicU64; 3]>);
impl Sampler for Timed {
    fn choose(&mut self, now: Time, canvas: &Canvas, count: usize, requests: &mut Vec<Request>) {
        let b = std::time::Instant::now();
        self.0.choose(now, canvas, count, requests);
        self.1[0].fetch_add(b.elapsed().as_nanos() as u64, Relaxed);
    }
    fn observe(&mut self, canvas: &Canvas, o: &[Observation]) {
        let b = std::time::Instant::now();
        self.0.observe(canvas, o);
        self.1[1].fetch_add(b.elapsed().as_nanos() as u64, Relaxed);
        self.1[2].fetch_add(o.len() as u64, Relaxed);
    }
    fn refines(&self) -> bool {
        self.0.refines()
    }
    fn rates(&self) -> Option<&Rates> {
        self.0.rates()
    }
}
fn run<T: Tracer>(name: &str, canvas: Canvas, tracer: T, refresh: bool, parts: u64) {
    let t: Arc<[AtomicU64; 3]> = Arc::default();
    let timed = Timed(SamplerKind::ADAPTIVE.build(0), t.clone());
    let mut engine =
        Engine::with_canvas(canvas, Clock::simulated(900_000.0), Box::new(timed), tracer);
    if refresh {
        engine.set_reconstruction(ReconstructionKind::REPROJECT.build());
    }
    let mut each = Vec::new();
    for n in 0..30 + parts {
        let before = [0, 1, 2].map(|i| t[i].load(Relaxed));
        let time = Time((n + 1) * 1_000_000_000 / 60);
        engine.run_until(time).unwrap();
        if refresh {
            engine.refresh(time);
        }
        let now = [0, 1, 2].map(|i| t[i].load(Relaxed) - before[i]);
        if n >= 30 {
            each.push([now[0] as f64 / now[2] as f64, now[1] as f64 / now[2] as f64]);
        }
    }
    let sorted = |f: &dyn Fn(&[f64; 2]) -> f64| {
        let mut v: Vec<f64> = each.iter().map(f).collect();
        v.sort_by(f64::total_cmp);
        v
    };
    let (total, c, o) = (sorted(&|e| e[0] + e[1]), sorted(&|e| e[0]), sorted(&|e| e[1]));
    let mean = total.iter().sum::<f64>() / total.len() as f64;
    let m = total.len() / 2;
    println!(
        "{name:10} median {:.2} mean {mean:.2} min {:.2}, choose {:.2} observe {:.2}",
        total[m], total[0], c[m], o[m]
    );
}
fn main() {
    let which: Vec<String> = std::env::args().skip(1).collect();
    let want = |n: &str| which.is_empty() || which.iter().any(|w| w == n);
    let parts = 60;
    for scene in ["sphere", "orbit"] {
        if want(scene) {
            let size = Size::new(512, 384);
            let world = Arc::new(World::new(Arc::new(frameless_scene::builtin(scene).unwrap())));
            let tracer = CpuTracer::new(world, ViewSource::Camera(0), Settings::default(), 1);
            run(scene, Canvas::new(size), tracer, true, 120);
        }
    }
    for (w, h) in [(128, 96), (512, 384), (2048, 1536)] {
        let name = format!("{w}");
        if want(&name) {
            let size = Size::new(w, h);
            let render = move |batch: &Batch| -> Vec<[f32; 3]> {
                let bright = (batch.id % 2) as f32;
                let colour =
                    |pixel: u32| if pixel % size.width < size.width / 10 { bright } else { 0.5 };
                batch.requests.iter().map(|request| [colour(request.pixel); 3]).collect()
            };
            let canvas = Canvas::from_picture(size, vec![[0.5; 3]; size.pixels()]);
            run(&name, canvas, Function::new(render), false, parts);
        }
    }
    if want("4k") {
        let size = Size::new(3840, 2160);
        let render = |batch: &Batch| -> Vec<[f32; 3]> {
            let turn = (batch.scene_secs * 10.0) as u32;
            let colour = |request: &Request| {
                let (x, y) = batch.size.xy(request.pixel);
                let is_bright = (x / 32 + y / 32 + turn).is_multiple_of(2);
                if x < batch.size.width / 10 { f32::from(u8::from(is_bright)) } else { 0.5 }
            };
            batch.requests.iter().map(|request| [colour(request); 3]).collect()
        };
        let canvas = Canvas::from_picture(size, vec![[0.5; 3]; size.pixels()]);
        run("4k", canvas, Function::new(render), false, parts);
    }
}
