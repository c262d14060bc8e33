//! Front propagation: where a sample found a change, its neighbours have probably changed too.

use std::collections::VecDeque;

use crate::{Canvas, Observation, Size, Time};

/// A sample that differs by more than this (mean squared difference per channel) is part of a front: 5 % of the range.
const FRONT_CHANGE: f32 = 0.0025;
/// Neighbours traced later than this before the front was found are left alone.
const FRESH_SECS: f32 = 0.012;

/// Pixels beside changes, first come first served.
pub(crate) struct Front {
    queue: VecDeque<(u32, Time)>,
    queued: Vec<bool>,
    capacity: usize,
}

impl Front {
    pub(crate) fn new(size: Size) -> Front {
        let capacity = (size.pixels() / 8).max(4096);
        Front { queue: VecDeque::new(), queued: vec![false; size.pixels()], capacity }
    }

    /// Queue the neighbours of a sample that found a change.
    pub(crate) fn observe(&mut self, observed: &Observation, canvas: &Canvas) {
        if observed.change <= 3.0 * FRONT_CHANGE {
            return;
        }
        let size = canvas.size();
        let (x, y) = size.xy(observed.pixel);
        for ny in y.saturating_sub(1)..(y + 2).min(size.height) {
            for nx in x.saturating_sub(1)..(x + 2).min(size.width) {
                let pixel = size.index(nx, ny);
                if self.queue.len() >= self.capacity {
                    return;
                }
                let age_secs = observed.now.secs_since(canvas.time()[pixel as usize]) as f32;
                if pixel != observed.pixel && age_secs >= FRESH_SECS && !self.queued[pixel as usize]
                {
                    self.queued[pixel as usize] = true;
                    self.queue.push_back((pixel, observed.now));
                }
            }
        }
    }

    /// The next pixel that has not been traced since it was queued.
    pub(crate) fn next(&mut self, canvas: &Canvas) -> Option<u32> {
        while let Some((pixel, found)) = self.queue.pop_front() {
            self.queued[pixel as usize] = false;
            let traced = canvas.time()[pixel as usize];
            if found.secs_since(traced) as f32 > FRESH_SECS || !canvas.known()[pixel as usize] {
                return Some(pixel);
            }
        }
        None
    }

    pub(crate) fn clear(&mut self) {
        for (pixel, _) in self.queue.drain(..) {
            self.queued[pixel as usize] = false;
        }
    }
}
