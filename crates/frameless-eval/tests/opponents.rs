//! The opponents, against what is known of them without running.

use std::path::Path;

use frameless_eval::{Algorithm, Cell, Experiment, Ideals, RunResult, Subject, run};
use rayon::prelude::*;

fn experiment(scene: &str) -> Experiment {
    let text = format!(
        "title = \"opponents\"\nsamples_per_sec = [1]\nwidth = 64\nheight = 48\nduration_secs = 1.5\n\
         [[scenes]]\nscene = \"{scene}\"\n[output]\nvideo = false"
    );
    Experiment::parse(&text, Path::new("")).expect("valid")
}

/// Runs each algorithm at the rate beside it.
fn runs(scene: &str, algorithms: &[(&str, f64)]) -> Vec<RunResult> {
    let experiment = experiment(scene);
    let subject = Subject::load(&experiment.scenes[0]).expect("built in");
    let ideals = Ideals::trace(&subject, &experiment, &|| (), &|| false).expect("not stopped");
    let run_one = |&(name, samples_per_sec): &(&str, f64)| {
        let cell = Cell {
            scene: scene.into(),
            algorithm: Algorithm::from_name(name).expect(name),
            samples_per_sec,
            seed: 1,
        };
        run(&cell, &experiment, &subject, &ideals, &mut |_, _| true).expect("finite colours")
    };
    algorithms.iter().map(run_one).collect()
}

fn mean(result: &RunResult) -> f64 {
    result.rmse.mean.expect("scored")
}

/// RMSE at refresh `k`.
fn at(result: &RunResult, k: usize) -> f64 {
    result.rmse.values[k].expect("measured")
}

/// So many samples trace the 64×48 picture once per millisecond.
const FAST: f64 = 64.0 * 48.0 * 1000.0;
const SLOW: f64 = 40_000.0;

const SCENES: [&str; 8] =
    ["sphere", "many", "orbit", "stopgo", "sudden", "shadow", "settle", "mix"];

fn for_every_scene(check: impl Fn(&str) + Sync) {
    SCENES.par_iter().for_each(|scene| check(scene));
}

#[test]
fn who_knows_the_ideal_chooses_best_in_every_scene() {
    for_every_scene(|scene| {
        let held = ["oracle-hold", "adaptive+hold", "change", "permutation", "random"];
        // The suite's rates at this size.
        for rate in [225_000.0, 900_000.0, 3_600_000.0].map(|rate| rate / 64.0) {
            let results = runs(scene, &held.map(|name| (name, rate)));
            for other in &results[1..] {
                let (oracle, other_mean) = (mean(&results[0]), mean(other));
                assert!(
                    oracle < other_mean,
                    "{scene} at {rate}: {oracle}, {} {other_mean}",
                    other.algorithm
                );
            }
        }
    });
}

#[test]
fn history_makes_more_of_low_resolution_in_every_scene() {
    for_every_scene(|scene| {
        let results = runs(scene, &[("temporal", SLOW), ("lowres60", SLOW)]);
        let (temporal, low) = (mean(&results[0]), mean(&results[1]));
        assert!(temporal < low, "{scene}: {temporal} {low}");
    });
}

#[test]
fn history_comes_to_the_ideal_at_rest() {
    let results = runs("settle", &[("temporal", SLOW), ("lowres60", SLOW)]);
    let (temporal, low) = (at(&results[0], 89), at(&results[1], 89));
    assert!(temporal < 0.3 * low, "{temporal} {low}");
}

#[test]
fn with_enormous_rates_frames_come_to_the_ideal() {
    let algorithms = ["framed", "framed-single", "lowres60", "temporal"];
    for result in runs("mix", &algorithms.map(|name| (name, 1e12))) {
        assert!(mean(&result) < 1e-3, "{}: {}", result.algorithm, mean(&result));
    }
}

#[test]
fn with_tiny_rates_nobody_stumbles() {
    let all = [
        "framed",
        "framed-single",
        "lowres60",
        "lowres30",
        "progressive",
        "temporal",
        "random",
        "permutation",
        "change",
        "oracle-hold",
    ];
    for samples_per_sec in [60.0, 5.0] {
        for result in runs("sudden", &all.map(|name| (name, samples_per_sec))) {
            let values = result.rmse.values.iter().map(|rmse| rmse.expect("measured"));
            assert!(values.clone().count() == 90 && values.clone().all(|rmse| rmse < 1.0));
        }
    }
}

#[test]
fn where_full_resolution_fits_low_resolution_is_framed_rendering() {
    let algorithms = [("framed", FAST), ("lowres60", FAST), ("framed", SLOW), ("temporal", FAST)];
    let results = runs("sphere", &algorithms);
    assert_eq!(results[0].rmse.values, results[1].rmse.values);
    assert_eq!(results[0].rmse.values, results[3].rmse.values);
    // A frame that is 1 ms old is a quarter of a pixel behind; one that takes 77 ms is far behind.
    let (fast, slow) = (mean(&results[0]), mean(&results[2]));
    assert!(fast > 0.0 && fast < 0.2 * slow, "{fast} {slow}");
}

#[test]
fn where_nothing_moves_any_more_frames_are_the_ideal() {
    let algorithms = ["framed", "framed-single", "lowres60", "lowres30", "temporal", "oracle-hold"];
    for result in runs("settle", &algorithms.map(|name| (name, FAST))) {
        assert!(at(&result, 40) > 0.0, "{}: the sphere rolls at 0.68 s", result.algorithm);
        assert_eq!(at(&result, 89), 0.0, "{}", result.algorithm);
    }
}

#[test]
fn progressive_is_coarse_while_things_move_and_fine_at_rest() {
    let results = runs("settle", &[("progressive", SLOW), ("lowres30", SLOW)]);
    let (progressive, low) = (|k| at(&results[0], k), |k| at(&results[1], k));
    assert!((progressive(40) / low(40) - 1.0).abs() < 0.3, "{} {}", progressive(40), low(40));
    // An antialiased picture never comes to zero against one of a single sample per pixel, which at 64×48 is far from
    // antialiased.
    assert!(progressive(89) < 0.8 * low(89), "{} {}", progressive(89), low(89));
}

#[test]
fn low_resolution_stays_coarse_at_rest() {
    let results = runs("settle", &[("lowres60", SLOW), ("random", SLOW)]);
    assert!(at(&results[0], 89) > 10.0 * at(&results[1], 89).max(1e-3));
}
