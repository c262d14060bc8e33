//! Benchmarks end, and have the rows that others rely on.

use serde_json::Value;

use crate::run::frameless;

/// Names and values of the rows of a benchmark.
fn rows(arguments: &[&str]) -> Vec<(String, f64)> {
    let all: Vec<&str> = ["bench"].iter().chain(arguments).chain(&["--json"]).copied().collect();
    let run = frameless(&all).succeeded();
    let report: Value = serde_json::from_str(&run.out).expect("one JSON object");
    let rows = report["rows"].as_array().expect("rows").iter().map(|row| {
        assert!(row["unit"].is_string() && row["conditions"].is_string(), "{row}");
        let name = row["name"].as_str().expect("a name").to_owned();
        (name, row["value"].as_f64().expect("a number"))
    });
    rows.collect()
}

#[track_caller]
fn value(rows: &[(String, f64)], name: &str) -> f64 {
    rows.iter().find(|row| row.0 == name).unwrap_or_else(|| panic!("no {name}: {rows:?}")).1
}

#[test]
fn latency_is_told_with_and_without_pictures() {
    let rows = rows(&["latency", "--rounds", "1", "--secs", "0.5", "--size", "64x48"]);
    for pictures in ["", ".with_pictures"] {
        let [median, most] = ["p50", "p99"]
            .map(|percentile| value(&rows, &format!("latency{pictures}.{percentile}_ms")));
        assert!(0.0 < median && median <= most && most < 10_000.0, "{rows:?}");
        assert!(value(&rows, &format!("latency{pictures}.samples_per_sec")) > 0.0, "{rows:?}");
        if !pictures.is_empty() {
            let name = format!("latency{pictures}.pictures_per_sec");
            assert!(value(&rows, &name) > 1.0, "{rows:?}");
        }
    }
}

#[test]
fn scaling_is_told_up_to_two_threads_at_least() {
    let rows = rows(&["scaling", "--rounds", "1", "--secs", "0.02", "--size", "64x48"]);
    for reconstruction in ["", ".reproject"] {
        let of = |name: &str| value(&rows, &format!("scaling{reconstruction}.{name}"));
        let ratio = of("samples_per_sec_2") / of("samples_per_sec_1");
        assert!((of("1_to_2") / ratio - 1.0).abs() < 1e-6, "{rows:?}");
        assert!((0.0..1.0).contains(&of("serial_share")), "{rows:?}");
    }
}

#[test]
fn loading_is_measured_in_processes_of_their_own() {
    let rows = rows(&["load", "--scene", "sphere", "--rounds", "2", "--size", "64x48"]);
    let first_pixel = value(&rows, "load.to_first_pixel_secs");
    let parts = value(&rows, "load.read_secs") + value(&rows, "load.prepare_secs");
    assert!(0.0 < parts && parts < 2.0 * first_pixel, "{rows:?}");
    assert!(value(&rows, "load.content_mib") > 0.0, "{rows:?}");
    if cfg!(target_os = "linux") {
        assert!(value(&rows, "load.peak_memory_over_content") > 1.0, "{rows:?}");
    }
}

#[test]
fn options_that_a_benchmark_would_not_heed_are_refused() {
    for (arguments, refused) in [
        (&["scaling", "--threads", "1"][..], "bench scaling has no --threads; it has --scene, "),
        (&["display", "--scene", "sphere"], "bench display has no --scene; it has --size, "),
        (&["engine", "--max-depth", "2"], "bench engine has no --max-depth; it has "),
        (&["rays", "--secs", "1", "--json"], "bench rays has no --secs; it has "),
    ] {
        frameless(&[&["bench"], arguments].concat()).refused(2, refused);
    }
}
