//! Results that nobody measured, for tests.

use crate::results::{Curve, EventResult, RESULTS_VERSION, Results, RunResult};

/// Runs at 900,000 samples/s: scene, algorithm, and the mean RMSE of each seed.
pub(crate) fn results_of(runs: &[(&str, &str, &[f64])]) -> Results {
    let run_of = |&(scene, algorithm, errors): &(&str, &str, &[f64])| {
        let (scene, algorithm) = (scene.to_owned(), algorithm.to_owned());
        let run = move |(i, &error): (usize, &f64)| run(&scene, &algorithm, i as u64 + 1, error);
        errors.iter().enumerate().map(run).collect::<Vec<_>>()
    };
    Results {
        format: "frameless results".into(),
        version: RESULTS_VERSION,
        title: "made up".into(),
        unscored_refreshes: 2,
        runs: runs.iter().flat_map(run_of).collect(),
        equal_quality: Vec::new(),
    }
}

fn run(scene: &str, algorithm: &str, seed: u64, error: f64) -> RunResult {
    let constant = |value: f64| Curve::new(vec![Some(value); 30], 1, 2, 0.95);
    RunResult {
        scene: scene.into(),
        algorithm: algorithm.into(),
        samples_per_sec: 900_000.0,
        seed,
        width: 64,
        height: 48,
        display_hz: 60,
        refreshes: 30,
        rmse: constant(error),
        psnr_db: constant(-20.0 * error.log10()),
        rmse_changed: constant(2.0 * error),
        ssim: constant(1.0 - error),
        flip: constant(error),
        age_secs: constant(0.1),
        oldest_secs: 0.2,
        events: vec![EventResult {
            name: "cut".into(),
            secs: 0.1,
            changed_pixels: 100,
            latency_secs: None,
        }],
        at_rest: None,
    }
}
