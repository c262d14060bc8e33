//! Loops over a session.

use frameless::Time;
use pyo3::prelude::*;
use pyo3::{PyTraverseError, PyVisit};

use crate::batch::Batch;
use crate::session::Session;

/// The batches of a session, one after the other.
#[pyclass(frozen, module = "frameless")]
pub(crate) struct Batches {
    session: Py<Session>,
    end: Option<Time>,
}

impl Batches {
    /// Until the session's clock shows `end`, or the session is closed.
    pub(crate) fn new(session: Py<Session>, end: Option<Time>) -> Batches {
        Batches { session, end }
    }
}

#[pymethods]
impl Batches {
    fn __iter__(slf: Bound<'_, Batches>) -> Bound<'_, Batches> {
        slf
    }

    fn __traverse__(&self, visit: PyVisit<'_>) -> Result<(), PyTraverseError> {
        visit.call(&self.session)
    }

    fn __next__(&self, py: Python<'_>) -> PyResult<Option<Batch>> {
        self.session.get().next_batch(py, self.end)
    }
}
