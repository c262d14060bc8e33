//! Work on the rows of a picture, side by side.

use std::sync::Mutex;

/// A thread whose bands were easy takes over some of another's.
pub(crate) const PER_THREAD: usize = 4;

/// Rows of a band, so that there are [`PER_THREAD`] of them for each thread; whole tiles of eight rows.
pub(crate) fn rows(height: u32, threads: usize) -> u32 {
    match threads {
        0 | 1 => height,
        _ => height.div_ceil((PER_THREAD * threads) as u32).next_multiple_of(8),
    }
}

/// Does `work` on all `bands`, on so many threads; on this one alone with 1. What comes out depends on no order: no band sees another.
pub(crate) fn run<B: Send>(threads: usize, bands: Vec<B>, work: impl Fn(B) + Sync) {
    if threads <= 1 || bands.len() <= 1 {
        return bands.into_iter().for_each(work);
    }
    let waiting = Mutex::new(bands.into_iter());
    let next = || waiting.lock().ok().and_then(|mut bands| bands.next());
    let some = || std::iter::from_fn(next).for_each(&work);
    std::thread::scope(|scope| {
        (1..threads).for_each(|_| drop(scope.spawn(some)));
        some();
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_band_is_worked_on_once_by_any_number_of_threads() {
        for threads in [1, 2, 5] {
            let height = 100;
            let mut seen = vec![0; height as usize];
            let bands: Vec<_> = seen.chunks_mut(rows(height, threads) as usize).collect();
            run(threads, bands, |band| band.iter_mut().for_each(|row| *row += 1));
            assert!(seen.iter().all(|&n| n == 1), "{threads} threads");
        }
    }
}
