//! Objects of Python's that Rust holds, and the interpreter's garbage collector may ask for.

use std::sync::{Arc, Mutex, PoisonError, TryLockError};

use pyo3::prelude::*;
use pyo3::{PyTraverseError, PyVisit};

/// One reference to an object, with any number of owners in Rust.
///
/// An object of Python's that owns one of these tells the collector of it ([`Own::visit`]) and lets go ([`Own::clear`]) if it is found in a
/// ring that nobody else holds; the other owners then find nothing.
#[derive(Clone)]
pub(crate) struct Own(Arc<Mutex<Option<Py<PyAny>>>>);

impl Own {
    pub(crate) fn new(object: Py<PyAny>) -> Own {
        Own(Arc::new(Mutex::new(Some(object))))
    }

    /// `None` after [`Own::clear`].
    pub(crate) fn get<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyAny>> {
        self.lock().as_ref().map(|object| object.bind(py).clone())
    }

    pub(crate) fn set(&self, py: Python<'_>, object: Py<PyAny>) {
        // What the old one does when it goes may ask for the lock.
        let old = self.lock().replace(object);
        if let Some(old) = old {
            old.drop_ref(py);
        }
    }

    pub(crate) fn clear(&self) {
        let old = self.lock().take();
        drop(old);
    }

    pub(crate) fn visit(&self, visit: &PyVisit<'_>) -> Result<(), PyTraverseError> {
        match self.0.try_lock() {
            Ok(object) => visit.call(&*object),
            Err(TryLockError::Poisoned(object)) => visit.call(&*object.into_inner()),
            // Somebody uses it, and so it is no garbage.
            Err(TryLockError::WouldBlock) => Ok(()),
        }
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, Option<Py<PyAny>>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
