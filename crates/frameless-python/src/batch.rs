//! Pixels that want to be traced, and the way back for their colours.

use std::sync::{Arc, Mutex, PoisonError};

use frameless::Answer;
use numpy::PyArray1;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::array;
use crate::camera::Camera;
use crate::columns;
use crate::hits::Arrays;
use crate::outside::Transforms;
use crate::shared::Shared;
use crate::size::pair;

/// Places in the picture that want to be traced at one time; given out by `for batch in session`.
///
/// Answer it with `submit`, whole or in parts, at once or later, from any thread, before or after other batches, or not at
/// all: samples that do not come are chosen again. Arrays are made anew at each access; keep them if you need them twice.
#[pyclass(frozen, module = "frameless")]
pub(crate) struct Batch {
    shared: Arc<Shared>,
    asked: frameless::Batch,
    session_seed: u64,
    camera: Option<Camera>,
    transforms: Transforms,
    answered: Mutex<Answered>,
}

/// Which samples have been answered.
struct Answered {
    left: usize,
    /// Empty as long as none has.
    mask: Vec<bool>,
}

impl Batch {
    pub(crate) fn new(
        shared: Arc<Shared>,
        asked: frameless::Batch,
        session_seed: u64,
        camera: Option<Camera>,
        transforms: Transforms,
    ) -> Batch {
        let answered = Mutex::new(Answered { left: asked.requests.len(), mask: Vec::new() });
        Batch { shared, asked, session_seed, camera, transforms, answered }
    }

    fn position_px(&self, i: usize) -> [f32; 2] {
        self.asked.requests[i].position_px(self.asked.size)
    }

    /// Checks and keeps an answer; `which`: numbers of the samples in it, all if there is none.
    pub(crate) fn take(
        &self,
        py: Python<'_>,
        arrays: &Arrays<'_, '_>,
        which: Option<Vec<usize>>,
    ) -> PyResult<usize> {
        let number = |i: usize| which.as_ref().map_or(i, |which| which[i]);
        let at = |i: usize| {
            let [x, y] = self.position_px(number(i));
            format!("sample {i} (x = {x}, y = {y}) of batch {}", self.asked.id)
        };
        let n = which.as_ref().map_or(self.asked.requests.len(), Vec::len);
        let (rgb, hits) = arrays.checked(n, &at)?;
        if hits.is_some() && self.camera.is_none() {
            return Err(PyValueError::new_err(
                "position: wanted a session with a camera, which says where positions are in the picture; \
                 set session.camera",
            ));
        }
        Shared::must_not_hold()?;
        let is_last = self.mark(n, &number)?;
        let requests = match &which {
            None => self.asked.requests.clone(),
            Some(which) => which.iter().map(|&i| self.asked.requests[i]).collect(),
        };
        self.shared.with(py, |state| {
            let frameless::Batch { id, now, scene_secs, size, .. } = self.asked;
            let surfaces = hits
                .zip(self.camera.as_ref())
                .map(|(hits, camera)| hits.surfaces(&requests, size, camera, &self.transforms));
            let surfaces = surfaces.unwrap_or_default();
            state.engine.tracer_mut().note(&surfaces);
            let answer = Answer { batch: id, now, scene_secs, size, requests, rgb, surfaces };
            let kept = state
                .engine
                .answer(answer)
                .map_err(|error| PyValueError::new_err(error.to_string()))?;
            state.note_changes();
            if is_last {
                state.note_duration(self.asked.requests.len(), now);
            }
            Ok(kept)
        })?
    }

    /// Marks samples as answered, all or none of them. Returns whether they were the last.
    fn mark(&self, n: usize, number: &dyn Fn(usize) -> usize) -> PyResult<bool> {
        let mut answered = self.answered.lock().unwrap_or_else(PoisonError::into_inner);
        let total = self.asked.requests.len();
        if answered.mask.is_empty() {
            answered.mask.resize(total, false);
        }
        for i in 0..n {
            if std::mem::replace(&mut answered.mask[number(i)], true) {
                if (0..i).any(|before| number(before) == number(i)) {
                    (0..i).for_each(|before| answered.mask[number(before)] = false);
                    return Err(PyValueError::new_err(format!(
                        "where: wanted each sample once, got sample {} twice",
                        number(i)
                    )));
                }
                (0..i).for_each(|before| answered.mask[number(before)] = false);
                return Err(PyValueError::new_err(format!(
                    "sample {} of batch {} has been answered already; say `where` for parts of a batch",
                    number(i),
                    self.asked.id
                )));
            }
        }
        answered.left -= n;
        Ok(answered.left == 0)
    }

