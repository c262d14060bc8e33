//! The built-in samplers, as parts for Python.

use std::collections::VecDeque;
use std::sync::{Mutex, PoisonError};

use frameless::{Canvas, Request, Sampler, SamplerKind, Size, Time};
use numpy::{PyArray1, PyArray2};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;

use crate::arguments::{any_size, sampler_kind, whole};
use crate::array;
use crate::canvas::{PyCanvas, checked};
use crate::handed_on;
use crate::mirror::CanvasView;
use crate::observed::Observed;
use crate::planes;

/// One of the samplers that come with the package.
///
/// Parameters:
///
/// - `name`: "random", "permutation", "change" or "adaptive", with parameters in brackets: "adaptive(temporal=0.5)"
/// - `seed`: the same seed makes the same choices
///
/// A sampler of your own may hand its calls on to one: `canvas` is a Canvas, or what a sampler is given by a session. It learns of one
/// canvas; with one of another size it begins anew.
///
/// Raises ValueError if there is no such sampler.
#[pyclass(frozen, module = "frameless")]
pub(crate) struct BuiltinSampler {
    name: String,
    kind: SamplerKind,
    seed: u64,
    sampler: Mutex<Learned>,
}

/// What is known, and of which size of canvas.
struct Learned {
    sampler: Box<dyn Sampler>,
    size: Option<Size>,
    /// Chosen already: `adaptive` chooses one more or less now and then.
    spare: VecDeque<Request>,
}

impl Learned {
    fn choose(&mut self, now: Time, canvas: &Canvas, count: usize) -> Vec<Request> {
        let mut requests = Vec::new();
        // It may owe some, but not for ever.
        for _ in 0..MOST_TURNS {
            let missing = count.saturating_sub(self.spare.len());
            if missing == 0 {
                break;
            }
            self.sampler.choose(now, canvas, missing, &mut requests);
            self.spare.extend(requests.drain(..));
        }
        self.spare.drain(..count.min(self.spare.len())).collect()
    }
}

const MOST_TURNS: usize = 64;

/// That a sampler is asked for at once.
const MOST_PIXELS: u32 = 1 << 24;

impl BuiltinSampler {
    pub(crate) fn kind_and_seed(&self) -> (SamplerKind, u64) {
        (self.kind, self.seed)
    }

    /// Works on the sampler and a canvas of Python's, without the interpreter.
    fn with<R: Send>(
        &self,
        canvas: &Bound<'_, PyAny>,
        work: impl FnOnce(&mut Learned, &Canvas) -> R + Send,
    ) -> PyResult<R> {
        let py = canvas.py();
        let work = |canvas: &Canvas| {
            let mut learned = self.sampler.lock().unwrap_or_else(PoisonError::into_inner);
            if learned.size.replace(canvas.size()).is_some_and(|size| size != canvas.size()) {
                learned.sampler = self.kind.build(self.seed);
                learned.spare.clear();
            }
            work(&mut learned, canvas)
        };
        if let Ok(canvas) = canvas.cast::<PyCanvas>() {
            return canvas.get().shared.with(py, |state| work(state.engine.canvas()));
        }
        if canvas.is_instance_of::<CanvasView>() {
            return handed_on::with_shown(|canvas| py.detach(|| work(canvas)));
        }
        let came = canvas.get_type().name()?;
        Err(PyTypeError::new_err(format!(
            "canvas: wanted a Canvas, or what a sampler is given by its session, got {came}"
        )))
    }
}

#[pymethods]
impl BuiltinSampler {
    #[new]
    #[pyo3(signature = (name, seed=1))]
    fn new(name: String, #[pyo3(from_py_with = any_size)] seed: i128) -> PyResult<BuiltinSampler> {
        let (kind, seed) = (sampler_kind(&name)?, whole("seed", seed, 0..=u64::MAX)?);
        let sampler =
            Mutex::new(Learned { sampler: kind.build(seed), size: None, spare: VecDeque::new() });
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
        now: f64,
        canvas: &Bound<'py, PyAny>,
        #[pyo3(from_py_with = any_size)] count: i128,
    ) -> PyResult<Bound<'py, PyArray1<u32>>> {
        let now = checked(now)?;
        let count = whole("count", count, 0..=MOST_PIXELS)? as usize;
        let py = canvas.py();
        let (requests, refines) = self.with(canvas, |learned, canvas| {
            (learned.choose(now, canvas, count), learned.sampler.refines())
        })?;
        if canvas.is_instance_of::<CanvasView>() {
            handed_on::note(&requests, refines);
        }
        let pixels = requests.iter().map(|request| request.pixel).collect();
        Ok(array::column(py, pixels))
    }

    /// Learn from samples that have just been written to the canvas.
    ///
    /// Raises ValueError if they were written to one of another size.
    fn observe(&self, canvas: &Bound<'_, PyAny>, observed: &Observed) -> PyResult<()> {
        self.with(canvas, |learned, canvas| {
            if observed.size != canvas.size() {
                let (kept, came) = (observed.size, canvas.size());
                return Err(PyValueError::new_err(format!(
                    "observed: wanted samples of a canvas of {}×{} pixels, got some of {}×{}",
                    came.width, came.height, kept.width, kept.height
                )));
            }
            learned.sampler.observe(canvas, &observed.samples);
            Ok(())
        })?
    }

    /// Probability that the next draw is each pixel: float32, shape (height, width), sum 1; None if the sampler does not know.
    fn probability<'py>(
        &self,
        now: f64,
        canvas: &Bound<'py, PyAny>,
    ) -> PyResult<Option<Bound<'py, PyArray2<f32>>>> {
        let (now, py) = (checked(now)?, canvas.py());
        let known = self.with(canvas, |learned, canvas| {
            (canvas.size(), learned.sampler.inspect(now, canvas).probability)
        })?;
        planes::known_to_sampler(py, known)
    }

    fn __repr__(&self) -> String {
        format!("BuiltinSampler({:?}, seed={})", self.name, self.seed)
    }
}
