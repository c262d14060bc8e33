//! Jobs on all cores, one at a time each.

use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

/// Does `work` on every job, begun in the given order by whichever thread is free: with the longest first, no thread works alone
/// for long at the end. After a failure no further job is begun, and the failure of the first job that has one is returned.
pub(super) fn in_parallel<Job: Sync, Done: Send + Sync, Error: Send + Sync>(
    jobs: &[Job],
    work: impl Fn(&Job) -> Result<Done, Error> + Sync,
) -> Result<Vec<Done>, Error> {
    let outcomes: Vec<OnceLock<Result<Done, Error>>> =
        jobs.iter().map(|_| OnceLock::new()).collect();
    let (next, has_failed) = (AtomicUsize::new(0), AtomicBool::new(false));
    rayon::broadcast(|_| {
        while !has_failed.load(Ordering::Relaxed) {
            let i = next.fetch_add(1, Ordering::Relaxed);
            let Some(job) = jobs.get(i) else { return };
            let outcome = work(job);
            has_failed.fetch_or(outcome.is_err(), Ordering::Relaxed);
            let is_first = outcomes[i].set(outcome).is_ok();
            assert!(is_first, "every job is taken once");
        }
    });
    // Jobs are begun in order: before the first that was not begun, all have ended, and one of them has failed.
    outcomes.into_iter().map_while(OnceLock::into_inner).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn outcomes_come_in_the_order_of_the_jobs() {
        let jobs: Vec<u64> = (0..100).rev().collect();
        let squares = in_parallel(&jobs, |&n| Ok::<u64, ()>(n * n)).expect("no failure");
        assert_eq!(squares, jobs.iter().map(|n| n * n).collect::<Vec<_>>());
    }

    #[test]
    fn after_a_failure_nothing_is_begun() {
        let jobs: Vec<u32> = (0..1000).collect();
        let done = AtomicUsize::new(0);
        let outcome = in_parallel(&jobs, |&n| {
            done.fetch_add(1, Ordering::Relaxed);
            if n == 3 { Err(n) } else { Ok(n) }
        });
        assert_eq!(outcome, Err(3));
        assert!(done.into_inner() < 1000);
    }
}
