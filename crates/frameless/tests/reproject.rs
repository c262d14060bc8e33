//! The adaptive sampler and its reconstructions, on a world whose picture is known in closed form.

mod world;

use frameless::{
    AdaptiveOptions, AdaptiveStage, ReconstructionKind, ReprojectOptions, ReprojectStage, Rng,
    SamplerKind, Time, Weights,
};
use world::*;

#[test]
fn samples_follow_a_camera_that_translates_turns_and_zooms() {
    for camera in [translating, rotating, zooming] {
        let world = world(camera, NO_DISC);
        // A fifth of the pixels per refresh.
        let error = |kind| {
            let (picture, secs) = play(&mut engine(world, kind, 83_000.0), 40);
            rmse(&picture, &world.ideal(secs))
        };
        let [hold, filter, reproject, deep] = KINDS.map(error);
        assert!(filter < hold, "{filter} {hold}");
        assert!(reproject < 0.5 * hold, "{reproject} {hold}");
        assert!(deep < 0.5 * hold, "{deep} {hold}");
    }
}

#[test]
fn no_sample_of_one_object_is_gathered_for_another() {
    let disc = |secs: f64| [20.0 + 60.0 * secs as f32, 36.0, 14.0];
    for kind in [ReconstructionKind::REPROJECT, DEEP] {
        let mut engine = engine(world(rotating, disc), kind, 60_000.0);
        play(&mut engine, 10);
        let red = frameless::Display::default().encode([0.8, 0.0, 0.0])[0];
        for _ in 0..30 {
            let (picture, secs) = play(&mut engine, 1);
            for (pixel, rgb) in picture.iter().enumerate() {
                let is_disc = (rgb[0] - red).abs() < 1e-5 && rgb[1] < 1e-5 && rgb[2] < 1e-5;
                assert!(is_disc || rgb[0] == 0.0, "pixel {pixel} at {secs} s is mixed: {rgb:?}");
            }
        }
    }
}

/// A disc that stays in the picture while the plane behind it, of one colour, passes by: the mean error, and how many pixels show it beside it.
fn before_a_plain_plane(kind: ReconstructionKind, rate: f64) -> (f32, usize) {
    let passing: Camera = |secs| [[1.0, 0.0, 300.0 * secs as f32], [0.0, 1.0, 0.0]];
    let disc = |secs: f64| {
        let secs = secs as f32;
        [48.0 + 3.0 * (4.0 * secs).sin() - 300.0 * secs, 36.0, 14.0]
    };
    // This light takes the plane's texture away.
    let world = World {
        light: |_, [x, y]| 0.4 / (0.3 + 0.2 * (0.35 * x).sin() * (0.3 * y).cos()),
        ..world(passing, disc)
    };
    let mut engine = engine(world, kind, rate);
    play(&mut engine, 20);
    let (mut error, mut wider) = (0.0, 0);
    for _ in 0..40 {
        let (picture, secs) = play(&mut engine, 1);
        let ideal = world.ideal(secs);
        error += rmse(&picture, &ideal) / 40.0;
        let is_disc = |rgb: &[f32; 3]| rgb[0] > 0.1;
        let pairs = picture.iter().zip(&ideal);
        wider += pairs.filter(|(shown, ideal)| is_disc(shown) && !is_disc(ideal)).count();
    }
    (error, wider)
}

#[test]
fn a_small_thing_before_an_empty_background_is_not_made_wider() {
    for rate in [120_000.0, 240_000.0, 480_000.0] {
        let (hold, _) = before_a_plain_plane(ReconstructionKind::Hold, rate);
        let (reproject, wider) = before_a_plain_plane(ReconstructionKind::REPROJECT, rate);
        // Of 88 pixels around the disc, and 40 pictures.
        assert!(wider < 88 * 40 / 10, "{rate}: {wider}");
        // A pixel at its edge is held for no longer than a refresh here, and no texture shows that the plane has been held.
        assert!(reproject < 1.75 * hold, "{rate}: {reproject} {hold}");
    }
}

#[test]
fn a_picture_at_rest_is_the_held_one_bit_for_bit_also_after_motion() {
    let stopping: Camera = |secs| rotating(secs.min(0.4));
    let disc = |secs: f64| [20.0 + 60.0 * secs.min(0.4) as f32, 36.0, 14.0];
    for kind in KINDS {
        let world = world(stopping, disc);
        let mut engine = engine(world, kind, 83_000.0);
        let (picture, secs) = play(&mut engine, 24 + 40);
        assert_eq!(differences(&picture, &world.ideal(secs)), (0, 0.0), "{kind:?}");
        let again = engine.refresh(Time::from_secs(secs));
        assert_eq!(differences(&picture, again), (0, 0.0), "{kind:?}");
    }
}

