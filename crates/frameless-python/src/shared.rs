//! An engine that Python's threads share: one at a time, and never while holding the interpreter.

use std::cell::Cell;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use frameless::{BatchLength, Engine, Observation, Time};
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;

use crate::interrupt::interruptible;
use crate::outside::Outside;
use crate::raised::Raised;

/// How many samples are asked for at once.
pub(crate) enum Length {
    Fixed(usize),
    Learned(BatchLength),
}

impl Length {
    pub(crate) fn next_length(&mut self) -> usize {
        match self {
            Length::Fixed(samples) => *samples,
            Length::Learned(length) => length.next_length(),
        }
    }
}

/// The engine with what Python wants to know of it besides.
pub(crate) struct State {
    pub(crate) engine: Engine<Outside>,
    pub(crate) length: Length,
    pub(crate) budget: Option<f64>,
    /// Change d of every pixel when it was traced last; NaN if never.
    pub(crate) changes: Vec<f32>,
    /// Which canvas `changes` are of.
    generation: u32,
    refreshes: Refreshes,
}

/// When pictures were made. Whoever never asks for one has them made all the same, since samplers learn from them what is shown.
#[derive(Default)]
struct Refreshes {
    last: Time,
    cost_secs: f64,
}

/// As a display does.
const REFRESH_SECS: f64 = 1.0 / 60.0;
/// Pictures that nobody has asked for take at most an eighth of the time.
const COSTS_PER_REFRESH: f64 = 8.0;

/// Starting more takes longer than they save.
const MOST_REFRESH_THREADS: usize = 8;

impl State {
    pub(crate) fn new(mut engine: Engine<Outside>, length: Length) -> State {
        // Nothing else is done in a session while it makes a picture.
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        engine.set_refresh_threads(cores.min(MOST_REFRESH_THREADS));
        let changes = vec![f32::NAN; engine.canvas().size().pixels()];
        let generation = engine.canvas().generation();
        let refreshes = Refreshes::default();
        State { engine, length, budget: None, changes, generation, refreshes }
    }

    /// The picture at `now`.
    pub(crate) fn picture(&mut self, now: Time) -> Vec<[f32; 3]> {
        self.refresh(now);
        self.engine.picture().to_vec()
    }

    fn refresh(&mut self, now: Time) {
        let begin = self.engine.now();
        self.engine.refresh(now);
        self.refreshes.last = now;
        self.refreshes.cost_secs = self.engine.now().secs_since(begin);
    }

    /// Makes a picture that nobody sees, if none has been made for long.
    pub(crate) fn refresh_if_due(&mut self) {
        let now = self.engine.now();
        let interval_secs = REFRESH_SECS.max(COSTS_PER_REFRESH * self.refreshes.cost_secs);
        // The clock's times are rounded down.
        if now.secs_since(self.refreshes.last) + 1e-9 >= interval_secs {
            self.refresh(now);
        }
    }

    /// Notes what the newest answer changed.
    pub(crate) fn note_changes(&mut self) {
        self.forget_changes_of_other_sizes();
        for Observation { pixel, change, known, .. } in self.engine.observations() {
            self.changes[*pixel as usize] = if *known { *change } else { f32::NAN };
        }
    }

    pub(crate) fn forget_changes_of_other_sizes(&mut self) {
        let canvas = self.engine.canvas();
        if canvas.generation() != self.generation {
            self.generation = canvas.generation();
            self.changes.clear();
            self.changes.resize(canvas.size().pixels(), f32::NAN);
        }
    }

    /// A whole batch has been answered that was handed out at `begin`.
    pub(crate) fn note_duration(&mut self, samples: usize, begin: Time) {
        let end = self.engine.now();
        if let Length::Learned(length) = &mut self.length {
            length.answered(samples, begin, end);
        }
    }
}

/// Pixels from which on a picture may take longer than one would wait for Ctrl-C.
const LARGE_PICTURE: usize = 1 << 21;

/// How often somebody who waits for long work looks for Ctrl-C.
const POLL: Duration = Duration::from_millis(2);

/// A [`State`] behind a lock.
pub(crate) struct Shared {
    state: Mutex<State>,
    raised: Raised,
    is_closed: AtomicBool,
    /// How many threads do what may take seconds.
    long_work: AtomicUsize,
}

thread_local! {
    /// Whether this thread holds a state: its sampler, called back, must not ask for it again.
    static HOLDS: Cell<bool> = const { Cell::new(false) };
}

struct Holding;

impl Drop for Holding {
    fn drop(&mut self) {
        HOLDS.set(false);
    }
}

impl Shared {
    pub(crate) fn new(state: State, raised: Raised) -> Shared {
        let (is_closed, long_work) = (AtomicBool::new(false), AtomicUsize::new(0));
        Shared { state: Mutex::new(state), raised, is_closed, long_work }
    }

    /// Lets go of the interpreter, waits for the state, and works on it.
    ///
    /// # Errors
    /// If it is called from a sampler that the same thread is running, or if a sampler has raised an exception meanwhile.
    pub(crate) fn with<R: Send>(
        &self,
        py: Python<'_>,
        work: impl FnOnce(&mut State) -> R + Send,
    ) -> PyResult<R> {
        Shared::must_not_hold()?;
        self.wait_for_long_work(py)?;
        let (outcome, raised) = py.detach(|| self.locked(work));
        raised.map(|()| outcome)
    }

    /// As [`Shared::with`], for what takes long on large pictures: Ctrl-C ends the waiting; the work goes on to its end.
    pub(crate) fn with_long<R: Send + 'static>(
        self: &Arc<Self>,
        py: Python<'_>,
        work: impl FnOnce(&mut State) -> R + Send + 'static,
    ) -> PyResult<R> {
        if self.with(py, |state| state.engine.canvas().size().pixels())? < LARGE_PICTURE {
            return self.with(py, work);
        }
        let shared = Arc::clone(self);
        self.long_work.fetch_add(1, Ordering::SeqCst);
        let (outcome, raised) = interruptible(py, move |_| {
            let outcome = shared.locked(work);
            shared.long_work.fetch_sub(1, Ordering::SeqCst);
            outcome
        })?;
        raised.map(|()| outcome)
    }

    /// What somebody has left behind by Ctrl-C may hold the state for seconds.
    fn wait_for_long_work(&self, py: Python<'_>) -> PyResult<()> {
        while self.long_work.load(Ordering::SeqCst) > 0 {
            py.detach(|| std::thread::sleep(POLL));
            py.check_signals()?;
        }
        Ok(())
    }

    /// Whether no more batches are given out.
    pub(crate) fn is_closed(&self) -> bool {
        self.is_closed.load(Ordering::SeqCst)
    }

    /// At once, whoever holds the state.
    pub(crate) fn close(&self) {
        self.is_closed.store(true, Ordering::SeqCst);
    }

    /// # Errors
    /// In a sampler that this thread is running.
    pub(crate) fn must_not_hold() -> PyResult<()> {
        match HOLDS.get() {
            true => Err(PyRuntimeError::new_err(
                "a sampler must not use a session or a canvas other than the one it is given",
            )),
            false => Ok(()),
        }
    }

    /// Returns what the sampler has raised meanwhile, too: nobody else is to be told of it.
    fn locked<R>(&self, work: impl FnOnce(&mut State) -> R) -> (R, PyResult<()>) {
        // A panic leaves a canvas with some samples missing, which is nothing special.
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        HOLDS.set(true);
        let _holding = Holding;
        let outcome = work(&mut state);
        (outcome, self.raised.take())
    }
}
