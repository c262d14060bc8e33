//! The loop with its samplers, against what is known without running it.

use frameless::{
    Answer, Batch, Canvas, Change, Clock, Engine, EngineError, Function, Observation, Request,
    Sampler, SamplerKind, Size, Time, Tracer, hold,
};

/// Linear RGB that differs from pixel to pixel and never changes.
fn still(batch: &Batch) -> Vec<[f32; 3]> {
    let colour = |pixel: u32| [pixel as f32 * 1e-3, (pixel % 7) as f32 * 0.1, 0.5];
    batch.requests.iter().map(|r| colour(r.pixel)).collect()
}

/// The left half is still, the right half flickers for ever.
fn half_flickering(batch: &Batch) -> Vec<[f32; 3]> {
    let bright = ((batch.scene_secs * 100.0) as u64).is_multiple_of(2);
    let colour = |r: &Request| {
        let right = batch.size.xy(r.pixel).0 >= batch.size.width / 2;
        [if right && bright { 1.0 } else { 0.0 }; 3]
    };
    batch.requests.iter().map(colour).collect()
}

fn engine<F: FnMut(&Batch) -> Vec<[f32; 3]>>(
    size: Size,
    rate: f64,
    kind: SamplerKind,
    render: F,
) -> Engine<Function<F>> {
    Engine::new(size, Clock::simulated(rate), kind.build(1), Function::new(render))
}

#[test]
fn a_static_scene_converges_to_the_ideal_bit_for_bit() {
    let size = Size::new(37, 23);
    let all = Batch {
        id: 0,
        now: Time::ZERO,
        scene_secs: 0.0,
        size,
        requests: (0..size.pixels() as u32).map(Request::centre).collect(),
    };
    let ideal = still(&all);
    for kind in SamplerKind::ALL {
        let mut engine = engine(size, 20_000.0, kind, still);
        engine.run_until(Time::from_secs(2.0)).expect("finite colours");
        assert!(engine.canvas().rgb() == ideal, "{}", kind.name());
        let untraced = engine.canvas().time().filter(|&t| t == Time::ZERO).count();
        // A pixel may have been traced in the very first batch only.
        assert!(untraced <= 20, "{}: {untraced} pixels", kind.name());
    }
}

#[test]
fn the_same_seed_makes_the_same_bytes_and_another_seed_others() {
    for kind in SamplerKind::ALL {
        let run = |seed: u64| {
            let size = Size::new(64, 48);
            let mut engine = Engine::new(
                size,
                Clock::simulated(30_000.0),
                kind.build(seed),
                Function::new(half_flickering),
            );
            engine.run_until(Time::from_secs(0.5)).expect("finite colours");
            (hold(engine.canvas(), engine.display()), Vec::from_iter(engine.canvas().time()))
        };
        assert!(run(1) == run(1), "{}", kind.name());
        assert!(run(1) != run(2), "{}", kind.name());
    }
}

/// Counts how often every pixel is traced between two times.
fn counts(
    kind: SamplerKind,
    size: Size,
    rate: f64,
    secs: (f64, f64),
    render: fn(&Batch) -> Vec<[f32; 3]>,
) -> Vec<u32> {
    let mut counts = vec![0; size.pixels()];
    let mut engine = engine(size, rate, kind, |batch| {
        if batch.now >= Time::from_secs(secs.0) {
            batch.requests.iter().for_each(|r| counts[r.pixel as usize] += 1);
        }
        render(batch)
    });
    engine.run_until(Time::from_secs(secs.1)).expect("finite colours");
    drop(engine);
    counts
}

#[test]
fn in_a_static_scene_no_pixel_falls_below_the_frequency_that_w_a_promises() {
    // w_a = 0.1 promises every pixel a tenth of the uniform frequency, whatever else happens. Where nothing
    // changes it gets far more, since then all weight is on age: the floor must hold with ease.
    let (size, rate, secs) = (Size::new(70, 50), 350_000.0, 4.0);
    let counts = counts(SamplerKind::CHANGE, size, rate, (1.0, 1.0 + secs), still);
    let uniform = rate * secs / size.pixels() as f64;
    let fewest = f64::from(*counts.iter().min().expect("pixels"));
    assert!(fewest >= 0.1 * uniform, "{fewest} of {uniform}");
    assert!(fewest >= uniform - 5.5 * uniform.sqrt(), "{fewest} of {uniform}: not even by age");
}