#[test]
fn no_pixel_grows_older_than_its_share_of_the_even_part_allows() {
    // Of every batch holes take at most 40 %, fronts 60 % and late looks 40 % of the rest, and the even part is a fifth of what is left.
    let of_plain = 0.6 * 0.4 * 0.6 * 0.2;
    for rate in [83_000.0, 360_000.0, 400_000.0] {
        KINDS.into_iter().for_each(|kind| check_oldest(kind, rate, of_plain));
    }
    // While something is refined, 3 %.
    check_oldest(ReconstructionKind::default(), 400_000.0, 0.15 * of_plain);
}

fn check_oldest(kind: ReconstructionKind, rate: f64, least_share: f64) {
    let disc = |secs: f64| [48.0 + 30.0 * (5.0 * secs).sin() as f32, 36.0, 10.0];
    let bound_secs = 1.5 * SIZE.pixels() as f64 / (rate * least_share);
    let mut engine = engine(world(STILL, disc), kind, rate);
    let (_, secs) = play(&mut engine, (1.4 * 60.0 * bound_secs) as u64);
    let oldest = engine.canvas().time().min().expect("pixels");
    let age_secs = Time::from_secs(secs).secs_since(oldest);
    assert!(age_secs < bound_secs, "{kind:?}: {age_secs} s, at most {bound_secs} s");
}

#[test]
fn equal_seeds_make_equal_pictures() {
    let disc = |secs: f64| [20.0 + 60.0 * secs as f32, 36.0, 14.0];
    for kind in KINDS {
        let run = || play(&mut engine(world(rotating, disc), kind, 50_000.0), 12).0;
        assert_eq!(differences(&run(), &run()), (0, 0.0), "{kind:?}");
    }
}

#[test]
fn colours_without_surfaces_stay_where_they_are_among_those_with() {
    let world = World { surfaces: |batch| batch % 2 == 0, ..world(STILL, NO_DISC) };
    for kind in KINDS {
        let mut engine = engine(world, kind, 83_000.0);
        let (picture, secs) = play(&mut engine, 40);
        assert_eq!(differences(&picture, &world.ideal(secs)), (0, 0.0), "{kind:?}");
    }
}

#[test]
fn colours_without_surfaces_mix_with_those_that_move() {
    // Who does not tell its surface stays where it is while the others move on; at rest nothing is left of either.
    let stopping: Camera = |secs| translating(secs.min(0.4));
    for kind in [ReconstructionKind::REPROJECT, DEEP] {
        let errors = [|_| true, (|batch| batch % 8 != 0) as fn(u32) -> bool].map(|surfaces| {
            let world = World { surfaces, ..world(stopping, |_| [48.0, 36.0, 20.0]) };
            let mut engine = engine(world, kind, 83_000.0);
            let (picture, secs) = play(&mut engine, 24);
            let moving = rmse(&picture, &world.ideal(secs));
            let (picture, secs) = play(&mut engine, 40);
            assert_eq!(differences(&picture, &world.ideal(secs)), (0, 0.0), "{kind:?}");
            moving
        });
        let [told, untold] = errors;
        assert!(untold < 4.0 * told, "{kind:?}: {untold} where an eighth is not told, else {told}");
    }
}

#[test]
fn where_everything_changes_everybody_is_looked_at_alike() {
    // Each pixel flickers by itself, a hundred times a second: nothing can be followed, foreseen or learned.
    let flicker = |secs: f64, [x, y]: [f32; 2]| {
        let place = (x.floor() as u64) << 32 | (y.floor() as u64) << 16;
        0.2 + 0.8 * Rng::new(place | (100.0 * secs) as u64).unit_f32()
    };
    let rate = 83_000.0;
    for kind in KINDS {
        let world = World { light: flicker, ..world(STILL, NO_DISC) };
        let mut engine = engine(world, kind, rate);
        let (_, secs) = play(&mut engine, 60);
        let ages = engine.canvas().time().map(|time| Time::from_secs(secs).secs_since(time));
        let passes = ages.fold(0.0, f64::max) * rate / SIZE.pixels() as f64;
        assert!(passes < 2.0, "{kind:?}: the oldest pixel has waited for {passes} passes");
    }
}

#[test]
fn from_one_sample_per_batch_to_ten_times_the_picture() {
    let disc = |secs: f64| [20.0 + 60.0 * secs as f32, 36.0, 14.0];
    for kind in KINDS {
        for rate in [960.0, 960.0 * 70_000.0] {
            let mut engine = engine(world(rotating, disc), kind, rate);
            let (picture, _) = play(&mut engine, 2);
            assert!(picture.iter().flatten().all(|c| (0.0..=1.0).contains(c)), "{kind:?} {rate}");
        }
    }
}

