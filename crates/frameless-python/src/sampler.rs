//! Samplers across the border: the built-in ones for Python, and Python's for the engine.

use std::sync::{Mutex, PoisonError};

use frameless::{
    Canvas, Observation, ReconstructionKind, Request, Sampler, SamplerKind, Size, Time,
};
use frameless_eval::Algorithm;
use numpy::{PyArray1, PyArray2};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;

use crate::array;
use crate::canvas::PyCanvas;
use crate::mirror::Mirror;
use crate::observed::Observed;
use crate::planes;
use crate::shared::Raised;

/// A sampler and a reconstruction by name, as in experiments.
pub(crate) fn named(
    sampler: &str,
    reconstruction: &str,
) -> PyResult<(SamplerKind, ReconstructionKind)> {
    match Algorithm::from_name(&format!("{sampler}+{reconstruction}")) {
        Ok(Algorithm::Frameless(sampler, reconstruction)) => Ok((sampler, reconstruction)),
        Ok(_) | Err(_) if SamplerKind::from_name(sampler).is_some() => {
            Err(PyValueError::new_err(format!(
                "reconstruction: wanted \"hold\", \"filter\" or \"reproject\", the last with +relight, +deep, +antialias; \
                 got {reconstruction:?}"
            )))
        }
        Ok(_) => Err(PyValueError::new_err(format!("sampler: {sampler:?} is not one"))),
        Err(message) => Err(PyValueError::new_err(format!("sampler: {message}"))),
    }
}

/// That a sampler is asked for at once.
const MOST_PIXELS: usize = 1 << 24;

/// What was given as a sampler: a name, one of ours, or any object with a method `choose`.
pub(crate) fn from_python(
    given: &Bound<'_, PyAny>,
    seed: u64,
    raised: &Raised,
) -> PyResult<Box<dyn Sampler>> {
    if let Ok(name) = given.extract::<String>() {
        return Ok(named(&name, "hold")?.0.build(seed));
    }
    if let Ok(builtin) = given.cast::<BuiltinSampler>() {
        let BuiltinSampler { kind, seed, .. } = builtin.get();
        return Ok(kind.build(*seed));
    }
    Ok(Box::new(PythonSampler::new(given, raised.clone())?))
}

/// One of the samplers that come with the package.
///
/// Parameters:
///
/// - `name`: "random", "permutation", "change" or "adaptive", with parameters in brackets: "adaptive(temporal=0.5)"
/// - `seed`: the same seed makes the same choices
///
/// Raises ValueError if there is no such sampler.
#[pyclass(frozen, module = "frameless")]
pub(crate) struct BuiltinSampler {
    name: String,
    kind: SamplerKind,
    seed: u64,
    sampler: Mutex<Box<dyn Sampler>>,
}

impl BuiltinSampler {
    fn sampler(&self) -> std::sync::MutexGuard<'_, Box<dyn Sampler>> {
        self.sampler.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[pymethods]
impl BuiltinSampler {
    #[new]
    #[pyo3(signature = (name, seed=1))]
    fn new(name: String, seed: u64) -> PyResult<BuiltinSampler> {
        let (kind, _) = named(&name, "hold")?;
        let sampler = Mutex::new(kind.build(seed));
        Ok(BuiltinSampler { name, kind, seed, sampler })
    }

    /// As given.
    #[getter]
    fn name(&self) -> &str {
        &self.name
    }

    /// Pixels to be traced next: `count` row-major numbers, uint32, shape (count,).
    ///
    /// `now` is the time in seconds, never before any sample on the canvas.
    fn choose<'py>(
        &self,
        py: Python<'py>,
        now: f64,
        canvas: &PyCanvas,
        count: usize,
    ) -> PyResult<Bound<'py, PyArray1<u32>>> {
        if count > MOST_PIXELS {
            let message = format!("count: wanted at most {MOST_PIXELS}, got {count}");
            return Err(PyValueError::new_err(message));
        }
        let pixels = canvas.shared.with(py, |state| {
            let mut requests = Vec::new();
            let canvas = state.engine.canvas();
            self.sampler().choose(Time::from_secs(now), canvas, count, &mut requests);
            requests.iter().map(|request| request.pixel).collect()
        })?;
        Ok(array::column(py, pixels))
    }

    /// Learn from samples that have just been written to the canvas.
    fn observe(&self, py: Python<'_>, canvas: &PyCanvas, observed: &Observed) -> PyResult<()> {
        canvas
            .shared
            .with(py, |state| self.sampler().observe(state.engine.canvas(), &observed.samples))
    }

    /// Probability that the next draw is each pixel: float32, shape (height, width), sum 1; None if the sampler does not know.
    fn probability<'py>(
        &self,
        py: Python<'py>,
        now: f64,
        canvas: &PyCanvas,
    ) -> PyResult<Option<Bound<'py, PyArray2<f32>>>> {
        let known = canvas.shared.with(py, |state| {
            let canvas = state.engine.canvas();
            (canvas.size(), self.sampler().inspect(Time::from_secs(now), canvas).probability)
        })?;
        planes::known_to_sampler(py, known)
    }

    fn __repr__(&self) -> String {
        format!("BuiltinSampler({:?}, seed={})", self.name, self.seed)
    }
}

