//! The canvas as a sampler written in Python sees it.

use frameless::{Canvas, Observation, Time};
use numpy::prelude::*;
use numpy::{PyArray1, PyArray2};
use pyo3::prelude::*;

use crate::array;

/// What is known of every pixel, for a sampler written in Python. Its arrays are read-only, and change from call to call.
#[pyclass(frozen, module = "frameless")]
pub(crate) struct CanvasView {
    size: (u32, u32),
    time: Py<PyAny>,
    rgb: Py<PyAny>,
    known: Py<PyAny>,
    holes: Py<PyAny>,
}

#[pymethods]
impl CanvasView {
    /// (width, height) in pixels.
    #[getter]
    fn size(&self) -> (u32, u32) {
        self.size
    }

    /// When each pixel was traced last, in seconds, 0 if never: float64, shape (height · width,).
    #[getter]
    fn time<'py>(&self, py: Python<'py>) -> Bound<'py, PyAny> {
        self.time.bind(py).clone()
    }

    /// Newest sample of each pixel, linear RGB: float32, shape (height · width, 3).
    #[getter]
    fn rgb<'py>(&self, py: Python<'py>) -> Bound<'py, PyAny> {
        self.rgb.bind(py).clone()
    }

    /// Whether anything is known of each pixel: bool, shape (height · width,).
    #[getter]
    fn known<'py>(&self, py: Python<'py>) -> Bound<'py, PyAny> {
        self.known.bind(py).clone()
    }

    /// Pixels that wait to be traced, the most urgent first: uint32, shape (n,).
    #[getter]
    fn holes<'py>(&self, py: Python<'py>) -> Bound<'py, PyAny> {
        self.holes.bind(py).clone()
    }
}

/// A canvas kept in numpy's memory as well: after a batch only the pixels traced are written.
pub(crate) struct Mirror {
    /// Which canvas, and how often a reconstruction had said anew what its pixels show.
    of: (u32, u64),
    time: Py<PyArray1<f64>>,
    rgb: Py<PyArray2<f32>>,
    known: Py<PyArray1<bool>>,
    view: Py<CanvasView>,
}

impl Mirror {
    /// The view of `mirror`, which is made anew if all of the canvas may have changed.
    pub(crate) fn of(
        mirror: &mut Option<Mirror>,
        py: Python<'_>,
        canvas: &Canvas,
    ) -> PyResult<Py<CanvasView>> {
        let of = (canvas.generation(), canvas.updates());
        match mirror {
            Some(mirror) if mirror.of == of => Ok(mirror.view.clone_ref(py)),
            _ => Ok(mirror.insert(Mirror::new(py, canvas, of)?).view.clone_ref(py)),
        }
    }

    fn new(py: Python<'_>, canvas: &Canvas, of: (u32, u64)) -> PyResult<Mirror> {
        let time = array::column(py, canvas.time().map(Time::secs).collect());
        let rgb = array::rows(py, canvas.rgb().to_vec())?;
        let known = array::column(py, canvas.known().collect());
        let holes = array::column(py, canvas.holes().to_vec());
        let size = (canvas.size().width, canvas.size().height);
        let view = CanvasView {
            size,
            time: read_only(&time)?,
            rgb: read_only(&rgb)?,
            known: read_only(&known)?,
            holes: read_only(&holes)?,
        };
        let view = Py::new(py, view)?;
        Ok(Mirror { of, time: time.unbind(), rgb: rgb.unbind(), known: known.unbind(), view })
    }

    /// Writes what has just been traced.
    pub(crate) fn write(
        &self,
        py: Python<'_>,
        canvas: &Canvas,
        samples: &[Observation],
    ) -> PyResult<()> {
        let mut time = self.time.bind(py).try_readwrite()?;
        let mut rgb = self.rgb.bind(py).try_readwrite()?;
        let mut known = self.known.bind(py).try_readwrite()?;
        let (mut time, mut rgb, mut known) =
            (time.as_array_mut(), rgb.as_array_mut(), known.as_array_mut());
        for Observation { pixel: number, .. } in samples {
            let pixel = *number as usize;
            time[pixel] = canvas.time_of(*number).secs();
            known[pixel] = canvas.is_known(*number);
            (0..3).for_each(|k| rgb[[pixel, k]] = canvas.rgb()[pixel][k]);
        }
        Ok(())
    }
}

/// The same memory, not to be written by who gets it.
fn read_only(array: &Bound<'_, PyAny>) -> PyResult<Py<PyAny>> {
    let view = array.call_method0("view")?;
    view.call_method1("setflags", (false,))?;
    Ok(view.unbind())
}
