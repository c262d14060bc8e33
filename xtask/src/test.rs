//! What CI checks, in order: cheap and telling first.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail, ensure};

use crate::browser;
use crate::command::{cargo, run, watch};
use crate::contact_sheet;
use crate::missing::{self, Missing};
use crate::package;
use crate::program;
use crate::steps::{Done, Steps};
use crate::web;
use crate::window;

/// Every check. True if nothing failed.
pub(crate) fn everything() -> bool {
    let mut steps = Steps::new(in_ci());
    steps.step("prerequisites", prerequisites);
    steps.step("formatting", formatting);
    steps.step("clippy", clippy);
    steps.step("tests", cargo_test);
    steps.step("metrics against Python", || crate::python::metrics(&out_dir("metrics")?));
    steps.step("build the program", || build().map(|_| Done::passed("")));
    steps.step("the program", || program::as_a_user(&program()?, &out_dir("program")?));
    steps.step("a comparison", || program::a_comparison(&program()?, &out_dir("comparison")?));
    steps.step("the report in a browser", open_report);
    steps.step("the web page", || web::page(&program()?, &out_dir("web")?));
    steps.step("the web page in Firefox", || web::in_firefox(&program()?, &out_dir("firefox")?));
    steps.step("the window", || open_window(&program()?));
    package::steps(&mut steps, out_dir);
    steps.finish()
}

/// Only the Python package. True if nothing failed.
pub(crate) fn only_python() -> bool {
    let mut steps = Steps::new(in_ci());
    package::steps(&mut steps, out_dir);
    steps.finish()
}

/// Only the web page. True if nothing failed.
pub(crate) fn only_web_page() -> bool {
    let mut steps = Steps::new(in_ci());
    steps.step("the web page", || web::page(&build()?, &out_dir("web")?));
    steps.step("the web page in Firefox", || web::in_firefox(&program()?, &out_dir("firefox")?));
    steps.finish()
}

/// All public scenes on one sheet. True if all were drawn or refused as they should be.
pub(crate) fn contact_sheet() -> bool {
    let mut steps = Steps::new(in_ci());
    steps.step("the public scenes", || contact_sheet::draw(&build()?, &out_dir("contact-sheet")?));
    steps.finish()
}

/// The web page's numbers. True if they could be measured.
pub(crate) fn measure_web_page() -> bool {
    let mut steps = Steps::new(in_ci());
    steps.step("the web page, measured", || web::measure(&out_dir("web-measured")?));
    steps.finish()
}

/// Real scenes, beside Mitsuba. True if they could be measured.
pub(crate) fn measure_scenes() -> bool {
    let mut steps = Steps::new(in_ci());
    steps.step("real scenes, measured", package::measure_scenes);
    steps.finish()
}

/// Only the window. True if nothing failed.
pub(crate) fn only_window() -> bool {
    let mut steps = Steps::new(in_ci());
    steps.step("the window", || open_window(&build()?));
    steps.finish()
}

/// Only a small comparison and its report. True if nothing failed.
pub(crate) fn only_report() -> bool {
    let mut steps = Steps::new(in_ci());
    steps.step("a comparison", || program::a_comparison(&build()?, &out_dir("comparison")?));
    steps.step("the report in a browser", open_report);
    steps.finish()
}

fn in_ci() -> bool {
    std::env::var("CI").is_ok_and(|ci| ci == "true")
}

/// What is needed to build must be there; the rest is named here and skipped where it is needed.
fn prerequisites() -> Result<Done> {
    let to_build = missing::to_build();
    let mut later = missing::to_open_a_window();
    later.extend(missing::to_read_a_video());
    later.extend(missing::to_open_a_report());
    later.extend(missing::to_open_firefox());
    for missing in &later {
        eprintln!("note: {missing}");
    }
    if !to_build.is_empty() {
        bail!("{}", lines(&to_build));
    }
    let remark = if later.is_empty() { "all there" } else { "some checks will be skipped" };
    Ok(Done::passed(remark))
}

fn formatting() -> Result<Done> {
    run(cargo(&["fmt", "--all", "--check"])).context("run `cargo fmt --all`")?;
    Ok(Done::passed(""))
}

fn clippy() -> Result<Done> {
    let clippy = ["clippy", "--workspace", "--all-targets", "--", "-D", "warnings"];
    let (_, success) = watch(cargo(&clippy), || |line: &str| !is_progress(line))?;
    ensure!(success, "clippy complains");
    Ok(Done::passed(""))
}

/// Unit, integration and documentation tests. `--show-output` because a passed test's output is hidden
/// otherwise, and with it the word that it skipped something; what passed is shown in numbers only, and kept in a file. This program's own tests pretend to skip, and are
/// run by themselves.
fn cargo_test() -> Result<Done> {
    let product =
        ["test", "--workspace", "--exclude", "xtask", "--no-fail-fast", "--", "--show-output"];
    let (output, success) = watch(cargo(&product), || {
        let mut is_of_success = false;
        move |line: &str| {
            is_of_success =
                is_of_success && !ends_successes(line) || line.starts_with("successes:");
            !(is_of_success || line.ends_with("... ok\n") || is_progress(line))
        }
    })?;
    std::fs::write(out_dir("tests")?.join("log"), &output).context("cannot keep their output")?;
    let count = Count::of(&output);
    ensure!(success, "`cargo test` failed ({count})");
    ensure!(count.passed > 0, "`cargo test` ran no tests");
    run(cargo(&["test", "--package", "xtask"]))?;
    Ok(Done { skipped: skips(&output), ..Done::passed(count.to_string()) })
}

