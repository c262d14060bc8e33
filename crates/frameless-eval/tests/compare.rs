//! Whole experiments, small ones.

use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};

use frameless_eval::{Experiment, Ideals, Progress, Results, Subject, compare, rmse};

/// Counts work; asks to stop after so much of it.
struct Counting {
    done: AtomicU64,
    planned: AtomicU64,
    limit: u64,
}

impl Counting {
    fn new(limit: u64) -> Counting {
        Counting { done: AtomicU64::new(0), planned: AtomicU64::new(0), limit }
    }
}

impl Progress for Counting {
    fn plan(&self, work: u64) {
        self.planned.store(work, Ordering::Relaxed);
    }
    fn stage(&self, _what: &str) {}
    fn advance(&self, work: u64) {
        self.done.fetch_add(work, Ordering::Relaxed);
    }
    fn should_stop(&self) -> bool {
        self.done.load(Ordering::Relaxed) >= self.limit
    }
}

const SMALL: &str = r#"
    title = "small"
    algorithms = ["random", "permutation", "change"]
    samples_per_sec = [40_000]
    seeds = [1, 2]
    width = 64
    height = 48
    duration_secs = 0.5
    unscored_secs = 0.1
    [[scenes]]
    scene = "sphere"
    [output]
    stills_secs = [0.5]
"#;

fn small() -> Experiment {
    Experiment::parse(SMALL, Path::new("")).expect("valid")
}

fn run_with_threads(threads: usize, out: &Path) -> Results {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
    pool.install(|| compare(&small(), out, &Counting::new(u64::MAX))).expect("it runs")
}

#[test]
fn the_same_bytes_with_1_2_and_8_threads() {
    let parent = tempfile::tempdir().expect("a temporary folder");
    let files = [
        "results.json",
        "report.html",
        "pictures/sphere-40000-500ms.png",
        "pictures/sphere-40000-rmse.svg",
        "pictures/sphere-40000.mp4",
    ];
    let bytes = |threads: usize| {
        let out = parent.path().join(format!("{threads}"));
        run_with_threads(threads, &out);
        files.map(|name| std::fs::read(out.join(name)).unwrap_or_else(|e| panic!("{name}: {e}")))
    };
    let one = bytes(1);
    assert!(one == bytes(2), "two threads differ from one");
    assert!(one == bytes(8), "eight threads differ from one");
}

#[test]
fn results_say_what_was_asked_and_change_beats_random() {
    let parent = tempfile::tempdir().expect("a temporary folder");
    let out = parent.path().join("out");
    let progress = Counting::new(u64::MAX);
    let results = compare(&small(), &out, &progress).expect("it runs");
    assert_eq!(progress.done.into_inner(), progress.planned.into_inner(), "progress ends at 100 %");

    let text = std::fs::read_to_string(out.join("results.json")).expect("written");
    let read: Results = serde_json::from_str(&text).expect("as documented");
    assert!(read == results, "what was written is not what was returned");
    assert_eq!(results.runs.len(), 6);
    for run in &results.runs {
        assert_eq!((run.width, run.height, run.display_hz, run.refreshes), (64, 48, 60, 30));
        assert_eq!(run.rmse.values.len(), 30);
        assert!(run.rmse.mean.expect("scored") > 0.0 && run.rmse.p95 >= run.rmse.mean);
        assert!(run.rmse_changed.mean.expect("the sphere moves") > run.rmse.mean.expect("scored"));
    }
    let mean = |algorithm: &str| {
        let runs = results.runs.iter().filter(|run| run.algorithm == algorithm);
        runs.map(|run| run.rmse.mean.expect("scored")).sum::<f64>() / 2.0
    };
    let (change, permutation, random) = (mean("change"), mean("permutation"), mean("random"));
    assert!(change < permutation, "{change} {permutation}");
    assert!(permutation < random, "{permutation} {random}");
}

#[test]
fn the_ideal_against_itself_is_exactly_zero() {
    let experiment = small();
    let subject = Subject::load(&experiment.scenes[0]).expect("built in");
    let trace = || Ideals::trace(&subject, &experiment, &|| (), &|| false).expect("not stopped");
    let (a, b) = (trace().pictures, trace().pictures);
    assert!(a.iter().zip(b.iter()).all(|(a, b)| rmse(a, b) == 0.0));
    assert!(rmse(&a[0], &a[29]) > 0.0, "nothing moves");
}

