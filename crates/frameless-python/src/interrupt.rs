//! Long work beside the interpreter: Ctrl-C ends the waiting at once.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, sync_channel};
use std::time::Duration;

use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;

/// Ctrl-C is looked for this often.
pub(crate) const LOOK_EVERY: Duration = Duration::from_millis(50);

/// Asks long work to end.
#[derive(Clone, Default)]
pub(crate) struct Stop(Arc<AtomicBool>);

impl Stop {
    pub(crate) fn is_set(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }

    pub(crate) fn set(&self) {
        self.0.store(true, Ordering::Relaxed);
    }
}

/// Does `work` in a thread of its own, without the interpreter, and waits for it. A signal's exception (Ctrl-C) is raised
/// within [`LOOK_EVERY`]; the work, told to stop, ends later by itself.
pub(crate) fn interruptible<R: Send + 'static>(
    py: Python<'_>,
    work: impl FnOnce(&Stop) -> R + Send + 'static,
) -> PyResult<R> {
    let stop = Stop::default();
    let (send, mut outcome) = sync_channel(1);
    let for_work = stop.clone();
    std::thread::Builder::new().name("frameless work".to_owned()).spawn(move || {
        // Nobody listens after a signal.
        let _ = send.send(work(&for_work));
    })?;
    loop {
        let come;
        (outcome, come) = py.detach(move || {
            let come = outcome.recv_timeout(LOOK_EVERY);
            (outcome, come)
        });
        match come {
            Ok(outcome) => return Ok(outcome),
            Err(RecvTimeoutError::Timeout) => {
                py.check_signals().inspect_err(|_| stop.set())?;
            }
            Err(RecvTimeoutError::Disconnected) => {
                return Err(PyRuntimeError::new_err(
                    "a thread of frameless panicked; its message is above",
                ));
            }
        }
    }
}
