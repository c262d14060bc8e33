//! A scene that takes long to bring to a time: its newest moment is made in a thread of its own, and batches show the one before meanwhile.
//!
//! Only on the real clock. What is shown is late by as long as a moment takes and the rest after it; it is one consistent state, and never
//! older than the newest that is finished.

use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::Builder;
use std::time::Duration;

use frameless::Clock;

use crate::moment::Moment;
use crate::world::World;

/// After a moment the thread rests as long as it has taken: tracing has at least half of its core.
const REST: f64 = 1.0;

/// The thread ends when this is dropped.
pub(crate) struct Latest(Arc<Shared>);

struct Shared {
    world: Arc<World>,
    state: Mutex<State>,
    wanted: Condvar,
}

struct State {
    newest: Arc<Moment>,
    /// Those that batches may still be looking at; their memory is used again.
    old: Vec<Arc<Moment>>,
    wanted_secs: Option<f64>,
    closed: bool,
}

impl Latest {
    /// Begins with the moment at time 0.
    ///
    /// # Panics
    /// If the system has no thread left.
    pub(crate) fn new(world: Arc<World>) -> Latest {
        let newest = Arc::new(world.moment(0.0));
        let state = State { newest, old: Vec::new(), wanted_secs: None, closed: false };
        let shared = Shared { world, state: Mutex::new(state), wanted: Condvar::new() };
        let shared = Arc::new(shared);
        let for_thread = Arc::clone(&shared);
        let thread = Builder::new().name("scene".to_owned()).spawn(move || for_thread.work());
        thread.expect("a thread for the scene can be started");
        Latest(shared)
    }

    /// The newest moment that there is; one of this time is wanted.
    pub(crate) fn at(&self, secs: f64) -> Arc<Moment> {
        let mut state = self.0.lock();
        state.wanted_secs = Some(secs);
        self.0.wanted.notify_one();
        Arc::clone(&state.newest)
    }
}

impl Drop for Latest {
    fn drop(&mut self) {
        self.0.lock().closed = true;
        self.0.wanted.notify_one();
    }
}

impl Shared {
    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn work(&self) {
        let clock = Clock::real();
        while let Some((secs, memory)) = self.next() {
            let begin = clock.now();
            let mut moment = memory.unwrap_or_else(|| self.world.moment(secs));
            self.world.update_moment(secs, &mut moment);
            let mut state = self.lock();
            let before = std::mem::replace(&mut state.newest, Arc::new(moment));
            state.old.push(before);
            drop(state);
            let rest_secs = REST * clock.now().secs_since(begin);
            std::thread::sleep(Duration::from_secs_f64(rest_secs));
        }
    }

    /// The time that is wanted, and memory for it; `None`: nobody wants any more.
    fn next(&self) -> Option<(f64, Option<Moment>)> {
        let mut state = self.lock();
        loop {
            if state.closed {
                return None;
            }
            if let Some(secs) = state.wanted_secs.take() {
                let free = state.old.iter().position(|old| Arc::strong_count(old) == 1);
                let memory = free.and_then(|free| Arc::into_inner(state.old.swap_remove(free)));
                return Some((secs, memory));
            }
            state = self.wanted.wait(state).unwrap_or_else(PoisonError::into_inner);
        }
    }
}

#[cfg(test)]
mod tests {
    use frameless_scene::builtin;

    use super::*;

    fn world() -> Arc<World> {
        Arc::new(World::new(Arc::new(builtin("sphere").expect("it is built in"))))
    }

    #[test]
    fn whoever_asks_has_a_moment_at_once_and_the_wanted_one_soon() {
        let latest = Latest::new(world());
        let begin = latest.at(1.0);
        assert_eq!(begin.state().secs, 0.0);
        let mut before = 0.0;
        while before < 1.0 {
            let secs = latest.at(1.0).state().secs;
            assert!(secs >= before, "older than the one before");
            before = secs;
            std::thread::yield_now();
        }
        assert_eq!(before, 1.0);
        assert_eq!(begin.state().secs, 0.0, "what a batch looks at stays");
    }

    #[test]
    fn memory_of_moments_that_nobody_looks_at_is_used_again() {
        let latest = Latest::new(world());
        for k in 1..=20 {
            while latest.at(f64::from(k)).state().secs < f64::from(k) {
                std::thread::yield_now();
            }
        }
        assert!(latest.0.lock().old.len() <= 3, "{}", latest.0.lock().old.len());
    }
}
