//! How far a comparison is, and whether it is to go on.

use std::sync::atomic::{AtomicU64, Ordering};

/// Told how far a comparison is. Work is counted in traced samples or what takes as long.
pub trait Progress: Sync {
    /// So much work there is altogether. Called before the work, and again when a better estimate is known: how many rates
    /// must be scanned for equal quality is not known before.
    fn plan(&self, work: u64);
    /// What is being worked on.
    fn stage(&self, what: &str);
    /// So much more work has been done.
    fn advance(&self, work: u64);
    /// Asked often; after `true` the comparison ends with [`Unfinished`](crate::EvalError::Unfinished).
    fn should_stop(&self) -> bool;
}

/// The plan behind the numbers that a [`Progress`] is told.
pub(super) struct Work<'a> {
    progress: &'a dyn Progress,
    planned: AtomicU64,
}

impl<'a> Work<'a> {
    pub(super) fn new(progress: &'a dyn Progress) -> Work<'a> {
        Work { progress, planned: AtomicU64::new(0) }
    }

    /// There is so much more to do than was known.
    pub(super) fn add(&self, work: u64) {
        self.progress.plan(self.planned.fetch_add(work, Ordering::Relaxed) + work);
    }

    /// There is so much less to do than was thought.
    pub(super) fn forget(&self, work: u64) {
        self.progress.plan(self.planned.fetch_sub(work, Ordering::Relaxed) - work);
    }

    pub(super) fn stage(&self, what: &str) {
        self.progress.stage(what);
    }

    pub(super) fn advance(&self, work: u64) {
        self.progress.advance(work);
    }

    pub(super) fn should_stop(&self) -> bool {
        self.progress.should_stop()
    }
}
