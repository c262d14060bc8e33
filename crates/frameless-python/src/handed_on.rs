//! Calls that a sampler written in Python hands on to a built-in one, while the engine waits for it in the same thread.
//!
//! Python's sampler names pixels only. What a built-in one has asked of them besides, the next sample of a pixel at rest, is remembered
//! here until the engine gets the names.

use std::cell::RefCell;
use std::collections::HashMap;

use frameless::{Canvas, Request};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use scoped_tls::scoped_thread_local;

scoped_thread_local!(static SHOWN: Canvas);

thread_local! {
    static ASKED: RefCell<Asked> = RefCell::default();
}

/// What built-in samplers have asked for during one call.
#[derive(Default)]
pub(crate) struct Asked {
    further: HashMap<u32, Request>,
    /// Whether one of them asks for further samples of pixels at rest by itself.
    pub(crate) refines: bool,
}

impl Asked {
    /// What is to be traced in a pixel.
    pub(crate) fn request(&mut self, pixel: u32) -> Request {
        self.further.remove(&pixel).unwrap_or(Request::centre(pixel))
    }
}

/// While `call` runs in this thread, built-in samplers see this canvas. Returns what they have asked for, too.
pub(crate) fn showing<R>(canvas: &Canvas, call: impl FnOnce() -> R) -> (R, Asked) {
    let outcome = SHOWN.set(canvas, call);
    (outcome, ASKED.take())
}

/// A built-in sampler has chosen.
pub(crate) fn note(requests: &[Request], refines: bool) {
    ASKED.with_borrow_mut(|asked| {
        asked.refines |= refines;
        let further = requests.iter().filter(|request| request.sample_index > 0);
        asked.further.extend(further.map(|request| (request.pixel, *request)));
    });
}

/// The canvas that a sampler written in Python is looking at.
///
/// # Errors
/// If none is, in this thread.
pub(crate) fn with_shown<R>(work: impl FnOnce(&Canvas) -> R) -> PyResult<R> {
    if !SHOWN.is_set() {
        return Err(PyValueError::new_err(
            "canvas: a sampler's canvas is there only while the sampler chooses or observes, and in that thread; for other times \
             there is Canvas",
        ));
    }
    Ok(SHOWN.with(work))
}
