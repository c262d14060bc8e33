//! A sampler written in Python, as the engine sees it.

use std::cell::RefCell;

use frameless::{Canvas, Insight, Observation, Request, Sampler, Time};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;

use crate::array;
use crate::builtin::BuiltinSampler;
use crate::mirror::{self, CanvasView, Mirror};
use crate::names::sampler_kind;
use crate::observed::Observed;
use crate::own::Own;
use crate::shared::Raised;

/// A sampler for the engine, and the object behind it if it is Python's.
pub(crate) type Brought = (Box<dyn Sampler>, Option<Own>);

/// What was given as a sampler: a name, one of ours, or any object with a method `choose`.
pub(crate) fn from_python(
    given: &Bound<'_, PyAny>,
    seed: u64,
    raised: &Raised,
) -> PyResult<Brought> {
    if let Ok(name) = given.extract::<String>() {
        return Ok((sampler_kind(&name)?.build(seed), None));
    }
    if let Ok(builtin) = given.cast::<BuiltinSampler>() {
        return Ok((builtin.get().another(), None));
    }
    let own = Own::new(given.clone().unbind());
    Ok((Box::new(PythonSampler::new(given, own.clone(), raised.clone())?), Some(own)))
}

/// What it raises is kept for whoever called the engine; it is not asked again until then.
pub(crate) struct PythonSampler {
    sampler: Own,
    observes: bool,
    tells_probability: bool,
    mirror: RefCell<Option<Mirror>>,
    raised: Raised,
}

impl PythonSampler {
    /// `own` holds `sampler`.
    pub(crate) fn new(
        sampler: &Bound<'_, PyAny>,
        own: Own,
        raised: Raised,
    ) -> PyResult<PythonSampler> {
        if !sampler.getattr("choose").is_ok_and(|choose| choose.is_callable()) {
            let came = sampler.repr()?;
            return Err(PyTypeError::new_err(format!(
                "sampler: wanted a name or an object with a method choose(now, canvas, count), got {came}"
            )));
        }
        let (observes, tells_probability) =
            (sampler.hasattr("observe")?, sampler.hasattr("probability")?);
        let mirror = RefCell::default();
        Ok(PythonSampler { sampler: own, observes, tells_probability, mirror, raised })
    }

    /// The same object, for another engine.
    pub(crate) fn another(&self) -> PythonSampler {
        let (sampler, raised) = (self.sampler.clone(), self.raised.clone());
        let PythonSampler { observes, tells_probability, .. } = *self;
        PythonSampler { sampler, observes, tells_probability, mirror: RefCell::default(), raised }
    }

    /// The canvas as Python sees it.
    fn view(&self, py: Python<'_>, canvas: &Canvas) -> PyResult<Py<CanvasView>> {
        Mirror::of(&mut self.mirror.borrow_mut(), py, canvas)
    }

    fn chosen(
        &self,
        py: Python<'_>,
        now: Time,
        canvas: &Canvas,
        count: usize,
    ) -> PyResult<Vec<i64>> {
        // Gone with the garbage that it was part of.
        let Some(sampler) = self.sampler.get(py) else { return Ok(Vec::new()) };
        let arguments = (now.secs(), self.view(py, canvas)?, count);
        let pixels = mirror::showing(canvas, || sampler.call_method1("choose", arguments))?;
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

    fn told(&self, py: Python<'_>, canvas: &Canvas, samples: &[Observation]) -> PyResult<()> {
        let Some(sampler) = self.sampler.get(py) else { return Ok(()) };
        let view = self.view(py, canvas)?;
        if let Some(mirror) = &*self.mirror.borrow() {
            mirror.write(py, canvas, samples)?;
        }
        if self.observes {
            let observed = Observed { samples: samples.to_vec(), size: canvas.size() };
            mirror::showing(canvas, || sampler.call_method1("observe", (view, observed)))?;
        }
        Ok(())
    }

    fn probability(&self, py: Python<'_>, now: Time, canvas: &Canvas) -> PyResult<Vec<f32>> {
        let Some(sampler) = self.sampler.get(py).filter(|_| self.tells_probability) else {
            return Ok(Vec::new());
        };
        let arguments = (now.secs(), self.view(py, canvas)?);
        let known = mirror::showing(canvas, || sampler.call_method1("probability", arguments))?;
        match known.is_none() {
            true => Ok(Vec::new()),
            false => array::probabilities("probability", &known, canvas.size()),
        }
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

    fn inspect(&self, now: Time, canvas: &Canvas) -> Insight {
        if self.raised.is_set() {
            return Insight::default();
        }
        let probability = Python::attach(|py| self.probability(py, now, canvas));
        let probability = probability.unwrap_or_else(|error| {
            self.raised.set(error);
            Vec::new()
        });
        Insight { probability, ..Insight::default() }
    }
}

/// For canvases that nobody chooses pixels of.
pub(crate) struct Nobody;

impl Sampler for Nobody {
    fn choose(&mut self, _: Time, _: &Canvas, _: usize, _: &mut Vec<Request>) {}
}
