//! What rests adds up: antialiasing, and renderers with noise.

mod world;

use frameless::{
    Display, Engine, ReconstructionKind, ReprojectOptions, ReprojectStage, Request, SamplerKind,
};
use world::*;

const ANTIALIAS: ReconstructionKind = ReconstructionKind::Reproject(ReprojectOptions {
    relight: false,
    deep: false,
    antialias: true,
    without: None,
});

const DISC: fn(f64) -> [f32; 3] = |_| [40.0, 30.0, 14.3];

/// The mean of the first `samples` of every pixel's sequence.
fn mean(world: &World, secs: f64, samples: u32) -> Vec<[f32; 3]> {
    let of_pixel = |pixel: u32| {
        let colours = (0..samples).map(|i| world.trace(secs, &Request::in_sequence(pixel, i)).0);
        let sum = colours.fold([0.0; 3], |s, c| std::array::from_fn(|k| s[k] + c[k]));
        Display::default().encode(sum.map(|c: f32| c / samples as f32))
    };
    (0..SIZE.pixels() as u32).map(of_pixel).collect()
}

#[test]
fn a_picture_at_rest_becomes_the_mean_of_64_samples() {
    let world = world(STILL, DISC);
    let mut engine = engine(world, ANTIALIAS, 400_000.0);
    let (early, secs) = play(&mut engine, 12);
    let ideal = mean(&world, secs, 64);
    let (picture, secs) = play(&mut engine, 150);
    let (_, most) = differences(&picture, &ideal);
    assert!(most < 1e-4, "{most}");
    assert!(rmse(&early, &ideal) > 2e-3, "no wonder");
    assert!(rmse(&world.ideal(secs), &ideal) > 5e-3, "one sample is not enough");
}

#[test]
fn edges_are_refined_before_what_is_all_one_colour() {
    let world = world(STILL, DISC);
    let mut engine = engine(world, ANTIALIAS, 400_000.0);
    let (picture, secs) = play(&mut engine, 30);
    // 200,000 samples are 29 per pixel: where it matters there are nearly all.
    let ideal = mean(&world, secs, 64);
    let mean_count =
        engine.canvas().samples().iter().map(|&n| f32::from(n)).sum::<f32>() / SIZE.pixels() as f32;
    assert!(mean_count < 40.0, "{mean_count}");
    assert!(rmse(&picture, &ideal) < 1.5e-3, "{}", rmse(&picture, &ideal));
}

#[test]
fn what_changes_begins_anew_and_what_rests_goes_on() {
    // The left half grows dark at 0.5 s.
    let light = |secs: f64, [x, _]: [f32; 2]| if secs > 0.5 && x < 30.0 { 0.4 } else { 1.0 };
    for noise in [0.0, 0.3] {
        let world = World { light, noise, ..world(STILL, DISC) };
        let mut engine = engine(world, ANTIALIAS, 400_000.0);
        play(&mut engine, 30);
        let before = engine.canvas().samples().to_vec();
        let (picture, secs) = play(&mut engine, 12);
        let error = rmse(&picture, &mean(&World { noise: 0.0, ..world }, secs, 64));
        assert!(error < 0.05 * noise + 0.01, "noise {noise}: {error}");
        for (pixel, (&then, &now)) in before.iter().zip(engine.canvas().samples()).enumerate() {
            let x = pixel as u32 % SIZE.width;
            let is_far = x > 30 && world.trace(0.0, &Request::centre(pixel as u32)).1.object == 0;
            assert!(!is_far || now >= then, "pixel {pixel} began anew: {then} {now}");
        }
    }
}

/// RMSE against the ideal of a world at rest, as adaptive sampling and as the same number of samples spread evenly.
fn with_noise(samples_per_pixel: u32) -> [f32; 2] {
    let world = World { noise: 0.6, ..world(STILL, NO_DISC) };
    let refreshes = 60;
    let rate = f64::from(samples_per_pixel) * SIZE.pixels() as f64;
    let mut engine = engine(world, ANTIALIAS, rate);
    let (picture, secs) = play(&mut engine, refreshes);
    let ideal = world.ideal(secs);
    let evenly = mean(&World { ..world }, secs, samples_per_pixel);
    [rmse(&picture, &ideal), rmse(&evenly, &ideal)]
}

#[test]
fn a_noisy_picture_at_rest_converges_like_a_plain_mean() {
    for samples_per_pixel in [16, 64, 256] {
        let [ours, evenly] = with_noise(samples_per_pixel);
        eprintln!("{samples_per_pixel} samples per pixel: {ours}, evenly {evenly}");
        assert!(ours < 1.03 * evenly);
    }
}