#[test]
fn a_cut_leaves_nothing_of_the_picture_before() {
    let cutting: Camera =
        |secs| if secs < 0.3 { STILL(secs) } else { [[1.0, 0.0, 5000.0], [0.0, 1.0, 0.0]] };
    for kind in KINDS {
        let world = world(cutting, |_| [48.0, 36.0, 20.0]);
        let mut engine = engine(world, kind, 83_000.0);
        let (picture, secs) = play(&mut engine, 18 + 40);
        assert_eq!(differences(&picture, &world.ideal(secs)), (0, 0.0), "{kind:?}");
    }
}

#[test]
fn a_picture_of_which_nothing_is_known_appears_everywhere_at_once() {
    let world = world(STILL, NO_DISC);
    let mut engine = engine(world, ReconstructionKind::REPROJECT, 83_000.0);
    // A fifth of the pixels: every pixel has a neighbour that was traced.
    let (picture, secs) = play(&mut engine, 1);
    let error = rmse(&picture, &world.ideal(secs));
    assert!(error < 0.05, "{error}");
    assert!(picture.iter().all(|c| c[1] > 0.1), "no pixel is black");
}

#[test]
fn the_sampler_is_told_how_tiles_move_if_it_wants_to_know() {
    let disc = |secs: f64| [20.0 + 60.0 * secs as f32, 36.0, 14.0];
    let mut engine = engine(world(translating, disc), ReconstructionKind::REPROJECT, 83_000.0);
    play(&mut engine, 10);
    assert!(engine.canvas().tile_motion().is_empty(), "nobody asked");
    assert_eq!(engine.canvas().tile_contrast().len(), 12 * 9);
    engine.set_weights(&Weights::default().with_flow(1.0).expect("valid"));
    let (_, secs) = play(&mut engine, 20);
    // The disc's middle in the picture, and a corner where the plane is seen.
    let [x, y] = [20.0 + 100.0 * secs, 36.0 - 25.0 * secs].map(|c| c as usize / 8);
    let expected = [(y * 12 + x, [100.0, -25.0]), (11, [40.0, -25.0])];
    for (tile, px_per_sec) in expected {
        let motion = engine.canvas().tile_motion()[tile].expect("something is seen there");
        for (is, per_sec) in motion.into_iter().zip(px_per_sec) {
            assert!((is - per_sec / 60.0).abs() < 1e-3, "tile {tile}: {motion:?}");
        }
    }
}

#[test]
fn the_edge_of_a_moving_shadow_is_looked_at_just_before_it_is_shown() {
    // Moves half a pixel from one refresh to the next, as the lamp turns.
    let edge = |secs: f64, [x, _]: [f32; 2]| f32::from(u8::from(x > 10.2 + 30.0 * secs as f32));
    let turning = |secs: f64| {
        let (sin, cos) = (0.1 * secs as f32).sin_cos();
        [sin, 0.0, cos]
    };
    let world = World { light: edge, lamp_direction: turning, ..world(STILL, NO_DISC) };
    let options = ReprojectOptions { relight: true, ..ReprojectOptions::default() };
    let wrong = |without: Option<AdaptiveStage>| {
        let mut engine = engine(world, ReconstructionKind::Reproject(options), 83_000.0);
        let adaptive = AdaptiveOptions { without, ..AdaptiveOptions::default() };
        engine.set_sampler(SamplerKind::Adaptive(adaptive).build(1));
        let wrong = (0..30).map(|refresh| {
            let (picture, secs) = play(&mut engine, 1);
            let ideal = world.ideal(secs);
            let differ = |(a, b): &(&[f32; 3], &[f32; 3])| (a[1] - b[1]).abs() > 0.05;
            let wrong = picture.iter().zip(&ideal).filter(differ).count();
            if refresh < 10 { 0 } else { wrong }
        });
        wrong.sum::<usize>()
    };
    let (with, without) = (wrong(None), wrong(Some(AdaptiveStage::Late)));
    println!("{with} pixels wrong with late looks, {without} without");
    assert!(4 * with < without, "{with} with late looks, {without} without");
}

#[test]
fn what_comes_before_everything_hides_it_with_the_first_samples() {
    let world = world(STILL, |secs| [48.0, 36.0, if secs < 0.3 { 0.1 } else { 200.0 }]);
    let shining_through = |without: Option<ReprojectStage>| {
        let options = ReprojectOptions { without, ..ReprojectOptions::default() };
        // A fifteenth of the pixels per refresh.
        let mut engine = engine(world, ReconstructionKind::Reproject(options), 28_000.0);
        let (picture, secs) = play(&mut engine, 18 + 3);
        let ideal = world.ideal(secs);
        let is_wrong = |(a, b): &(&[f32; 3], &[f32; 3])| (a[0] - b[0]).abs() > 0.1;
        picture.iter().zip(&ideal).filter(is_wrong).count()
    };
    let (with, without) = (shining_through(None), shining_through(Some(ReprojectStage::Covers)));
    println!("{with} pixels wrong, {without} where what is covered stays");
    assert!(20 * with < without, "{with} with, {without} without");
}

