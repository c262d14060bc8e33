//! A sampler written in Python, as the engine sees it.

use std::cell::RefCell;

use frameless::{Canvas, Insight, Observation, Request, Sampler, SamplerKind, Time};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyType;

use crate::arguments::sampler_kind;
use crate::array;
use crate::builtin::BuiltinSampler;
use crate::handed_on::{self, Asked};
use crate::mirror::{CanvasView, Mirror};
use crate::observed::Observed;
use crate::own::Own;
use crate::raised::{Raised, Source};

/// What was given as a sampler.
pub(crate) enum Given {
    /// One of ours: by name, or with a seed of its own.
    Builtin(SamplerKind, Option<u64>),
    /// Any object with a method `choose`, and the reference to it.
    Python(PythonSampler, Own),
}

impl Given {
    pub(crate) fn of(given: &Bound<'_, PyAny>, raised: &Raised) -> PyResult<Given> {
        if let Ok(name) = given.extract::<String>() {
            return Ok(Given::Builtin(sampler_kind(&name)?, None));
        }
        if let Ok(builtin) = given.cast::<BuiltinSampler>() {
            let (kind, seed) = builtin.get().kind_and_seed();
            return Ok(Given::Builtin(kind, Some(seed)));
        }
        let own = Own::new(given.clone().unbind());
        Ok(Given::Python(PythonSampler::new(given, own.clone(), raised.clone())?, own))
    }

    /// A sampler for the engine, and the object behind it if it is Python's.
    pub(crate) fn build(self, seed: u64) -> (Box<dyn Sampler>, Option<Own>) {
        match self {
            Given::Builtin(kind, own_seed) => (kind.build(own_seed.unwrap_or(seed)), None),
            Given::Python(sampler, own) => (Box::new(sampler), Some(own)),
        }
    }
}

/// What it raises is kept for whoever called the engine; it is not asked again until then.
pub(crate) struct PythonSampler {
    sampler: Own,
    observes: bool,
    tells_probability: bool,
    refines: bool,
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
        let can_choose = sampler.getattr("choose").is_ok_and(|choose| choose.is_callable());
        if !can_choose || sampler.is_instance_of::<PyType>() {
            let came = sampler.repr()?;
            return Err(PyTypeError::new_err(format!(
                "sampler: wanted a name or an object with a method choose(now, canvas, count), got {came}"
            )));
        }
        let (observes, tells_probability) =
            (sampler.hasattr("observe")?, sampler.hasattr("probability")?);
        let (refines, mirror) = (false, RefCell::default());
        Ok(PythonSampler { sampler: own, observes, tells_probability, refines, mirror, raised })
    }

    /// The same object, for another engine.
    pub(crate) fn another(&self) -> PythonSampler {
        let (sampler, raised) = (self.sampler.clone(), self.raised.clone());
        let PythonSampler { observes, tells_probability, .. } = *self;
        let (refines, mirror) = (false, RefCell::default());
        PythonSampler { sampler, observes, tells_probability, refines, mirror, raised }
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
    ) -> PyResult<(Vec<i64>, Asked)> {
        // Gone with the garbage that it was part of.
        let Some(sampler) = self.sampler.get(py) else { return Ok(Default::default()) };
        let arguments = (now.secs(), self.view(py, canvas)?, count);
        let (pixels, asked) =
            handed_on::showing(canvas, || sampler.call_method1("choose", arguments));
        let pixels = array::integers("choose", &pixels?, Some(count))?;
        let most = canvas.size().pixels() as i64;
        match pixels.iter().find(|pixel| !(0..most).contains(*pixel)) {
            None => Ok((pixels, asked)),
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
            let tell = || sampler.call_method1("observe", (view, observed));
            handed_on::showing(canvas, tell).0?;
        }
        Ok(())
    }

    fn probability(&self, py: Python<'_>, now: Time, canvas: &Canvas) -> PyResult<Vec<f32>> {
        let Some(sampler) = self.sampler.get(py).filter(|_| self.tells_probability) else {
            return Ok(Vec::new());
        };
        let arguments = (now.secs(), self.view(py, canvas)?);
        let ask = || sampler.call_method1("probability", arguments);
        let known = handed_on::showing(canvas, ask).0?;
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
            Ok((pixels, mut asked)) => {
                self.refines = asked.refines;
                requests.extend(pixels.iter().map(|&pixel| asked.request(pixel as u32)));
            }
            Err(error) => self.raised.set(Source::Sampler, error),
        }
    }

    fn observe(&mut self, canvas: &Canvas, observations: &[Observation]) {
        if self.raised.is_set() {
            return;
        }
        let told = Python::attach(|py| self.told(py, canvas, observations));
        told.unwrap_or_else(|error| self.raised.set(Source::Sampler, error));
    }

    /// As those do that it hands its calls on to.
    fn refines(&self) -> bool {
        self.refines
    }

    fn inspect(&self, now: Time, canvas: &Canvas) -> Insight {
        if self.raised.is_set() {
            return Insight::default();
        }
        let probability = Python::attach(|py| self.probability(py, now, canvas));
        let probability = probability.unwrap_or_else(|error| {
            self.raised.set(Source::Sampler, error);
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
