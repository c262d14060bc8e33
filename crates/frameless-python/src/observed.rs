//! What became of samples, as samplers are told.

use frameless::{Observation, Size};
use numpy::PyArray1;
use pyo3::prelude::*;

use crate::array;

/// What became of the samples of one answer, one entry each; immutable.
#[pyclass(frozen, module = "frameless")]
pub(crate) struct Observed {
    pub(crate) samples: Vec<Observation>,
    /// Of the canvas that they are on.
    pub(crate) size: Size,
}

impl Observed {
    fn column<'py, T: numpy::Element>(
        &self,
        py: Python<'py>,
        value: impl Fn(&Observation) -> T,
    ) -> Bound<'py, PyArray1<T>> {
        array::column(py, self.samples.iter().map(value).collect())
    }
}

#[pymethods]
impl Observed {
    /// Which pixels, row-major numbers: uint32, shape (n,).
    #[getter]
    fn pixel<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<u32>> {
        self.column(py, |sample| sample.pixel)
    }

    /// When they were traced, in seconds: float64, shape (n,).
    #[getter]
    fn now<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.column(py, |sample| sample.now.secs())
    }

    /// When what they took the place of had been traced, in seconds, 0 if never: float64, shape (n,).
    #[getter]
    fn previous<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.column(py, |sample| sample.previous.secs())
    }

    /// Whether anything was known of the pixel; if not, `change` says nothing: bool, shape (n,).
    #[getter]
    fn known<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<bool>> {
        self.column(py, |sample| sample.known)
    }

    /// Squared difference between the sample and what the picture showed there, summed over sRGB channels, in [0, 3]: float32, shape (n,).
    #[getter]
    fn change<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f32>> {
        self.column(py, |sample| sample.change)
    }

    fn __len__(&self) -> usize {
        self.samples.len()
    }
}