#[test]
fn tiles_at_rest_beside_eternal_change_keep_the_frequency_that_w_a_promises() {
    let (size, rate, secs) = (Size::new(128, 64), 800_000.0, 4.0);
    let counts = counts(SamplerKind::CHANGE, size, rate, (1.0, 1.0 + secs), half_flickering);
    let floor = 0.1 * rate * secs / size.pixels() as f64;
    let mut flickering = 0.0;
    for tile_y in 0..4 {
        for tile_x in 0..8 {
            let pixels = (0..256).map(|i| (tile_y * 16 + i / 16) * 128 + tile_x * 16 + i % 16);
            let mean = pixels.map(|p| f64::from(counts[p])).sum::<f64>() / 256.0;
            // Mean of 256 Poisson counts.
            assert!(
                mean > floor - 4.0 * (floor / 256.0).sqrt(),
                "tile ({tile_x}, {tile_y}): {mean} of {floor}"
            );
            flickering += if tile_x >= 4 { mean * 256.0 } else { 0.0 };
        }
    }
    assert!(flickering > 0.7 * rate * secs, "most samples go where the change is: {flickering}");
}

#[test]
fn odd_sizes_and_tiles_work() {
    for (width, height) in [(1, 1), (1, 40), (40, 1), (16, 16), (17, 16), (33, 47)] {
        for tile in [1, 3, 16, 1000] {
            let size = Size::new(width, height);
            let kind = SamplerKind::Change { w_d: 0.9, tile };
            let mut engine = engine(size, 50_000.0, kind, half_flickering);
            engine.run_until(Time::from_secs(0.3)).expect("finite colours");
            let untraced = engine.canvas().time().filter(|&t| t == Time::ZERO).count();
            assert!(
                untraced == 0 || width * height > 1000,
                "{width}×{height}, tile {tile}: {untraced}"
            );
        }
    }
}

#[test]
fn colours_that_are_not_finite_are_refused_by_pixel_and_time() {
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        let mut engine = engine(Size::new(4, 3), 96_000.0, SamplerKind::Permutation, |batch| {
            let colour = |r: &Request| {
                if r.pixel == 6 && batch.scene_secs > 0.01 { [0.5, bad, 0.5] } else { [0.5; 3] }
            };
            batch.requests.iter().map(colour).collect()
        });
        let error = engine.run_until(Time::from_secs(0.1)).expect_err("a bad colour");
        let EngineError::NotFinite { x: 2, y: 1, scene_secs, .. } = &error else {
            panic!("{error}")
        };
        assert!(*scene_secs > 0.01);
        assert!(error.to_string().contains("pixel (2, 1)"), "{error}");
        assert!(
            engine.canvas().rgb().iter().all(|c| c == &[0.5; 3]),
            "the canvas has kept a bad colour"
        );
    }
}

#[test]
fn answers_of_the_wrong_length_are_refused() {
    let mut engine = engine(Size::new(4, 4), 96_000.0, SamplerKind::Random, |_| vec![[0.0; 3]; 3]);
    let error = engine.step().expect_err("3 colours for 100 requests");
    assert_eq!(error, EngineError::WrongLength { requests: 100, colours: 3, surfaces: 0 });
}

/// Loses every third batch, answers the others in the wrong order, and only every second pixel of them.
#[derive(Default)]
struct Unreliable {
    waiting: Vec<Batch>,
    seen: u64,
}

impl Tracer for Unreliable {
    fn submit(&mut self, batch: Batch) {
        self.seen += 1;
        if !self.seen.is_multiple_of(3) {
            self.waiting.push(batch);
        }
    }

    fn collect(&mut self, _wait: bool) -> Option<Answer> {
        let mut batch = self.waiting.pop()?;
        let mut even = false;
        batch.requests.retain(|_| {
            even = !even;
            even
        });
        let rgb = still(&batch);
        Some(Answer::to(batch, rgb, Vec::new()))
    }
}

#[test]
fn what_a_renderer_loses_is_chosen_again() {
    let size = Size::new(20, 10);
    for kind in SamplerKind::ALL {
        let mut engine =
            Engine::new(size, Clock::simulated(10_000.0), kind.build(3), Unreliable::default());
        engine.run_until(Time::from_secs(3.0)).expect("finite colours");
        let untraced = engine.canvas().time().filter(|&t| t == Time::ZERO).count();
        assert_eq!(untraced, 0, "{}", kind.name());
    }
}

/// Always keeps one batch back and answers, in turn, the newest and the oldest of two.
#[derive(Default)]
struct OutOfOrder {
    waiting: Vec<Batch>,
    answered: u32,
}

impl Tracer for OutOfOrder {
    fn submit(&mut self, batch: Batch) {
        self.waiting.push(batch);
    }

    fn collect(&mut self, _wait: bool) -> Option<Answer> {
        if self.waiting.len() < 2 {
            return None;
        }
        let newest = self.answered.is_multiple_of(2);
        self.answered += 1;
        let batch = self.waiting.remove(if newest { self.waiting.len() - 1 } else { 0 });
        let rgb = vec![[batch.id as f32; 3]; batch.requests.len()];
        Some(Answer::to(batch, rgb, Vec::new()))
    }
}

