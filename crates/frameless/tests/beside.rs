//! A picture that is made beside the loop holds up nothing and loses nothing.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Sender, channel};

use frameless::{
    Batch, Canvas, Clock, Engine, Function, Observation, ReconstructionKind, Request, Sampler,
    Size, Time, Tracer,
};

const SIZE: Size = Size { width: 40, height: 30 };

/// Every pixel in turn; adds up what it is told.
struct InTurn {
    next: u32,
    told: Arc<AtomicU64>,
}

impl Sampler for InTurn {
    fn choose(&mut self, _now: Time, canvas: &Canvas, count: usize, requests: &mut Vec<Request>) {
        let pixels = canvas.size().pixels() as u32;
        requests.extend((self.next..).take(count).map(|n| Request::centre(n % pixels)));
        self.next = (self.next + count as u32) % pixels;
    }

    fn observe(&mut self, _canvas: &Canvas, observations: &[Observation]) {
        self.told.fetch_add(observations.len() as u64, Ordering::Relaxed);
    }
}

fn grey(batch: &Batch) -> Vec<[f32; 3]> {
    vec![[0.5; 3]; batch.requests.len()]
}

/// An engine, and how many samples its sampler has been told of.
fn engine(kind: ReconstructionKind) -> (Engine<impl Tracer>, Arc<AtomicU64>) {
    let told = Arc::new(AtomicU64::new(0));
    let sampler = Box::new(InTurn { next: 0, told: Arc::clone(&told) });
    let mut engine = Engine::new(SIZE, Clock::real(), sampler, Function::new(grey));
    engine.set_reconstruction(kind.build());
    (engine, told)
}

fn run_until_kept(engine: &mut Engine<impl Tracer>, kept: u64) {
    while engine.counters().kept < kept {
        engine.step().unwrap();
    }
}

/// A picture under way, which is ready when something is sent.
fn begin(engine: &mut Engine<impl Tracer>) -> Sender<()> {
    let (ready, wait) = channel();
    let has_begun = engine.refresh_beside(engine.now(), move |picture, canvas| {
        assert_eq!((picture.len(), canvas.size()), (SIZE.pixels(), SIZE));
        wait.recv().ok();
    });
    assert!(has_begun);
    ready
}

#[test]
fn samples_go_on_and_are_told_of_afterwards() {
    let (mut engine, told) = engine(ReconstructionKind::REPROJECT);
    run_until_kept(&mut engine, 2000);
    engine.refresh(engine.now());
    let ready = begin(&mut engine);
    let (kept, before) = (engine.counters().kept, told.load(Ordering::Relaxed));
    run_until_kept(&mut engine, kept + 5000);
    assert!(engine.is_refreshing());
    assert_eq!(told.load(Ordering::Relaxed), before, "nobody can say yet what they changed");
    let newest = engine.canvas().time().max();
    ready.send(()).unwrap();
    while engine.is_refreshing() {
        engine.step().unwrap();
    }
    assert!(engine.canvas().time().max() >= newest, "a sample has become older");
    for _ in 0..10_000 {
        engine.step().unwrap();
    }
    assert_eq!(told.load(Ordering::Relaxed), engine.counters().kept);
}

#[test]
fn whatever_needs_the_reconstruction_waits_for_it() {
    let (mut engine, told) = engine(ReconstructionKind::REPROJECT);
    run_until_kept(&mut engine, 2000);
    engine.refresh(engine.now());
    for change in 0..3 {
        drop(begin(&mut engine));
        assert!(!engine.refresh_beside(engine.now(), |_, _| ()), "one at a time");
        match change {
            0 => engine.resize(Size::new(8, 8)),
            1 => engine.set_reconstruction(ReconstructionKind::REPROJECT.build()),
            _ => assert_eq!(engine.refresh(engine.now()).len(), SIZE.pixels()),
        }
        assert!(!engine.is_refreshing());
        engine.resize(SIZE);
        let kept = engine.counters().kept;
        run_until_kept(&mut engine, kept + 2000);
        engine.refresh(engine.now());
    }
    assert!(told.load(Ordering::Relaxed) > 6000);
}

#[test]
fn pictures_made_of_the_canvas_are_made_at_once() {
    let (mut hold, _) = engine(ReconstructionKind::Hold);
    run_until_kept(&mut hold, 2000);
    hold.refresh(hold.now());
    assert!(!hold.refresh_beside(hold.now(), |_, _| ()));
    let (mut first, _) = engine(ReconstructionKind::REPROJECT);
    run_until_kept(&mut first, 2000);
    assert!(!first.refresh_beside(first.now(), |_, _| ()), "the first of its size");
}