#[test]
fn few_noisy_samples_borrow_from_those_around() {
    let world = World { noise: 0.6, ..world(STILL, NO_DISC) };
    let error = |without: Option<ReprojectStage>| {
        let options = ReprojectOptions { antialias: true, without, ..ReprojectOptions::default() };
        let kind = ReconstructionKind::Reproject(options);
        let mut engine = engine(world, kind, 8.0 * SIZE.pixels() as f64);
        let (picture, secs) = play(&mut engine, 60);
        rmse(&picture, &world.ideal(secs))
    };
    let [with, alone] = [None, Some(ReprojectStage::Borrow)].map(error);
    assert!(with < 0.75 * alone, "{with}, alone {alone}");
}

#[test]
fn who_begins_anew_is_soon_level_with_the_others() {
    let light = |secs: f64, [x, _]: [f32; 2]| if secs > 1.5 && x < 12.0 { 0.4 } else { 1.0 };
    let world = World { light, noise: 0.6, ..world(STILL, NO_DISC) };
    let samples_per_sec = 20.0 * SIZE.pixels() as f64;
    let mut engine = engine(world, ANTIALIAS, samples_per_sec);
    play(&mut engine, 90);
    let mean = |engine: &Engine<Renderer>, columns: std::ops::Range<u32>| {
        let is_there = |pixel: &u32| columns.contains(&(pixel % SIZE.width));
        let pixels: Vec<u32> = (0..SIZE.pixels() as u32).filter(is_there).collect();
        let counts = pixels.iter().map(|&p| f32::from(engine.canvas().samples()[p as usize]));
        counts.sum::<f32>() / pixels.len() as f32
    };
    let before = mean(&engine, 14..96);
    assert!((24.0..34.0).contains(&before), "{before}");
    // An eighth of the picture wants 30 samples each, of the 20 for each pixel of it all in a second.
    play(&mut engine, 24);
    let [anew, others] = [mean(&engine, 0..10), mean(&engine, 14..96)];
    assert!(anew > 0.6 * others, "{anew}, others {others}");
    assert!(others >= before);
}

#[test]
fn an_object_that_moves_through_noise_restarts_only_what_it_touches() {
    let disc = |secs: f64| {
        let x = if secs < 0.5 { 15.0 } else { 15.0 + 40.0 * (secs as f32 - 0.5) };
        [x, 20.0, 8.0]
    };
    let world = World { noise: 0.4, ..world(STILL, disc) };
    let mut engine = engine(world, ANTIALIAS, 700_000.0);
    play(&mut engine, 30);
    let before = engine.canvas().samples().to_vec();
    let (_, secs) = play(&mut engine, 15);
    let [left, right] = [15.0, disc(secs)[0]];
    for (pixel, (&then, &now)) in before.iter().zip(engine.canvas().samples()).enumerate() {
        let (x, y) = SIZE.xy(pixel as u32);
        let nearest = (x as f32).clamp(left, right);
        let distance = (x as f32 - nearest).hypot(y as f32 - 20.0);
        if distance > 8.0 + 3.0 {
            assert!(now >= then, "pixel {x} {y} began anew: {then} {now}");
        }
    }
}

#[test]
fn whoever_chooses_pixels_noise_is_averaged() {
    const SAMPLES_PER_PIXEL: u32 = 64;
    for kind in SamplerKind::ALL {
        let world = World { noise: 0.6, ..world(STILL, NO_DISC) };
        let rate = f64::from(SAMPLES_PER_PIXEL) * SIZE.pixels() as f64;
        let mut engine = engine(world, ANTIALIAS, rate);
        engine.set_sampler(kind.build(1));
        let (picture, secs) = play(&mut engine, 60);
        // With most samplers one look in four is at the first sample again, and some pixels get fewer than others.
        let evenly = mean(&world, secs, SAMPLES_PER_PIXEL * 3 / 4);
        let (ours, evenly) =
            (rmse(&picture, &world.ideal(secs)), rmse(&evenly, &world.ideal(secs)));
        assert!(ours < 1.25 * evenly, "{kind:?}: {ours}, evenly {evenly}");
    }
}

#[test]
fn whoever_chooses_pixels_what_jumps_leaves_nothing_behind() {
    let disc = |secs: f64| [if secs < 2.01 { 30.0 } else { 50.0 }, 30.0, 14.3];
    for kind in SamplerKind::ALL {
        let world = world(STILL, disc);
        let mut engine = engine(world, ANTIALIAS, 400_000.0);
        engine.set_sampler(kind.build(1));
        let (picture, secs) = play(&mut engine, 120);
        let at_rest = rmse(&picture, &mean(&world, secs, 64));
        assert!(at_rest < 1e-3, "{kind:?}: {at_rest}");
        let (picture, secs) = play(&mut engine, 120);
        let (_, most) = differences(&picture, &mean(&world, secs, 64));
        assert!(most < 0.1, "{kind:?}: {most}");
    }
}