#[test]
fn a_late_answer_never_overwrites_a_newer_one() {
    let (clock, sampler) = (Clock::simulated(9_600.0), SamplerKind::Random.build(1));
    let mut engine = Engine::new(Size::new(1, 1), clock, sampler, OutOfOrder::default());
    let mut newest = Time::ZERO;
    for _ in 0..20 {
        engine.step().expect("finite colours");
        let time = engine.canvas().time_of(0);
        assert!(time >= newest);
        newest = time;
    }
    // Batches 0 to 19 of 10 samples: of 19 answers every second one came late.
    assert_eq!((engine.counters().kept, engine.counters().dropped), (100, 90));
    assert_eq!(engine.canvas().rgb()[0], [19.0; 3], "the newest answer was batch 19");
}

#[test]
fn resizing_and_changing_the_sampler_keep_the_picture() {
    let mut engine = engine(Size::new(30, 20), 600_000.0, SamplerKind::CHANGE, |batch| {
        vec![[0.25; 3]; batch.requests.len()]
    });
    engine.run_until(Time::from_secs(0.1)).expect("finite colours");
    for (kind, size) in [
        (SamplerKind::Random, (45, 10)),
        (SamplerKind::CHANGE, (7, 50)),
        (SamplerKind::Permutation, (30, 20)),
    ] {
        engine.set_sampler(kind.build(2));
        engine.resize(Size::new(size.0, size.1));
        assert!(engine.canvas().rgb().iter().all(|c| c == &[0.25; 3]), "cleared");
        engine.step().expect("finite colours");
    }
}

#[test]
fn observations_before_the_first_choice_are_harmless() {
    let mut sampler = Change::new(0.9, 16, 1);
    sampler.observe(
        &Canvas::new(Size::new(4, 4)),
        &[Observation {
            pixel: 3,
            now: Time(5),
            previous: Time(2),
            known: true,
            change: 1.0,
            refinement: None,
        }],
    );
    let mut requests = Vec::new();
    sampler.choose(Time(9), &Canvas::new(Size::new(8, 8)), 10, &mut requests);
    assert_eq!(requests.len(), 10);
}

#[test]
fn a_renderer_whose_calls_have_a_price_gets_long_batches() {
    // 2 ms per call and nothing per sample: batches of a millisecond would have one sample each.
    let render = |batch: &Batch| {
        std::thread::sleep(std::time::Duration::from_millis(2));
        still(batch)
    };
    let clock = Clock::real_for_calls(1e-3);
    let sampler = SamplerKind::Permutation.build(1);
    let mut engine = Engine::new(Size::new(64, 48), clock, sampler, Function::new(render));
    let steps: Vec<usize> = (0..40).map(|_| engine.step().expect("finite colours")).collect();
    assert_eq!(steps.iter().sum::<usize>() as u64, engine.counters().kept);
    assert!(steps[39] > 1000, "{steps:?}");
}

#[test]
fn a_loop_driven_from_outside_makes_the_same_picture() {
    let (size, rate) = (Size::new(40, 30), 30_000.0);
    for kind in SamplerKind::ALL {
        let mut inside = engine(size, rate, kind, half_flickering);
        let mut outside = engine(size, rate, kind, half_flickering);
        for _ in 0..200 {
            inside.step().expect("finite colours");
            let batch = outside.choose(usize::MAX);
            let rgb = half_flickering(&batch);
            outside.answer(Answer::to(batch, rgb, Vec::new())).expect("finite colours");
        }
        assert!(inside.canvas() == outside.canvas(), "{}", kind.name());
        assert_eq!(inside.counters(), outside.counters());
    }
}

#[test]
fn answers_to_a_canvas_before_the_last_resize_are_dropped_whatever_its_size_was() {
    let (large, small) = (Size::new(30, 20), Size::new(8, 8));
    for kind in SamplerKind::ALL {
        let mut engine = engine(large, 30_000.0, kind, still);
        let old = engine.choose(usize::MAX);
        engine.resize(small);
        let middle = engine.choose(usize::MAX);
        engine.resize(large);
        let new = engine.choose(usize::MAX);
        for (batch, is_kept) in [(old, false), (middle, false), (new, true)] {
            let rgb = still(&batch);
            let wanted = if is_kept { batch.requests.len() } else { 0 };
            let kept = engine.answer(Answer::to(batch, rgb, Vec::new())).expect("finite colours");
            assert_eq!(kept, wanted, "{}", kind.name());
        }
        assert!(engine.counters().dropped > 0);
    }
}
