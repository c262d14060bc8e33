//! What comes and goes, and how a picture sharpens after a large change, on a world whose picture is known in closed form.

mod world;

use frameless::{ReconstructionKind, ReprojectOptions};
use world::*;

const ANTIALIAS: ReconstructionKind = ReconstructionKind::Reproject(ReprojectOptions {
    relight: false,
    deep: false,
    antialias: true,
    without: None,
});

/// The middle of the disc that comes and goes, and its radius.
const DISC: [f32; 3] = [48.0, 36.0, 12.0];

/// Pixels that are off by more than a tenth in any channel: of the disc without its edge, which may be antialiased, and of what is not near it.
fn wrong(picture: &[[f32; 3]], ideal: &[[f32; 3]]) -> [usize; 2] {
    let mut counts = [0; 2];
    for (pixel, (a, b)) in (0..).zip(picture.iter().zip(ideal)) {
        let (x, y) = SIZE.xy(pixel);
        let off_centre = (x as f32 + 0.5 - DISC[0]).hypot(y as f32 + 0.5 - DISC[1]);
        let is_wrong = (0..3).any(|k| (a[k] - b[k]).abs() > 0.1);
        counts[0] += usize::from(is_wrong && off_centre < DISC[2] - 1.0);
        counts[1] += usize::from(is_wrong && off_centre > DISC[2] + 8.0);
    }
    counts
}

#[test]
fn what_appears_is_shown_soon_and_what_vanishes_leaves_nothing_behind() {
    let disc = |secs: f64| {
        let [x, y, radius] = DISC;
        [x, y, if (0.501..1.001).contains(&secs) { radius } else { -1.0 }]
    };
    for kind in [KINDS.as_slice(), &[ReconstructionKind::default()]].concat() {
        let world = world(STILL, disc);
        let mut engine = engine(world, kind, 83_000.0);
        play(&mut engine, 30);
        for what in ["appears", "vanishes"] {
            // A fifth of the pixels is looked at from one refresh to the next, the neighbours of what has changed first.
            for refresh in 0..30 {
                let (picture, secs) = play(&mut engine, 1);
                let [inside, beyond] = wrong(&picture, &world.ideal(secs));
                assert!(refresh < 6 || inside == 0, "{kind:?} {what} {refresh}: {inside} pixels");
                assert_eq!(beyond, 0, "{kind:?} {what} {refresh}: what has not changed");
            }
        }
        let (picture, secs) = play(&mut engine, 40);
        if kind != ReconstructionKind::default() {
            assert_eq!(differences(&picture, &world.ideal(secs)), (0, 0.0), "{kind:?}");
        }
    }
}

#[test]
fn after_a_large_change_the_picture_is_right_everywhere_soon_and_never_coarser_again() {
    // Everything left of the middle grows dark at 0.5 s.
    let light = |secs: f64, [x, _]: [f32; 2]| if secs > 0.5 && x < 48.0 { 0.3 } else { 1.0 };
    for kind in [ReconstructionKind::REPROJECT, DEEP, ANTIALIAS] {
        let world = World { light, ..world(STILL, NO_DISC) };
        let mut engine = engine(world, kind, 83_000.0);
        play(&mut engine, 30);
        let mut errors = Vec::new();
        for _ in 0..60 {
            let (picture, secs) = play(&mut engine, 1);
            errors.push(rmse(&picture, &world.ideal(secs)));
        }
        assert!(
            errors[0] < 0.15 && errors[2] < 0.01,
            "{kind:?}: coarse and everywhere: {errors:?}"
        );
        let coarser = errors.windows(2).position(|pair| pair[1] > 1.1 * pair[0] + 5e-4);
        assert_eq!(coarser, None, "{kind:?}: {errors:?}");
    }
}

#[test]
fn whatever_changes_no_pixel_grows_older_than_its_share_of_the_even_part_allows() {
    let disc = |secs: f64| [48.0 + 30.0 * (5.0 * secs).sin() as f32, 36.0, 10.0];
    let flicker = |secs: f64, _: [f32; 2]| if (30.0 * secs).fract() < 0.5 { 1.0 } else { 0.4 };
    let blinking = |secs: f64| [48.0, 36.0, if (4.0 * secs).fract() < 0.5 { 20.0 } else { -1.0 }];
    let swaying: Camera = |secs| rotating((2.0 * secs).sin());
    let worlds = [
        ("rotating", world(swaying, disc)),
        ("flickering", World { light: flicker, ..world(STILL, disc) }),
        ("blinking", world(STILL, blinking)),
        ("still", world(STILL, NO_DISC)),
    ];
    let rate = 360_000.0;
    for (name, world) in worlds {
        for kind in KINDS {
            let bound_secs = 1.5 * SIZE.pixels() as f64 / (rate * 0.6 * 0.4 * 0.6 * 0.2);
            let mut engine = engine(world, kind, rate);
            let (_, secs) = play(&mut engine, (1.4 * 60.0 * bound_secs) as u64);
            let oldest = engine.canvas().time().min().expect("pixels");
            let age_secs = frameless::Time::from_secs(secs).secs_since(oldest);
            assert!(age_secs < bound_secs, "{name} {kind:?}: {age_secs} s, at most {bound_secs} s");
        }
    }
}