#[test]
fn where_nothing_moves_any_more_the_held_picture_is_the_ideal_bit_for_bit() {
    // The sphere of `settle` rests from 0.8 s on; by 2.5 s every pixel has been traced again.
    let text = SMALL
        .replace("\"sphere\"", "\"settle\"")
        .replace("duration_secs = 0.5", "duration_secs = 2.5");
    let experiment = Experiment::parse(&text, Path::new("")).expect("valid");
    let parent = tempfile::tempdir().expect("a temporary folder");
    let results = compare(&experiment, &parent.path().join("out"), &Counting::new(u64::MAX));
    for run in results.expect("it runs").runs {
        assert!(
            run.rmse.values[40].expect("measured") > 0.0,
            "{}: the sphere rolls at 0.68 s",
            run.algorithm
        );
        assert_eq!(run.rmse.values[149], Some(0.0), "{}", run.algorithm);
    }
}

#[test]
fn a_video_as_small_as_allowed_is_written() {
    let text = SMALL.replace("width = 64\n    height = 48", "width = 64\n    height = 36");
    let text = text.replace("stills_secs = [0.5]", "show = [\"ideal\"]");
    let experiment = Experiment::parse(&text, Path::new("")).expect("64×64 with its bar");
    let out = tempfile::tempdir().expect("a temporary folder").path().join("out");
    compare(&experiment, &out, &Counting::new(u64::MAX)).expect("it runs");
    assert!(out.join("pictures/sphere-40000.mp4").metadata().expect("written").len() > 1000);
}

#[test]
fn bad_experiments_are_refused_by_key_and_line() {
    for (from, to, part) in [
        ("seeds = [1, 2]", "sedes = [1, 2]", "line 5, column 5: unknown field `sedes`"),
        ("\"permutation\", ", "\"random\", ", "\"random\" is there twice"),
        ("width = 64", "width = 0", "width"),
        ("width = 64", "width = 64.5", "line 6"),
        ("width = 64\n    height = 48", "width = 8192\n    height = 8192", "GiB"),
        ("[40_000]", "[]", "samples_per_sec is empty"),
        ("[40_000]", "[-1]", "samples_per_sec must be positive"),
        ("[40_000]", "[1e300]", "at most 100000000"),
        ("[40_000]", "[nan]", "samples_per_sec must be positive"),
        ("width = 64\n    height = 48", "width = 1920\n    height = 1080", "output.video = false"),
        ("width = 64\n    height = 48", "width = 1\n    height = 1", "output.video = false"),
        ("\"random\", ", "\"chance\", ", "unknown algorithm \"chance\""),
        ("\"sphere\"", "\"cube\"", "neither a built-in scene"),
        ("stills_secs = [0.5]", "stills_secs = [0.6]", "stills_secs"),
        ("stills_secs = [0.5]", "show = [\"nobody\"]", "show"),
        ("unscored_secs = 0.1", "unscored_secs = 0.5", "unscored_secs"),
        ("title = \"small\"", "", "title"),
        ("scene = \"sphere\"", "scene = \"sphere\"\nname = \"../x\"", "only letters"),
        ("scene = \"sphere\"", "scene = \"sphere\"\ncamera = { pitch = 1 }", "pitch"),
    ] {
        let text = SMALL.replacen(from, to, 1);
        assert_ne!(text, SMALL);
        let message = Experiment::parse(&text, Path::new("")).expect_err(to);
        assert!(message.contains(part), "{to}: {message}");
    }
}

#[test]
fn a_missing_file_is_named() {
    let path = Path::new("no/such/experiment.toml");
    let error = Experiment::read(path).expect_err("missing");
    assert!(
        error.is_bad_input() && error.to_string().contains("no/such/experiment.toml"),
        "{error}"
    );

    let text = SMALL.replacen("\"sphere\"", "\"no-such-file.glb\"", 1);
    let experiment = Experiment::parse(&text, Path::new("folder")).expect("not opened yet");
    let parent = tempfile::tempdir().expect("a temporary folder");
    let error = compare(&experiment, &parent.path().join("out"), &Counting::new(u64::MAX))
        .expect_err("missing");
    assert!(error.is_bad_input() && error.to_string().contains("no-such-file.glb"), "{error}");
}

#[test]
fn the_experiments_in_the_repository_are_valid() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../experiments");
    let mut read = 0;
    for entry in folder.read_dir().expect("experiments/") {
        let path = entry.expect("readable").path();
        if path.extension().is_some_and(|e| e == "toml") {
            Experiment::read(&path).unwrap_or_else(|error| panic!("{error}"));
            read += 1;
        }
    }
    assert!(read >= 4);
}

#[test]
fn the_results_that_are_kept_can_be_read() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../results");
    let mut kept = 0;
    for entry in std::fs::read_dir(folder).expect("the folder of results") {
        let path = entry.expect("readable").path();
        if path.extension().is_some_and(|extension| extension == "json") {
            let results = frameless_eval::Results::read(&path).expect("of this version");
            assert!(results.runs.iter().all(|run| run.rmse.mean.is_some()), "{}", path.display());
            kept += 1;
        }
    }
    assert!(kept >= 4, "{kept} files");
}
