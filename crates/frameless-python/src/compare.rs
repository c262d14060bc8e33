//! Experiments from Python: rows of numbers, one per run, with samplers of Python's own among the algorithms.

use std::path::Path;

use frameless::Sampler;
use frameless_eval::{
    Algorithm, Cell, Curve, EvalError, Experiment, Ideals, RunResult, Subject, run, run_sampler,
};
use pyo3::exceptions::{PyOSError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use rayon::prelude::*;

use crate::array;
use crate::interrupt::{Stop, interruptible};
use crate::raised::Raised;
use crate::sampler::Given;

/// A sampler from Python among the algorithms: its name, how its samples are shown, and what makes one of a seed.
type Custom<'py> = (String, String, Bound<'py, PyAny>);

/// A run to be made.
struct Planned {
    name: String,
    cell: Cell,
    /// Instead of the algorithm's own.
    sampler: Option<Box<dyn Sampler>>,
}

/// Runs an experiment (TOML text, its folder) and returns one dict per run. Without `with_named` only custom samplers run.
#[pyfunction]
pub(crate) fn run_experiment<'py>(
    py: Python<'py>,
    text: &str,
    folder: &str,
    with_named: bool,
    custom: Vec<Custom<'py>>,
) -> PyResult<Vec<Bound<'py, PyDict>>> {
    let experiment = Experiment::parse(text, Path::new(folder)).map_err(PyValueError::new_err)?;
    let raised = Raised::default();
    let mut plans = Vec::new();
    for scene in &experiment.scenes {
        let mut plan = Vec::new();
        for &rate in &experiment.samples_per_sec {
            if with_named {
                plan.extend(named(&experiment, &scene.name, rate));
            }
            for (name, shown, factory) in &custom {
                plan.extend(customs(
                    &experiment,
                    &scene.name,
                    rate,
                    (name, shown, factory),
                    &raised,
                )?);
            }
        }
        plans.push(plan);
    }
    let for_work = raised.clone();
    let work = move |stop: &Stop| -> Result<Vec<(String, RunResult)>, EvalError> {
        let mut results = Vec::new();
        for (spec, plan) in experiment.scenes.iter().zip(plans) {
            let subject = Subject::load(spec)?;
            let ideals = Ideals::trace(&subject, &experiment, &|| (), &|| stop.is_set());
            let ideals = ideals.ok_or(EvalError::Interrupted)?;
            let go_on = || !stop.is_set() && !for_work.is_set();
            let made = plan.into_par_iter().map(|planned| {
                let Planned { name, cell, sampler } = planned;
                let mut look = |_: usize, _: &_| go_on();
                let result = match sampler {
                    None => run(&cell, &experiment, &subject, &ideals, &mut look),
                    Some(sampler) => {
                        run_sampler(sampler, &cell, &experiment, &subject, &ideals, &mut look)
                    }
                };
                Ok((name, result?))
            });
            results.extend(made.collect::<Result<Vec<_>, EvalError>>()?);
        }
        Ok(results)
    };
    let results = interruptible(py, work)?;
    raised.take()?;
    let results = results.map_err(|error| match error.is_bad_input() {
        true => PyValueError::new_err(error.to_string()),
        false => PyOSError::new_err(error.to_string()),
    })?;
    results.iter().map(|(name, result)| row(py, name, result)).collect()
}

fn named<'a>(
    experiment: &'a Experiment,
    scene: &'a str,
    rate: f64,
) -> impl Iterator<Item = Planned> + 'a {
    experiment.algorithms.iter().flat_map(move |algorithm| {
        // One seed is enough where it makes no difference.
        let seeds = if algorithm.is_seeded() { experiment.seeds.len() } else { 1 };
        experiment.seeds.iter().take(seeds).map(move |&seed| Planned {
            name: algorithm.name(),
            cell: cell(scene, algorithm.clone(), rate, seed),
            sampler: None,
        })
    })
}

fn customs(
    experiment: &Experiment,
    scene: &str,
    rate: f64,
    (name, shown, factory): (&str, &str, &Bound<'_, PyAny>),
    raised: &Raised,
) -> PyResult<Vec<Planned>> {
    // The sampler of that name is not used.
    let algorithm = Algorithm::from_name(&format!("random+{shown}")).map_err(|_| {
        PyValueError::new_err(format!("algorithm {name:?}: there is no reconstruction {shown:?}"))
    })?;
    let plan = |&seed: &u64| {
        let (sampler, _) = Given::of(&factory.call1((seed,))?, raised)?.build(seed);
        let cell = cell(scene, algorithm.clone(), rate, seed);
        Ok(Planned { name: name.to_owned(), cell, sampler: Some(sampler) })
    };
    experiment.seeds.iter().map(plan).collect()
}

fn cell(scene: &str, algorithm: Algorithm, samples_per_sec: f64, seed: u64) -> Cell {
    Cell { scene: scene.to_owned(), algorithm, samples_per_sec, seed }
}

fn row<'py>(py: Python<'py>, name: &str, run: &RunResult) -> PyResult<Bound<'py, PyDict>> {
    let row = PyDict::new(py);
    row.set_item("scene", &run.scene)?;
    row.set_item("algorithm", name)?;
    row.set_item("samples_per_sec", run.samples_per_sec)?;
    row.set_item("seed", run.seed)?;
    row.set_item("width", run.width)?;
    row.set_item("height", run.height)?;
    row.set_item("display_hz", run.display_hz)?;
    let curves: [(&str, &Curve); 6] = [
        ("rmse", &run.rmse),
        ("psnr_db", &run.psnr_db),
        ("rmse_changed", &run.rmse_changed),
        ("ssim", &run.ssim),
        ("flip", &run.flip),
        ("age_secs", &run.age_secs),
    ];
    for (key, curve) in curves {
        row.set_item(key, curve.mean.unwrap_or(f64::NAN))?;
    }
    row.set_item("rmse_p95", run.rmse.p95.unwrap_or(f64::NAN))?;
    row.set_item("oldest_secs", run.oldest_secs)?;
    let over_time = run.rmse.values.iter().map(|value| value.unwrap_or(f64::NAN)).collect();
    row.set_item("rmse_over_time", array::column(py, over_time))?;
    Ok(row)
}