/// A sampler written in Python, as the engine sees it. What it raises is kept for whoever called the engine; it is not asked
/// again until then.
pub(crate) struct PythonSampler {
    sampler: Py<PyAny>,
    observes: bool,
    mirror: Option<Mirror>,
    raised: Raised,
}

impl PythonSampler {
    pub(crate) fn new(sampler: &Bound<'_, PyAny>, raised: Raised) -> PyResult<PythonSampler> {
        if !sampler.getattr("choose").is_ok_and(|choose| choose.is_callable()) {
            let came = sampler.repr()?;
            return Err(PyTypeError::new_err(format!(
                "sampler: wanted a name or an object with a method choose(now, canvas, count), got {came}"
            )));
        }
        let observes = sampler.hasattr("observe")?;
        Ok(PythonSampler { sampler: sampler.clone().unbind(), observes, mirror: None, raised })
    }

    fn chosen(
        &mut self,
        py: Python<'_>,
        now: Time,
        canvas: &Canvas,
        count: usize,
    ) -> PyResult<Vec<i64>> {
        let view = Mirror::of(&mut self.mirror, py, canvas)?;
        let pixels = self.sampler.bind(py).call_method1("choose", (now.secs(), view, count))?;
        let pixels = array::integers("choose", &pixels, Some(count))?;
        let most = canvas.size().pixels() as i64;
        match pixels.iter().find(|pixel| !(0..most).contains(*pixel)) {
            None => Ok(pixels),
            Some(pixel) => Err(PyValueError::new_err(format!(
                "choose: wanted pixel numbers from 0 to {}, got {pixel}",
                most - 1
            ))),
        }
    }

    fn told(&mut self, py: Python<'_>, canvas: &Canvas, samples: &[Observation]) -> PyResult<()> {
        let view = Mirror::of(&mut self.mirror, py, canvas)?;
        if let Some(mirror) = &self.mirror {
            mirror.write(py, canvas, samples)?;
        }
        if self.observes {
            let observed = Observed { samples: samples.to_vec() };
            self.sampler.bind(py).call_method1("observe", (view, observed))?;
        }
        Ok(())
    }
}

impl Sampler for PythonSampler {
    fn choose(&mut self, now: Time, canvas: &Canvas, count: usize, requests: &mut Vec<Request>) {
        if self.raised.is_set() {
            return;
        }
        match Python::attach(|py| self.chosen(py, now, canvas, count)) {
            Ok(pixels) => {
                requests.extend(pixels.iter().map(|&pixel| Request::centre(pixel as u32)))
            }
            Err(error) => self.raised.set(error),
        }
    }

    fn observe(&mut self, canvas: &Canvas, observations: &[Observation]) {
        if self.raised.is_set() {
            return;
        }
        let told = Python::attach(|py| self.told(py, canvas, observations));
        told.unwrap_or_else(|error| self.raised.set(error));
    }
}

/// For canvases that nobody chooses pixels of.
pub(crate) struct Nobody;

impl Sampler for Nobody {
    fn choose(&mut self, _: Time, _: &Canvas, _: usize, _: &mut Vec<Request>) {}
}

/// Length check for callers that bring pixel numbers.
pub(crate) fn on_canvas(pixels: Vec<i64>, size: Size) -> PyResult<Vec<u32>> {
    let most = size.pixels() as i64;
    let within = |(i, pixel): (usize, i64)| match (0..most).contains(&pixel) {
        true => Ok(pixel as u32),
        false => Err(PyValueError::new_err(format!(
            "pixel: wanted numbers from 0 to {}, got {pixel} at index {i}",
            most - 1
        ))),
    };
    pixels.into_iter().enumerate().map(within).collect()
}