/// What a build says of each package while nothing is wrong.
fn is_progress(line: &str) -> bool {
    ["Compiling", "Checking", "Downloaded"]
        .into_iter()
        .any(|word| line.trim_start().starts_with(word))
}

/// What follows the output of the tests that have passed.
fn ends_successes(line: &str) -> bool {
    line.starts_with("failures:") || line.starts_with("test result: ")
}

/// Build the program with the features that the tests were built with, so that little is built twice.
fn build() -> Result<PathBuf> {
    run(cargo(&["build", "--workspace", "--exclude", "xtask", "--bins"]))?;
    program()
}

/// The program lies beside this one.
fn program() -> Result<PathBuf> {
    let name = format!("frameless{}", std::env::consts::EXE_SUFFIX);
    let program = std::env::current_exe()?.with_file_name(name);
    ensure!(program.exists(), "{} was not built", program.display());
    Ok(program)
}

fn open_window(program: &Path) -> Result<Done> {
    if !cfg!(target_os = "linux") {
        return Ok(Done::skipped("the window: a virtual screen needs Linux"));
    }
    let missing = missing::to_open_a_window();
    if !missing.is_empty() {
        return Ok(Done::skipped(format!("the window: {}", lines(&missing).replace('\n', "; "))));
    }
    Ok(Done::passed(window::smoke(program, &out_dir("window")?)?))
}

/// The report of the comparison that was made before.
fn open_report() -> Result<Done> {
    let Some(browser) = missing::browser() else {
        let missing = lines(&missing::to_open_a_report());
        return Ok(Done::skipped(format!("the report in a browser: {missing}")));
    };
    let report = dir_of("comparison")?.join("smoke/report.html");
    Ok(Done::passed(browser::opens(browser, &report, &program::COMPARED_SCENES)?))
}

/// An empty folder beside the build's other outputs; what a check wrote stays there to be looked at.
fn out_dir(name: &str) -> Result<PathBuf> {
    let dir = dir_of(name)?;
    if dir.exists() {
        std::fs::remove_dir_all(&dir).with_context(|| format!("cannot empty {}", dir.display()))?;
    }
    std::fs::create_dir_all(&dir).with_context(|| format!("cannot make {}", dir.display()))?;
    Ok(dir)
}

/// A folder beside the build's other outputs.
fn dir_of(name: &str) -> Result<PathBuf> {
    let program = std::env::current_exe()?;
    let target =
        program.parent().and_then(Path::parent).context("xtask lies in no build folder")?;
    Ok(target.join("xtask").join(name))
}

fn lines(missing: &[Missing]) -> String {
    missing.iter().map(Missing::to_string).collect::<Vec<_>>().join("\n")
}

/// What tests said they skipped: lines that begin with the word.
fn skips(output: &str) -> Vec<String> {
    let mut skips: Vec<String> = output
        .lines()
        .filter_map(|line| line.strip_prefix("SKIPPED: "))
        .map(String::from)
        .collect();
    skips.sort();
    skips.dedup();
    skips
}

/// How many tests did what, summed over all test programs.
#[derive(Debug, Default, PartialEq, Eq)]
struct Count {
    passed: usize,
    failed: usize,
    ignored: usize,
}

impl Count {
    /// From lines like `test result: ok. 3 passed; 0 failed; 1 ignored; 0 measured; …`.
    fn of(output: &str) -> Count {
        let mut count = Count::default();
        for line in output.lines().filter(|line| line.starts_with("test result: ")) {
            let words: Vec<&str> = line.split([' ', ';']).collect();
            for pair in words.windows(2) {
                let number = pair[0].parse().unwrap_or(0);
                match pair[1] {
                    "passed" => count.passed += number,
                    "failed" => count.failed += number,
                    "ignored" => count.ignored += number,
                    _ => {}
                }
            }
        }
        count
    }
}

impl std::fmt::Display for Count {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} tests passed, {} failed, {} ignored", self.passed, self.failed, self.ignored)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const OUTPUT: &str = "\
test a ... ok
---- a stdout ----
SKIPPED: ../shared is missing
test result: ok. 3 passed; 0 failed; 1 ignored; 0 measured; 2 filtered out; finished in 0.1s
SKIPPED: ../shared is missing
test result: FAILED. 10 passed; 2 failed; 0 ignored; 0 measured; 0 filtered out; finished in 0.1s
";

    #[test]
    fn results_of_all_test_programs_are_summed() {
        assert_eq!(Count::of(OUTPUT), Count { passed: 13, failed: 2, ignored: 1 });
    }

    #[test]
    fn what_was_skipped_is_said_once() {
        assert_eq!(skips(OUTPUT), ["../shared is missing"]);
    }
}
