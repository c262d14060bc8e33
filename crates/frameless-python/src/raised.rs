//! What renderers and samplers written in Python have raised, until somebody can be told.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use pyo3::exceptions::PyKeyboardInterrupt;
use pyo3::prelude::*;

use crate::calls::Calls;

/// Who has raised it.
#[derive(Clone, Copy)]
pub(crate) enum Source {
    Renderer,
    Sampler,
}

/// The first exception that nobody has been told of yet.
#[derive(Clone, Default)]
pub(crate) struct Raised(Arc<Known>);

#[derive(Default)]
struct Known {
    slot: Mutex<Option<(Source, PyErr)>>,
    /// On a page: who waits there.
    page: Option<Calls>,
}

impl Raised {
    /// For a page: if nobody waits for it, what is raised is written to stderr, too.
    pub(crate) fn on_page(calls: Calls) -> Raised {
        Raised(Arc::new(Known { page: Some(calls), ..Known::default() }))
    }

    /// Keeps the first of several.
    pub(crate) fn set(&self, source: Source, error: PyErr) {
        if self.is_set() {
            return;
        }
        if self.0.page.as_ref().is_some_and(|calls| !calls.has_waiting()) {
            Python::attach(|py| write_down(py, &error));
        }
        self.slot().get_or_insert((source, error));
    }

    pub(crate) fn is_set(&self) -> bool {
        self.slot().is_some()
    }

    /// What it is, in a line; `None` if nothing has been raised.
    pub(crate) fn describe(&self, py: Python<'_>) -> Option<String> {
        let (source, error) =
            self.slot().as_ref().map(|(source, error)| (*source, error.clone_ref(py)))?;
        let source = match source {
            Source::Renderer => "renderer",
            Source::Sampler => "sampler",
        };
        Some(format!("the {source} has failed: {error}"))
    }

    /// Raises it, and forgets it.
    pub(crate) fn take(&self) -> PyResult<()> {
        self.slot().take().map_or(Ok(()), |(_, error)| Err(error))
    }

    fn slot(&self) -> MutexGuard<'_, Option<(Source, PyErr)>> {
        self.0.slot.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

fn write_down(py: Python<'_>, error: &PyErr) {
    // That is how calls are ended.
    if error.is_instance_of::<PyKeyboardInterrupt>(py) {
        return;
    }
    error.display(py);
    let advice = "frameless: the picture stands still until page.check(), page.set_render(...) or page.stop()\n";
    // Where there is no stderr nobody reads it.
    py.import("sys").and_then(|sys| sys.getattr("stderr")?.call_method1("write", (advice,))).ok();
}
