//! The calls of a renderer in another thread: who waits for them, and how they are ended early.
//!
//! The one place of this crate with `unsafe` code: raising an exception in another thread is a function of the interpreter's that no
//! library wraps.
#![allow(unsafe_code)]

use std::ffi::c_long;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::sync::{Arc, OnceLock};
use std::thread::ThreadId;

use pyo3::exceptions::PyKeyboardInterrupt;
use pyo3::prelude::*;

/// What the renderer's thread and those who wait for it know of each other.
#[derive(Clone, Default)]
pub(crate) struct Calls(Arc<Known>);

#[derive(Default)]
struct Known {
    /// The interpreter's number of the thread that is in a call; 0: none is.
    thread: AtomicU64,
    /// The thread that calls, once it has.
    caller: OnceLock<ThreadId>,
    /// How many wait for what the renderer raises.
    waiting: AtomicUsize,
}

/// While this lives a call is under way.
pub(crate) struct Calling<'a>(&'a Known);

impl Drop for Calling<'_> {
    fn drop(&mut self) {
        self.0.thread.store(0, Ordering::SeqCst);
    }
}

/// While this lives somebody waits.
pub(crate) struct Waiting<'a>(&'a Known);

impl Drop for Waiting<'_> {
    fn drop(&mut self) {
        self.0.waiting.fetch_sub(1, Ordering::SeqCst);
    }
}

impl Calls {
    /// This thread is about to call the renderer.
    pub(crate) fn begin(&self, py: Python<'_>) -> PyResult<Calling<'_>> {
        // Not of `threading`, which takes the thread that imports it first for the main one.
        let thread = py.import("_thread")?.call_method0("get_ident")?.extract()?;
        self.0.thread.store(thread, Ordering::SeqCst);
        self.0.caller.get_or_init(|| std::thread::current().id());
        Ok(Calling(&self.0))
    }

    /// Whether this thread is the one that calls.
    pub(crate) fn is_caller(&self) -> bool {
        self.0.caller.get() == Some(&std::thread::current().id())
    }

    /// Somebody will be told what the renderer raises.
    pub(crate) fn wait(&self) -> Waiting<'_> {
        self.0.waiting.fetch_add(1, Ordering::SeqCst);
        Waiting(&self.0)
    }

    pub(crate) fn has_waiting(&self) -> bool {
        self.0.waiting.load(Ordering::SeqCst) > 0
    }

    /// Raises KeyboardInterrupt in the call that is under way, if any: where it next executes Python's code. What another library is doing
    /// in it comes to its end first.
    pub(crate) fn interrupt(&self, py: Python<'_>) {
        let thread = self.0.thread.swap(0, Ordering::SeqCst);
        if thread != 0 {
            let exception = py.get_type::<PyKeyboardInterrupt>();
            // SAFETY: the interpreter is held, as `py` shows, and the exception is a class that lives as long as it. A number of a thread
            // that is no more is allowed: nothing happens then.
            unsafe { pyo3::ffi::PyThreadState_SetAsyncExc(thread as c_long, exception.as_ptr()) };
        }
    }
}
