//! Comparisons that are interrupted, gone on with, changed, and cut down.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};

use frameless_eval::{EvalError, Experiment, Progress, Results, Selection, compare};

/// Remembers what was done; asks to stop after so much work.
#[derive(Default)]
struct Watch {
    done: AtomicU64,
    planned: AtomicU64,
    stages: Mutex<Vec<String>>,
    limit: Option<u64>,
}

impl Progress for Watch {
    fn plan(&self, work: u64) {
        self.planned.store(work, Ordering::Relaxed);
    }
    fn stage(&self, what: &str) {
        self.stages.lock().expect("nobody panics").push(what.to_owned());
    }
    fn advance(&self, work: u64) {
        self.done.fetch_add(work, Ordering::Relaxed);
    }
    fn should_stop(&self) -> bool {
        self.limit.is_some_and(|limit| self.done.load(Ordering::Relaxed) >= limit)
    }
}

const SMALL: &str = r#"
    title = "small"
    algorithms = ["random", "change", "framed"]
    samples_per_sec = [10_000, 20_000]
    seeds = [1, 2]
    width = 48
    height = 36
    duration_secs = 0.3
    unscored_secs = 0.1
    [[scenes]]
    scene = "sphere"
    [[scenes]]
    scene = "shadow"
    [output]
    stills_secs = [0.2]
    video = false
    [equal_quality]
    algorithms = ["change"]
    opponents = ["random", "framed"]
    max_factor = 8
"#;

/// Scenes × rates × (two seeded algorithms with two seeds, and one that is not).
const RUNS: usize = 2 * 2 * (2 * 2 + 1);

fn experiment(text: &str) -> Experiment {
    Experiment::parse(text, Path::new("")).expect("valid")
}

fn compared(text: &str, out: &Path) -> (Results, Watch) {
    let watch = Watch::default();
    let results = compare(&experiment(text), out, &watch).expect("it runs");
    assert_eq!(
        watch.done.load(Ordering::Relaxed),
        watch.planned.load(Ordering::Relaxed),
        "progress ends at 100 %"
    );
    (results, watch)
}

/// All published files.
fn published(out: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut files = BTreeMap::new();
    let read = |path: &Path| std::fs::read(path).unwrap_or_else(|e| panic!("{path:?}: {e}"));
    for name in ["results.json", "report.html"] {
        files.insert(name.to_owned(), read(&out.join(name)));
    }
    for entry in out.join("pictures").read_dir().expect("pictures") {
        let path = entry.expect("readable").path();
        files.insert(path.to_string_lossy().rsplit('/').next().unwrap_or("").into(), read(&path));
    }
    files
}

#[test]
fn what_was_finished_is_kept_and_the_outcome_is_the_same() {
    let parent = tempfile::tempdir().expect("a temporary folder");
    let at_once = parent.path().join("at once");
    let (results, watch) = compared(SMALL, &at_once);
    assert_eq!(results.runs.len(), RUNS);
    let all_work = watch.done.into_inner();

    let out = parent.path().join("in parts");
    let mut kept_before = 0;
    for part in 1..4 {
        let watch = Watch { limit: Some(all_work * part / 12), ..Watch::default() };
        match compare(&experiment(SMALL), &out, &watch) {
            Err(error @ EvalError::Unfinished { kept, wanted, .. }) => {
                assert!(kept >= kept_before && kept < wanted && wanted == RUNS, "{error}");
                assert!(error.to_string().contains(&format!("{kept} of {wanted} runs")));
                kept_before = kept;
            }
            other => panic!("not interrupted: {:?}", other.map(|results| results.runs.len())),
        }
        assert!(!out.join("results.json").exists(), "half an outcome");
    }
    assert!(kept_before > 0, "nothing was kept");
    let (resumed, watch) = compared(SMALL, &out);
    assert_eq!(resumed, results);
    assert!(watch.done.into_inner() < all_work, "finished runs were made again");
    assert!(published(&out) == published(&at_once), "resumed and uninterrupted differ");
}

#[test]
fn interrupted_before_anything_was_finished_nothing_is_left() {
    let parent = tempfile::tempdir().expect("a temporary folder");
    let watch = Watch { limit: Some(1), ..Watch::default() };
    let outcome = compare(&experiment(SMALL), &parent.path().join("out"), &watch);
    assert!(matches!(outcome, Err(EvalError::Unfinished { kept: 0, wanted: RUNS, .. })));
    assert_eq!(parent.path().read_dir().expect("readable").count(), 0);
}

