//! All metrics of a run at once, where their values are known without running.

use std::path::Path;

use frameless_eval::{
    Algorithm, Cell, Experiment, Ideals, RunResult, Subject, flip, psnr_db, rmse, run, ssim,
};

/// A sphere that jumps at 0.3 s, after which nothing moves.
const EXPERIMENT: &str = r#"
    title = "metrics"
    samples_per_sec = [1]
    width = 64
    height = 48
    duration_secs = 1.0
    unscored_secs = 0.9
    [metrics]
    ssim_every = 10
    flip_every = 20
    [output]
    video = false
    [[scenes]]
    scene = "settle"
    [[scenes.events]]
    at_secs = 0.2
    name = "stop"
    stop = true
    [[scenes.events]]
    at_secs = 0.3
    name = "jump"
    move = { node = "sphere", by = [0, 0.5, 0] }
"#;

fn result(algorithm: &str, seed: u64, threads: usize) -> RunResult {
    let experiment = Experiment::parse(EXPERIMENT, Path::new("")).expect("valid");
    let subject = Subject::load(&experiment.scenes[0]).expect("built in");
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
    let ideals = pool.install(|| Ideals::trace(&subject, &experiment, &|| (), &|| false));
    let cell = Cell {
        scene: "settle".into(),
        algorithm: Algorithm::from_name(algorithm).expect(algorithm),
        // 0.1 s per picture.
        samples_per_sec: 64.0 * 48.0 * 10.0,
        seed,
    };
    let ideals = ideals.expect("not stopped");
    run(&cell, &experiment, &subject, &ideals, &mut |_, _| true).expect("finite colours")
}

#[test]
fn the_ideal_against_itself_is_perfect_by_every_metric() {
    let experiment = Experiment::parse(EXPERIMENT, Path::new("")).expect("valid");
    let subject = Subject::load(&experiment.scenes[0]).expect("built in");
    let ideals = Ideals::trace(&subject, &experiment, &|| (), &|| false).expect("not stopped");
    let picture = &ideals.pictures[20];
    assert_eq!((rmse(picture, picture), psnr_db(0.0)), (0.0, None));
    assert_eq!((ssim(picture, picture, 64), flip(picture, picture, 64)), (Some(1.0), 0.0));
}

#[test]
fn a_held_picture_at_rest_is_perfect_by_every_metric() {
    let result = result("permutation", 1, 2);
    // Scored is the last tenth of a second, long after everything has been traced again.
    // Six values have no percentiles.
    assert_eq!((result.rmse.mean, result.rmse.p95), (Some(0.0), None));
    assert_eq!((result.psnr_db.mean, result.psnr_db.p95), (None, None));
    assert_eq!((result.rmse_changed.mean, result.ssim.mean), (None, Some(1.0)));
    assert_eq!(result.flip.mean, Some(0.0));
    // Before, something was wrong: PSNR is that of the RMSE, and values stand at the refreshes they are said to.
    assert!(result.rmse.values[20].expect("measured") > 0.0);
    let psnr = result.rmse.values[20].and_then(psnr_db);
    assert_eq!(result.psnr_db.values[20], psnr);
    assert_eq!((result.ssim.every, result.ssim.values.len()), (10, 6));
    assert_eq!((result.flip.every, result.flip.values.len()), (20, 3));
    assert!(result.ssim.values[1].expect("refresh 19") < 1.0);
    let latency = result.events[1].latency_secs.expect("followed");
    assert!(latency > 0.05 && latency < 0.12, "90 % of a picture that takes 0.1 s: {latency}");
    let rest = result.at_rest.expect("nothing moves after the jump");
    assert!((rest.since_secs - 0.3).abs() < 1e-6, "{}", rest.since_secs);
    assert!(*rest.rmse.last().expect("several") > 0.0, "one sample per pixel is aliased");
}

#[test]
fn equal_seeds_give_equal_results_with_any_number_of_threads() {
    let json = |algorithm: &str, seed: u64, threads: usize| {
        serde_json::to_string(&result(algorithm, seed, threads)).expect("plain data")
    };
    for algorithm in ["random", "progressive"] {
        assert_eq!(json(algorithm, 1, 1), json(algorithm, 1, 3), "{algorithm}");
        assert_ne!(json(algorithm, 1, 1), json(algorithm, 2, 1), "{algorithm}");
    }
}
