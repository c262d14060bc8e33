//! A picture that is made beside the loop holds up nothing and loses nothing.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::Duration;

use frameless::{
    Answer, Batch, Canvas, Clock, Engine, Function, Observation, ReconstructionKind, Request,
    Sampler, Size, Time, Tracer,
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

/// A renderer in a thread of its own that takes 10 µs per sample.
struct InThread {
    asked: Sender<Batch>,
    answered: Receiver<Answer>,
    /// How long batches have been.
    lengths: Vec<usize>,
    /// Whether it has threads left beside a picture.
    has_others: bool,
}

impl InThread {
    fn start(has_others: bool) -> InThread {
        let (asked, asks) = channel::<Batch>();
        let (answers, answered) = channel();
        std::thread::spawn(move || {
            for batch in asks {
                std::thread::sleep(Duration::from_micros(10) * batch.requests.len() as u32);
                let rgb = grey(&batch);
                if answers.send(Answer::to(batch, rgb, Vec::new())).is_err() {
                    return;
                }
            }
        });
        InThread { asked, answered, lengths: Vec::new(), has_others }
    }
}

impl Tracer for InThread {
    fn submit(&mut self, batch: Batch) {
        self.lengths.push(batch.requests.len());
        self.asked.send(batch).expect("the thread lives");
    }

    fn collect(&mut self, _wait: bool) -> Option<Answer> {
        self.answered.recv().ok()
    }

    fn spare_threads(&mut self, _threads: usize) -> bool {
        self.has_others
    }
}

fn run_for(engine: &mut Engine<impl Tracer>, secs: f64) {
    let end = Time::from_secs(engine.now().secs() + secs);
    while engine.now() < end {
        std::thread::sleep(engine.pause());
        engine.step().unwrap();
    }
}

fn run_until_kept(engine: &mut Engine<impl Tracer>, kept: u64) {
    while engine.counters().kept < kept {
        engine.step().unwrap();
    }
}

/// A picture under way, which is ready when something is sent.
fn begin(engine: &mut Engine<impl Tracer>) -> Sender<()> {
    let (ready, wait) = channel();
    let show = move |picture: &[[f32; 3]], canvas: &Canvas| {
        assert_eq!((picture.len(), canvas.size()), (SIZE.pixels(), SIZE));
        wait.recv().ok();
    };
    engine.refresh_beside(engine.now(), show, || ());
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

/// Samples in 100 ms without a picture and then in as long beside one, and the longest batches before and during it. Some 10,000 without
/// one, fewer where others use the machine.
fn beside_a_picture(has_others: bool) -> ([u64; 2], [usize; 2]) {
    let sampler = Box::new(InTurn { next: 0, told: Arc::default() });
    let renderer = InThread::start(has_others);
    let mut engine = Engine::new(SIZE, Clock::real(), sampler, renderer);
    engine.set_reconstruction(ReconstructionKind::REPROJECT.build());
    run_for(&mut engine, 0.2);
    let first = engine.counters().kept;
    run_for(&mut engine, 0.1);
    let without = engine.counters().kept - first;
    engine.refresh(engine.now());
    let (before, batches) = (engine.counters().kept, engine.tracer().lengths.len());
    let picture = begin(&mut engine);
    assert_eq!(engine.pause().is_zero(), has_others);
    run_for(&mut engine, 0.1);
    assert!(engine.is_refreshing());
    drop(picture);
    let kept = engine.counters().kept - before;
    engine.end_refresh();
    assert!(engine.pause().is_zero());
    let (alone, beside) = engine.tracer().lengths.split_at(batches);
    ([without, kept], [alone, beside].map(|lengths| *lengths.iter().max().unwrap()))
}

#[test]
fn a_renderer_works_on_while_a_picture_is_made() {
    let ([without, kept], [alone, beside]) = beside_a_picture(true);
    assert!(10 * kept > 3 * without, "{kept} samples, and {without} without a picture");
    assert!(beside < 2 * alone, "batches of {beside} samples, before that {alone}");
}

#[test]
fn a_renderer_without_threads_gives_way_to_the_picture() {
    let ([_, kept], [alone, beside]) = beside_a_picture(false);
    // At most 50 turns, of which two are of batches that had begun before.
    assert!((10..2500).contains(&kept), "{kept} samples");
    assert!(beside <= alone / 2 + 1, "batches of {beside} samples, before that {alone}");
}

#[test]
fn whatever_needs_the_reconstruction_waits_for_it() {
    let (mut engine, told) = engine(ReconstructionKind::REPROJECT);
    run_until_kept(&mut engine, 2000);
    engine.refresh(engine.now());
    for change in 0..3 {
        drop(begin(&mut engine));
        assert!(!engine.can_refresh_beside(), "one at a time");
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
    assert!(!hold.can_refresh_beside());
    let (mut first, _) = engine(ReconstructionKind::REPROJECT);
    run_until_kept(&mut first, 2000);
    assert!(!first.can_refresh_beside(), "the first of its size");
}
