//! What the loop holds in memory, per pixel: canvas, sampler, reconstruction and picture, counted by the allocator.
//!
//! `cargo test -p frameless --test memory -- --nocapture` prints it.
#![allow(unsafe_code)]

use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicUsize, Ordering};

use frameless::{
    Answer, Batch, Clock, Engine, Lighting, Pose, Projection, ReconstructionKind, Request,
    SamplerKind, Size, Surface, Time, Tracer,
};

/// The system's allocator, and how much it has given out: now, and at the most.
struct Counting;

static HELD: AtomicUsize = AtomicUsize::new(0);
static MOST: AtomicUsize = AtomicUsize::new(0);

// SAFETY: every call is handed on to the system's allocator as it is.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        let before = HELD.fetch_add(layout.size(), Ordering::Relaxed);
        MOST.fetch_max(before + layout.size(), Ordering::Relaxed);
        // SAFETY: the caller's promises are those that it asks for.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, memory: *mut u8, layout: Layout) {
        HELD.fetch_sub(layout.size(), Ordering::Relaxed);
        // SAFETY: as above.
        unsafe { System.dealloc(memory, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

const SIZE: Size = Size { width: 512, height: 384 };

/// A plane that slides through the picture.
#[derive(Default)]
struct Sliding(Vec<Answer>);

impl Sliding {
    fn offset_px(secs: f64) -> f32 {
        100.0 * secs as f32
    }
}

impl Tracer for Sliding {
    fn submit(&mut self, batch: Batch) {
        let offset_px = Sliding::offset_px(batch.scene_secs);
        let surface = |request: &Request| {
            let [x, y] = request.position_px(batch.size);
            let position = [x - offset_px, y, 0.0];
            Surface { position, normal: [0.0, 0.0, 1.0], ..Surface::default() }
        };
        let surfaces: Vec<Surface> = batch.requests.iter().map(surface).collect();
        let rgb = surfaces.iter().map(|s| [0.5 + 0.3 * s.position[0].sin(), 0.4, 0.3]).collect();
        self.0.push(Answer::to(batch, rgb, surfaces));
    }

    fn collect(&mut self, _wait: bool) -> Option<Answer> {
        self.0.pop()
    }

    fn pose(&mut self, scene_secs: f64, _size: Size, pose: &mut Pose) -> bool {
        let x = Sliding::offset_px(scene_secs);
        let rows =
            [[1.0, 0.0, 0.0, x], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 10.0], [0.0, 0.0, 0.0, 1.0]];
        *pose = Pose { picture_from_object: vec![Projection(rows)], ..Pose::default() };
        true
    }

    fn lighting(&mut self, _scene_secs: f64, _lighting: &mut Lighting) -> bool {
        false
    }
}

/// Bytes per pixel after half a second at 900,000 samples/s with 60 refreshes per second, and while the last of them is made.
fn bytes_per_px(kind: &str) -> [f64; 2] {
    let kind = ReconstructionKind::from_name(kind).expect("known");
    let before = HELD.load(Ordering::Relaxed);
    let (clock, sampler) = (Clock::simulated(900_000.0), SamplerKind::ADAPTIVE.build(1));
    let mut engine = Engine::new(SIZE, clock, sampler, Sliding::default());
    engine.set_reconstruction(kind.build());
    for refresh in 1..=30 {
        let now = Time(refresh * 1_000_000_000 / 60);
        engine.run_until(now).expect("finite colours");
        MOST.store(0, Ordering::Relaxed);
        engine.refresh(now);
    }
    [&HELD, &MOST].map(|bytes| {
        let held = bytes.load(Ordering::Relaxed).saturating_sub(before);
        held as f64 / SIZE.pixels() as f64
    })
}

#[test]
fn a_pixel_takes_no_more_than_it_may() {
    let bounds = [
        ("hold", 40.0),
        ("reproject", 96.0),
        ("reproject+relight+antialias", 160.0),
        ("reproject+deep", 224.0),
    ];
    for (kind, most) in bounds {
        let [bytes, meanwhile] = bytes_per_px(kind);
        println!(
            "memory.{kind}_bytes_per_px {bytes:.1} (at most {most}), {meanwhile:.1} in a refresh"
        );
        assert!(bytes <= most, "{kind}: {bytes} bytes per pixel");
    }
}
