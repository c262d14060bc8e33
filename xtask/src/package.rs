//! The Python package: built as a wheel, installed into the project's `.venv`, and checked there as its users have it.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

use anyhow::{Context, Result, bail, ensure};

use crate::command::{cargo, output_within, run};
use crate::missing;
use crate::picture;
use crate::python::{in_project, install, python};
use crate::steps::{Done, Steps};

const REQUIREMENTS: &str = "python/requirements-dev.txt";

/// With everything else built, it takes a minute or two; the first time it is built with all that it needs.
const BUILDS_WITHIN: Duration = Duration::from_secs(1500);
const CHECKS_WITHIN: Duration = Duration::from_secs(600);

/// Examples that need nothing but numpy, with the arguments of a short run.
const EXAMPLES: [(&str, &[&str]); 2] =
    [("sdf.py", &["--seconds", "3"]), ("path_tracer.py", &["--seconds", "6"])];
/// Those that need Mitsuba, and an LLVM for it.
const MITSUBA: [(&str, &[&str]); 2] = [
    ("mitsuba_viewer.py", &["--seconds", "4"]),
    (
        "mitsuba_edit.py",
        &["--size", "80x60", "--before", "2", "--seconds", "2", "--reference", "32"],
    ),
];

/// The steps of the package, one after the other; `out_dir` makes an empty folder for what a step leaves.
pub(crate) fn steps(steps: &mut Steps, out_dir: impl Fn(&str) -> Result<PathBuf>) {
    let mut is_built = false;
    steps.step("Python: build the wheel", || {
        let done = build(&out_dir("wheel")?)?;
        is_built = done.skipped.is_empty();
        Ok(done)
    });
    if !is_built {
        return;
    }
    steps.step("Python: tests", tests);
    steps.step("Python: types and stubs", types);
    steps.step("Python: reference", || reference(&out_dir("python-reference")?));
    steps.step("Python: examples", || examples(&out_dir("python-examples")?));
    steps.step("Python: Mitsuba", || mitsuba(&out_dir("python-mitsuba")?));
    steps.step("Python: the notebook", || notebook(&out_dir("python-notebook")?));
}

/// The wheel in the profile of the tests, so that what these have built is not built again.
fn build(out: &Path) -> Result<Done> {
    if let Some(missing) = missing::to_make_a_venv() {
        return Ok(Done::skipped(format!("the Python package: {missing}")));
    }
    if let Err(error) = install(REQUIREMENTS) {
        return Ok(Done::skipped(format!(
            "the Python package: the packages of {REQUIREMENTS} could not be installed: {error:#}"
        )));
    }
    let mut maturin = python();
    maturin.current_dir(in_project("python"));
    maturin.args(["-m", "maturin", "build", "--quiet", "--profile", "dev", "--out"]).arg(out);
    said(&mut maturin, BUILDS_WITHIN)?;
    let wheels: Vec<PathBuf> =
        out.read_dir()?.map(|entry| Ok(entry?.path())).collect::<Result<_>>()?;
    let [wheel] = wheels.as_slice() else { bail!("wanted one wheel, got {wheels:?}") };
    let name = wheel.file_name().unwrap_or_default().to_string_lossy();
    let is_named = name.starts_with("frameless-") && name.contains("-cp310-abi3-");
    ensure!(is_named, "wanted a wheel named frameless-…-cp310-abi3-…, got {name}");
    // Whether the compiled half keeps to what its tag promises.
    let mut audit = python();
    said(audit.args(["-m", "abi3audit", "--strict"]).arg(wheel), CHECKS_WITHIN)?;
    let mut pip = python();
    pip.args(["-m", "pip", "install", "--quiet", "--disable-pip-version-check"]);
    pip.args(["--force-reinstall", "--no-deps"]).arg(wheel);
    said(&mut pip, CHECKS_WITHIN)?;
    let bytes = wheel.metadata()?.len();
    Ok(Done::passed(format!("{} MB", bytes / 1_000_000)))
}

/// The speed of samples of real scenes beside Mitsuba's, what an edit, loading and memory take, with everything optimised. The numbers
/// are printed.
pub(crate) fn measure_scenes() -> Result<Done> {
    if let Some(missing) = missing::to_make_a_venv() {
        return Ok(Done::skipped(format!("real scenes: {missing}")));
    }
    install(REQUIREMENTS)?;
    run(cargo(&["build", "--release", "--bin", "frameless"]))?;
    let mut measuring = python();
    measuring.arg("python/against_mitsuba/measure.py").arg("target/release/frameless");
    if let Some(llvm) = missing::llvm() {
        measuring.env("DRJIT_LIBLLVM_PATH", llvm);
    }
    run(measuring)?;
    Ok(Done::passed(""))
}

/// pytest, from a folder where `import frameless` finds what is installed.
fn tests() -> Result<Done> {
    let mut pytest = python();
    pytest.current_dir(in_project("python/tests"));
    pytest.args(["-m", "pytest", "-rs", "--color=no", "-p", "no:cacheprovider", "-c"]);
    pytest.arg("../pyproject.toml").arg("--rootdir=.").arg(".");
    if let Some(llvm) = missing::llvm() {
        pytest.env("DRJIT_LIBLLVM_PATH", llvm);
    }
    let text = said(&mut pytest, CHECKS_WITHIN)?;
    eprint!("{text}");
    Ok(Done { skipped: skipped_by_pytest(&text), ..Done::passed("") })
}

