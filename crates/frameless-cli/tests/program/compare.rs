//! Comparisons: a part of an experiment, going on with it, and two results against each other.

use std::path::{Path, PathBuf};

use crate::run::{Run, frameless};

const EXPERIMENT: &str = r#"
title = "tiny"
algorithms = ["random", "change"]
samples_per_sec = [5_000, 10_000]
seeds = [1, 2]
width = 32
height = 24
duration_secs = 0.2
unscored_secs = 0.05
[[scenes]]
scene = "sphere"
[output]
video = false
"#;

fn experiment_in(folder: &Path) -> PathBuf {
    let path = folder.join("tiny.toml");
    std::fs::write(&path, EXPERIMENT).unwrap();
    path
}

fn compare(arguments: &[&Path], more: &[&str]) -> Run {
    let arguments = arguments.iter().map(|path| path.as_os_str().to_owned());
    let more = more.iter().map(std::ffi::OsString::from);
    let all: Vec<_> = std::iter::once("compare".into()).chain(arguments).chain(more).collect();
    frameless(&all)
}

#[test]
fn a_part_of_an_experiment_and_then_the_rest() {
    let folder = tempfile::tempdir().unwrap();
    let (experiment, out) = (experiment_in(folder.path()), folder.path().join("out"));
    let out_name = out.to_string_lossy().into_owned();
    let part = ["--out", &out_name, "--only", "algorithm=change+hold,rate=10_000,seed=2"];
    let said = compare(&[&experiment], &part).succeeded().out;
    assert!(said.contains("change") && !said.contains("random"), "{said}");
    let cells = || std::fs::read_dir(out.join("cells")).unwrap().count();
    let before = cells();
    let said = compare(&[&experiment], &["--out", &out_name]).succeeded().out;
    assert!(said.contains("random") && said.contains("5000 samples/s"), "{said}");
    assert!(cells() > before);
    for file in ["report.html", "results.json", "pictures"] {
        assert!(out.join(file).exists(), "no {file}");
    }
}

#[test]
fn what_an_experiment_does_not_have_is_refused_and_leaves_no_folder() {
    let folder = tempfile::tempdir().unwrap();
    let (experiment, out) = (experiment_in(folder.path()), folder.path().join("out"));
    let out_name = out.to_string_lossy().into_owned();
    for (only, words) in [
        ("scene=many", "there are sphere"),
        ("algorithm=framed", "there are random, change"),
        ("rate=1", "there are 5000, 10000"),
        ("colour=red", "wanted scene, algorithm, rate or seed"),
    ] {
        compare(&[&experiment], &["--out", &out_name, "--only", only]).refused(2, words);
    }
    compare(&[&experiment], &[]).refused(2, "--out");
    assert!(!out.exists());
}

#[test]
fn somebody_elses_folder_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let experiment = experiment_in(folder.path());
    let out = folder.path().to_string_lossy().into_owned();
    compare(&[&experiment], &["--out", &out]).refused(2, "holds no results.json");
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
}

#[test]
fn two_results_and_what_got_worse() {
    let folder = tempfile::tempdir().unwrap();
    let (experiment, out) = (experiment_in(folder.path()), folder.path().join("out"));
    compare(&[&experiment], &["--out", &out.to_string_lossy()]).succeeded();
    let a = out.join("results.json");
    let said = compare(&[&a, &a], &[]).succeeded().out;
    assert!(said.contains("0 better") && said.contains("0 worse"), "{said}");

    // What was `random` is called `change`, and the other way round: two get worse.
    let text = std::fs::read_to_string(&a).unwrap();
    let swapped = text
        .replace("\"random\"", "\"x\"")
        .replace("\"change\"", "\"random\"")
        .replace("\"x\"", "\"change\"");
    let b = folder.path().join("b.json");
    std::fs::write(&b, swapped).unwrap();
    let run = compare(&[&a, &b], &[]);
    assert_eq!(run.code, Some(1), "{}", run.err);
    assert!(
        run.out.matches("WORSE   change\n").count() == 2
            && run.out.matches("better  random\n").count() == 2,
        "{}",
        run.out
    );
    assert!(run.err.contains("got worse by more than the spread"), "{}", run.err);

    // Nor is it well if something is gone.
    let mut half: serde_json::Value = serde_json::from_str(&text).unwrap();
    half["runs"].as_array_mut().unwrap().retain(|run| run["algorithm"] == "random");
    std::fs::write(&b, half.to_string()).unwrap();
    let run = compare(&[&a, &b], &[]);
    assert_eq!(run.code, Some(1), "{}", run.out);
    assert!(run.err.contains("2 runs of A are not in B"), "{}", run.err);

    // One scene is not comparable with another.
    std::fs::write(&b, text.replace("\"sphere\"", "\"cube\"")).unwrap();
    compare(&[&a, &b], &[]).refused(2, "in common");
}

#[test]
fn what_is_no_result_is_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    let old = folder.path().join("old.json");
    std::fs::write(&old, r#"{"format": "frameless results", "version": 1, "runs": []}"#).unwrap();
    compare(&[&old, &old], &[]).refused(2, "old.json: results of version 1");
    compare(&[&old], &[]).refused(2, "wanted two");
    compare(&[&old, &old], &["--out", "x"]).refused(2, "--out and --only belong to an experiment");
    compare(&[&old, &folder.path().join("none.json")], &[]).refused(2, "old.json");
    std::fs::write(&old, "no json").unwrap();
    compare(&[&old, &old], &[]).refused(2, "wanted the results.json");
    compare(&[&old, &old, &old], &[]).refused(2, "old.json");
}