#[test]
fn every_stage_that_is_left_out_makes_a_difference() {
    // Turns, approaches and stops, so that every stage has something to do.
    let camera: Camera = |secs| {
        let ([[a, b, c], [d, e, f]], [[zoom, ..], _]) =
            (rotating(secs.min(0.4)), zooming(secs.min(0.4)));
        [[zoom * a, b, c], [d, zoom * e, f]]
    };
    let disc = |secs: f64| [20.0 + 60.0 * secs.min(0.4) as f32, 36.0, 14.0];
    let last = |without: Option<AdaptiveStage>, omitted: Option<ReprojectStage>| {
        let options = ReprojectOptions { without: omitted, ..ReprojectOptions::default() };
        let mut engine =
            engine(world(camera, disc), ReconstructionKind::Reproject(options), 40_000.0);
        let sampler =
            SamplerKind::Adaptive(AdaptiveOptions { without, ..AdaptiveOptions::default() });
        engine.set_sampler(sampler.build(1));
        (0..30).flat_map(|_| play(&mut engine, 1).0).collect::<Vec<_>>()
    };
    let whole = last(None, None);
    assert_eq!(differences(&whole, &last(None, None)), (0, 0.0));
    // No shadow moves here: see the test of late looks.
    for stage in AdaptiveStage::ALL.into_iter().filter(|stage| *stage != AdaptiveStage::Late) {
        assert!(differences(&whole, &last(Some(stage), None)).0 > 0, "{stage:?}");
    }
    // Nor does anything come before everything, nor is there noise: see the tests of covers and of borrowing.
    let elsewhere = [ReprojectStage::Covers, ReprojectStage::Borrow];
    for stage in ReprojectStage::ALL.into_iter().filter(|stage| !elsewhere.contains(stage)) {
        assert!(differences(&whole, &last(None, Some(stage))).0 > 0, "{stage:?}");
    }
}

#[test]
fn a_lamp_that_changes_shows_at_the_next_refresh() {
    // Dims at 0.3 s, then flickers.
    let lamp = |secs: f64| match secs {
        s if s < 0.3 => 1.0,
        s if s < 0.4 => 0.3,
        s => 0.6 + 0.3 * (40.0 * s).sin() as f32,
    };
    for (camera, of_motion) in [(STILL, 0.0), (translating as Camera, 0.06)] {
        let world = World { lamp, ..world(camera, |_| [48.0, 36.0, 20.0]) };
        let errors = [true, false].map(|relight| {
            let options = ReprojectOptions { relight, ..ReprojectOptions::default() };
            let kind = ReconstructionKind::Reproject(options);
            let mut engine = engine(world, kind, 60_000.0);
            play(&mut engine, 18);
            let mut worst = 0.0f32;
            for _ in 0..20 {
                let (picture, secs) = play(&mut engine, 1);
                worst = worst.max(rmse(&picture, &world.ideal(secs)));
            }
            worst
        });
        let [with, without] = errors;
        // What is left is of the motion alone.
        assert!(with < of_motion + 0.001, "{with}");
        assert!(without > 0.1, "{without}");
    }
}

#[test]
fn a_lamp_that_stays_changes_nothing() {
    let world = world(STILL, |_| [48.0, 36.0, 20.0]);
    let options = ReprojectOptions { relight: true, ..ReprojectOptions::default() };
    let mut engine = engine(world, ReconstructionKind::Reproject(options), 83_000.0);
    let (picture, secs) = play(&mut engine, 40);
    assert_eq!(differences(&picture, &world.ideal(secs)), (0, 0.0));
}

#[test]
fn after_two_refreshes_at_one_time_every_request_lies_in_its_pixel() {
    let disc = |secs: f64| [20.0 + 60.0 * secs as f32, 36.0, 14.0];
    let mut engine = engine(world(STILL, disc), ReconstructionKind::REPROJECT, 83_000.0);
    play(&mut engine, 10);
    let now = engine.now();
    engine.refresh(now);
    // The renderer is given another camera between the two.
    engine.tracer_mut().world.camera = |_| [[1.0, 0.0, 3.3], [0.0, 1.0, -2.2]];
    engine.refresh(now);
    let asked = engine.choose(1000).requests;
    let is_inside = |request: &frameless::Request| request.offset.iter().all(|o| o.abs() <= 0.5);
    assert!(!asked.is_empty() && asked.iter().all(is_inside), "{asked:?}");
}