/// mypy on the package and its tests (strict) and on the examples, and the compiled half against its stub and its docstrings.
fn types() -> Result<Done> {
    let mut mypy = python();
    mypy.current_dir(in_project("python")).args(["-m", "mypy"]);
    let text = said(&mut mypy, CHECKS_WITHIN)?;
    for (folder, how) in [
        ("tests", "--strict"),
        ("docs", "--strict"),
        ("against_mitsuba", "--strict"),
        ("examples", "--check-untyped-defs"),
    ] {
        let mut mypy = python();
        mypy.current_dir(in_project("python").join(folder));
        said(mypy.args(["-m", "mypy", "--config-file=", how, "."]), CHECKS_WITHIN)?;
    }
    let mut stubtest = python();
    stubtest.current_dir(in_project("python/tests"));
    stubtest.args(["-m", "mypy.stubtest", "frameless", "--concise"]);
    said(&mut stubtest, CHECKS_WITHIN)?;
    let mut docstrings = python();
    docstrings.current_dir(in_project("python/tests"));
    said(docstrings.args(["../docs/stub_docs.py", "--check"]), CHECKS_WITHIN)?;
    Ok(Done::passed(text.trim()))
}

/// The API reference from the docstrings.
fn reference(out: &Path) -> Result<Done> {
    let mut pdoc = python();
    pdoc.current_dir(in_project("python/tests"));
    said(pdoc.arg("../docs/reference.py").arg(out), CHECKS_WITHIN)?;
    let pages: [(&str, &[&str]); 3] = [
        ("frameless.html", &["Session", "Batch.submit", "Sampler", "compare", "view", "Row.rmse"]),
        ("frameless/plot.html", &["error_over_time"]),
        ("frameless/testing.html", &["check_sampler"]),
    ];
    for (file, names) in pages {
        let page = std::fs::read_to_string(out.join(file))?;
        for name in names {
            let anchor = format!("id=\"{name}\"");
            ensure!(page.contains(&anchor), "the reference does not know {name}");
        }
    }
    let page = std::fs::read_to_string(out.join("frameless.html"))?;
    let is_explained = page.contains("sampler=None, reconstruction=") && page.contains("budget");
    ensure!(is_explained, "the reference does not say how a Session is made");
    Ok(Done::passed(format!("{}/index.html", out.display())))
}

fn examples(out: &Path) -> Result<Done> {
    for (script, arguments) in EXAMPLES {
        run_example(script, arguments, out, None)?;
    }
    Ok(Done::passed(format!("{}", out.display())))
}

/// Mitsuba compiles its kernels with an LLVM of the machine.
fn mitsuba(out: &Path) -> Result<Done> {
    let Some(llvm) = missing::llvm() else {
        return Ok(Done::skipped(format!("examples with Mitsuba: {}", missing::to_run_mitsuba())));
    };
    for (script, arguments) in MITSUBA {
        run_example(script, arguments, out, Some(&llvm))?;
    }
    Ok(Done::passed(format!("{}", out.display())))
}

fn run_example(script: &str, arguments: &[&str], out: &Path, llvm: Option<&Path>) -> Result<()> {
    let shot = out.join(script).with_extension("png");
    let mut example = python();
    example.current_dir(in_project("python/examples"));
    example.args(["-W", "error", script]).args(arguments).arg("--picture").arg(&shot);
    if let Some(llvm) = llvm {
        example.env("DRJIT_LIBLLVM_PATH", llvm);
    }
    eprint!("{script}: {}", said(&mut example, CHECKS_WITHIN).with_context(|| script.to_owned())?);
    picture::shows_something(&shot)?;
    Ok(())
}

/// Executes the notebook; what it shows is in the copy.
fn notebook(out: &Path) -> Result<Done> {
    let mut execute = python();
    execute.current_dir(in_project("python/examples"));
    execute.args(["execute_notebook.py", "figures.ipynb", "--out"]).arg(out);
    let text = said(&mut execute, CHECKS_WITHIN)?;
    Ok(Done::passed(text.trim()))
}

fn said(command: &mut Command, limit: Duration) -> Result<String> {
    // Users have no source of the package beside their scripts, and warnings of bytecode caches are nobody's.
    command.env("PYTHONDONTWRITEBYTECODE", "1").env_remove("PYTHONPATH");
    let output = output_within(command, limit)?;
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    let complaint = String::from_utf8_lossy(&output.stderr);
    ensure!(output.status.success(), "{}\n{text}{complaint}", output.status);
    Ok(text)
}

/// Lines such as `SKIPPED [1] test_parts.py:9: ../shared is missing`.
fn skipped_by_pytest(output: &str) -> Vec<String> {
    output.lines().filter_map(|line| line.strip_prefix("SKIPPED ")).map(String::from).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_pytest_skipped_is_said() {
        let output = "....s\nSKIPPED [1] test_parts.py:9: ../shared is missing\n4 passed, 1 skipped in 2 s\n";
        assert_eq!(skipped_by_pytest(output), ["[1] test_parts.py:9: ../shared is missing"]);
    }
}