#[test]
fn a_finished_comparison_traces_nothing_again() {
    let parent = tempfile::tempdir().expect("a temporary folder");
    let out = parent.path().join("out");
    let (first, _) = compared(SMALL, &out);
    let before = published(&out);
    let (second, watch) = compared(SMALL, &out);
    assert_eq!(watch.done.into_inner(), 0);
    let stages = watch.stages.into_inner().expect("nobody panics");
    assert!(!stages.iter().any(|stage| stage.contains("ideal")), "{stages:?}");
    assert!(first == second && published(&out) == before);
}

#[test]
fn a_changed_experiment_uses_what_still_fits() {
    let parent = tempfile::tempdir().expect("a temporary folder");
    let out = parent.path().join("out");
    let (first, watch) = compared(SMALL, &out);
    let all_work = watch.done.into_inner();

    // A third seed: two algorithms × two rates × two scenes more, and no scan again.
    let (more, watch) = compared(&SMALL.replace("seeds = [1, 2]", "seeds = [1, 2, 3]"), &out);
    assert_eq!(more.runs.len(), RUNS + 8);
    assert!(first.runs.iter().all(|run| more.runs.contains(run)));
    assert!(watch.done.into_inner() < all_work / 2);

    // Another name for a scene changes no number.
    let renamed = SMALL.replace("scene = \"shadow\"", "scene = \"shadow\"\nname = \"night\"");
    let (renamed, watch) = compared(&renamed, &out);
    assert_eq!(watch.done.into_inner(), 0);
    assert_eq!(renamed.runs[RUNS - 1].scene, "night");
    assert_eq!(renamed.runs[RUNS - 1].rmse, first.runs[RUNS - 1].rmse);

    // Another size changes all.
    let (other, _) = compared(&SMALL.replace("height = 36", "height = 30"), &out);
    assert!(other.runs.iter().all(|run| !first.runs.contains(run)));
}

#[test]
fn a_broken_cell_is_run_again() {
    let parent = tempfile::tempdir().expect("a temporary folder");
    let out = parent.path().join("out");
    let (first, _) = compared(SMALL, &out);
    let cells = out.join("cells").read_dir().expect("cells");
    let mut cells: Vec<_> = cells.map(|entry| entry.expect("readable").path()).collect();
    cells.retain(|path| path.extension().is_some_and(|extension| extension == "json"));
    for (path, text) in cells.iter().zip(["", "{}", "{\"key\": \"", "[1, 2]"]) {
        std::fs::write(path, text).expect("writable");
    }
    let (second, watch) = compared(SMALL, &out);
    assert_eq!(second, first);
    assert!(watch.done.into_inner() > 0);
}

#[test]
fn a_selection_runs_its_part_and_leaves_the_other_cells() {
    let parent = tempfile::tempdir().expect("a temporary folder");
    let out = parent.path().join("out");
    let (whole, _) = compared(SMALL, &out);
    let selection = Selection::parse("scene=shadow,algorithm=change+hold,rate=20000");
    let part = selection.expect("well-formed").of(experiment(SMALL)).expect("there");
    let watch = Watch::default();
    let results = compare(&part, &out, &watch).expect("it runs");
    assert_eq!(results.runs.len(), 2);
    assert!(results.runs.iter().all(|run| whole.runs.contains(run)));
    assert!(results.equal_quality.is_empty(), "no opponent is selected");
    let (again, watch) = compared(SMALL, &out);
    assert!(again == whole);
    assert_eq!(watch.done.into_inner(), 0);
}

#[test]
fn factors_say_how_many_more_samples_reach_the_same_error() {
    let parent = tempfile::tempdir().expect("a temporary folder");
    let (results, _) = compared(SMALL, &parent.path().join("out"));
    let rows = &results.equal_quality;
    assert_eq!(rows.len(), 2 * 2 * 2, "scenes × rates × opponents");
    for row in rows {
        assert_eq!(row.algorithm, "change");
        assert!(row.factor >= 1.0, "{row:?}: change is better than both");
    }
    // The factor run as a rate gives the error of `change`, up to the interpolation.
    let row = rows.iter().find(|row| row.opponent == "random").expect("there");
    let rate = row.samples_per_sec * row.factor;
    let text = SMALL.replace("[10_000, 20_000]", &format!("[{rate:?}]"));
    let text = text.split("[equal_quality]").next().expect("the rest");
    let (check, _) = compared(text, &parent.path().join("check"));
    let mean = |results: &Results, algorithm: &str, rate: f64| {
        let run = results.runs.iter().find(|run| {
            run.scene == row.scene && run.algorithm == algorithm && run.samples_per_sec == rate
        });
        run.and_then(|run| run.rmse.mean).expect("scored")
    };
    let target = mean(&results, "change", row.samples_per_sec);
    let reached = mean(&check, "random", rate);
    assert!((reached / target - 1.0).abs() < 0.1, "{reached} instead of {target}: {row:?}");
}
