//! The canvas with a reconstruction, as a part for loops that somebody builds from parts.

use std::sync::Arc;

use frameless::{Answer, Clock, Engine, Request, Time};
use numpy::{PyArray1, PyArray2, PyArray3};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::arguments::reconstruction_kind;
use crate::array;
use crate::camera::Camera;
use crate::hits::Arrays;
use crate::observed::Observed;
use crate::outside::Outside;
use crate::planes;
use crate::raised::Raised;
use crate::sampler::Nobody;
use crate::shared::{Length, Shared, State};
use crate::size::{PictureSize, pair};

/// The newest sample of every pixel, and a reconstruction that makes pictures of them: a session without clock and sampler.
///
/// Parameters:
///
/// - `size`: (width, height) in pixels
/// - `reconstruction`: "hold", "filter" or "reproject", the last with +deep or +antialias
/// - `camera`: from where samples with positions are seen; needed only for those
///
/// Raises ValueError if there is no such reconstruction.
#[pyclass(frozen, name = "Canvas", module = "frameless")]
pub(crate) struct PyCanvas {
    pub(crate) shared: Arc<Shared>,
}

pub(crate) fn checked(now: f64) -> PyResult<Time> {
    match now.is_finite() && now >= 0.0 {
        true => Ok(Time::from_secs(now)),
        false => Err(PyValueError::new_err(format!("now: wanted seconds, at least 0, got {now}"))),
    }
}

#[pymethods]
impl PyCanvas {
    #[new]
    #[pyo3(signature = (size, *, reconstruction="hold", camera=None))]
    fn new(size: PictureSize, reconstruction: &str, camera: Option<Camera>) -> PyResult<PyCanvas> {
        let reconstruction = reconstruction_kind(reconstruction)?;
        let outside = Outside::new(camera, false);
        // The clock is never asked: whoever holds the canvas says what time it is.
        let mut engine = Engine::new(size.0, Clock::simulated(1.0), Box::new(Nobody), outside);
        engine.set_reconstruction(reconstruction.build());
        let state = State::new(engine, Length::Fixed(0));
        Ok(PyCanvas { shared: Arc::new(Shared::new(state, Raised::default())) })
    }

    /// (width, height) in pixels.
    #[getter]
    fn size(&self, py: Python<'_>) -> PyResult<(u32, u32)> {
        self.shared.with(py, |state| pair(state.engine.canvas().size()))
    }

    /// From where samples with positions are seen.
    #[getter]
    fn camera(&self, py: Python<'_>) -> PyResult<Option<Camera>> {
        self.shared.with(py, |state| state.engine.tracer().camera)
    }

    #[setter]
    fn set_camera(&self, py: Python<'_>, camera: Option<Camera>) -> PyResult<()> {
        self.shared.with(py, |state| state.engine.tracer_mut().camera = camera)
    }

    /// When each pixel was traced last, in seconds, rounded down to 16 µs, 0 if never: float64, shape (height · width,), a copy.
    #[getter]
    fn time<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let time =
            self.shared.with(py, |state| state.engine.canvas().time().map(Time::secs).collect())?;
        Ok(array::column(py, time))
    }

    /// Newest sample of each pixel, linear RGB: float32, shape (height · width, 3), a copy.
    #[getter]
    fn rgb<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f32>>> {
        let rgb = self.shared.with(py, |state| state.engine.canvas().rgb().to_vec())?;
        array::rows(py, rgb)
    }

    /// Whether anything is known of each pixel: bool, shape (height · width,), a copy.
    #[getter]
    fn known<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<bool>>> {
        let known = self.shared.with(py, |state| state.engine.canvas().known().collect())?;
        Ok(array::column(py, known))
    }

    /// Pixels that wait to be traced, the most urgent first: uint32, shape (n,), a copy.
    #[getter]
    fn holes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<u32>>> {
        let holes = self.shared.with(py, |state| state.engine.canvas().holes().to_vec())?;
        Ok(array::column(py, holes))
    }

    /// Keep samples of pixel centres, traced at `now` (seconds), and say what they changed.
    ///
    /// Parameters:
    ///
    /// - `now`: seconds, not before any sample kept so far
    /// - `pixel`: row-major numbers, integers of shape (n,)
    /// - `rgb`, `position`, `normal`, `object_id`: as in Batch.submit
    ///
    /// Raises ValueError as Batch.submit does.
    #[pyo3(signature = (now, pixel, rgb, *, position=None, normal=None, object_id=None))]
    #[expect(clippy::too_many_arguments, reason = "Python's are named")]
    fn keep<'py>(
        &self,
        py: Python<'py>,
        now: f64,
        pixel: &Bound<'py, PyAny>,
        rgb: &Bound<'py, PyAny>,
        position: Option<Bound<'py, PyAny>>,
        normal: Option<Bound<'py, PyAny>>,
        object_id: Option<Bound<'py, PyAny>>,
    ) -> PyResult<Observed> {
        let now = checked(now)?;
        let (size, camera, transforms) = self.shared.with(py, |state| {
            let outside = state.engine.tracer();
            (state.engine.canvas().size(), outside.camera, Arc::clone(&outside.transforms))
        })?;
        let pixels = array::pixels("pixel", pixel, size)?;
        let arrays = Arrays { rgb, position, normal, object_id };
        let at = |i: usize| format!("sample {i} (pixel {})", pixels[i]);
        let (rgb, hits) = arrays.checked(pixels.len(), &at)?;
        let requests: Vec<Request> = pixels.iter().map(|&pixel| Request::centre(pixel)).collect();
        let surfaces = match (hits, camera) {
            (None, _) => Vec::new(),
            (Some(hits), Some(camera)) => hits.surfaces(&requests, size, &camera, &transforms),
            (Some(_), None) => {
                return Err(PyValueError::new_err(
                    "position: wanted a canvas with a camera; set canvas.camera",
                ));
            }
        };
        let samples = self.shared.with(py, |state| {
            state.engine.tracer_mut().note(&surfaces);
            let scene_secs = now.secs();
            let answer = Answer { batch: 0, now, scene_secs, size, requests, rgb, surfaces };
            let kept = state.engine.answer(answer);
            kept.map_err(|error| PyValueError::new_err(error.to_string()))?;
            state.note_changes();
            PyResult::Ok(state.engine.observations().to_vec())
        })??;
        Ok(Observed { samples, size })
    }

    /// The picture at `now` (seconds): display-referred sRGB in [0, 1], float32, shape (height, width, 3).
    ///
    /// `out`: an array of that shape to write into; it is returned.
    #[pyo3(signature = (now, out=None))]
    fn image<'py>(
        &self,
        py: Python<'py>,
        now: f64,
        out: Option<Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyArray3<f32>>> {
        planes::image(py, &self.shared, Some(checked(now)?), out)
    }

    /// Seconds from when each pixel was traced to `now`, infinite if never: float32, shape (height, width).
    fn age<'py>(&self, py: Python<'py>, now: f64) -> PyResult<Bound<'py, PyArray2<f32>>> {
        planes::age(py, &self.shared, Some(checked(now)?))
    }

    /// What each pixel's last sample changed, as Observed.change; NaN if nothing was known before: float32, shape (height, width).
    fn change<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f32>>> {
        planes::change(py, &self.shared)
    }
}