    pub(crate) fn asked(&self) -> &frameless::Batch {
        &self.asked
    }

    pub(crate) fn session_seed(&self) -> u64 {
        self.session_seed
    }

    pub(crate) fn camera_of_size(&self) -> Option<Camera> {
        self.camera.map(|camera| camera.of_size(self.asked.size))
    }
}

#[pymethods]
impl Batch {
    /// Number of the batch, from 0.
    #[getter]
    fn id(&self) -> u64 {
        self.asked.id
    }

    /// Columns to be traced, in pixels from the picture's left border (the first pixel's centre is 0.5): float32, shape (n,).
    #[getter]
    fn x<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f32>> {
        columns::x(py, &self.asked)
    }

    /// Rows to be traced, in pixels from the picture's upper border: float32, shape (n,).
    #[getter]
    fn y<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f32>> {
        columns::y(py, &self.asked)
    }

    /// Row-major pixel numbers, y · width + x: uint32, shape (n,).
    #[getter]
    fn pixel<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<u32>> {
        columns::pixel(py, &self.asked)
    }

    /// Number of each sample in its pixel's sequence: uint32, shape (n,).
    #[getter]
    fn sample_index<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<u32>> {
        columns::sample_index(py, &self.asked)
    }

    /// A random number for each sample, the same whenever the same sample is asked for again: uint32, shape (n,). Another seed of the
    /// session makes others.
    ///
    /// A renderer with noise makes its random numbers from it alone; that is how noise is told from change.
    #[getter]
    fn seed<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<u32>> {
        columns::seed(py, &self.asked, self.session_seed)
    }

    /// The moment of the scene to be traced, in seconds of the scene's own time.
    #[getter]
    fn time(&self) -> f64 {
        self.asked.scene_secs
    }

    /// When the pixels were chosen, in seconds of the session's clock.
    #[getter]
    fn now(&self) -> f64 {
        self.asked.now.secs()
    }

    /// (width, height) of the picture.
    #[getter]
    fn size(&self) -> (u32, u32) {
        pair(self.asked.size)
    }

    /// The session's camera when the batch was chosen, with the picture's size; None if the session has none.
    #[getter]
    fn camera(&self) -> Option<Camera> {
        self.camera_of_size()
    }

    /// Give colours to the session; they are in the next picture.
    ///
    /// Parameters:
    ///
    /// - `rgb`: linear RGB radiance, shape (n, 3), float32 or float64, finite
    /// - `position`: where the ray hit first, in world coordinates, shape (n, 3); with it, samples move with surfaces and camera
    /// - `normal`: unit normals there in world coordinates, shape (n, 3)
    /// - `object_id`: which object was hit, integers of shape (n,), from 0, stable over time; -1 where nothing was. Default 0
    /// - `where`: which samples of the batch are answered: their numbers, shape (n,), or a mask of all. Default: all, in order
    ///
    /// Arrays may be numpy's, in any memory order, or have `__dlpack__` (torch and jax on the CPU). They are copied.
    ///
    /// Returns the number of samples kept: less than n if pixels have newer ones, or the picture another size.
    ///
    /// Raises ValueError for wrong shapes, dtypes, or values that are NaN or infinite; nothing is kept then, and the batch may be
    /// answered again.
    #[pyo3(signature = (rgb, *, position=None, normal=None, object_id=None, r#where=None))]
    fn submit<'py>(
        &self,
        rgb: &Bound<'py, PyAny>,
        position: Option<Bound<'py, PyAny>>,
        normal: Option<Bound<'py, PyAny>>,
        object_id: Option<Bound<'py, PyAny>>,
        r#where: Option<Bound<'py, PyAny>>,
    ) -> PyResult<usize> {
        let total = self.asked.requests.len();
        let which = r#where.map(|which| array::indices("where", &which, total)).transpose()?;
        let arrays = Arrays { rgb, position, normal, object_id };
        self.take(rgb.py(), &arrays, which)
    }

    fn __len__(&self) -> usize {
        self.asked.requests.len()
    }

    fn __repr__(&self) -> String {
        let frameless::Batch { id, scene_secs, requests, .. } = &self.asked;
        format!("<frameless.Batch {id}: {} samples at {scene_secs:.3} s>", requests.len())
    }
}
