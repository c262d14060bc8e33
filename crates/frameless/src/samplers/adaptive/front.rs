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

    /// Queue a pixel that had better be looked at again.
    pub(crate) fn suspect(&mut self, observed: &Observation) {
        let queued = &mut self.queued[observed.pixel as usize];
        if self.queue.len() < self.capacity && !std::mem::replace(queued, true) {
            self.queue.push_back((observed.pixel, Time(u64::MAX)));
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

#[cfg(test)]
mod tests {
    use super::*;

    fn found(pixel: u32, now: Time, change: f32) -> Observation {
        Observation { pixel, now, previous: Time::ZERO, known: true, change, refinement: None }
    }

    #[test]
    fn the_neighbours_of_a_change_are_next_unless_they_are_fresh() {
        let size = Size::new(4, 3);
        let mut canvas = Canvas::from_picture(size, vec![[0.0; 3]; 12]);
        let mut front = Front::new(size);
        let now = Time::from_secs(1.0);
        canvas.replace(1, Time::from_secs(0.995), [0.0; 3]);
        front.observe(&found(0, now, 0.1), &canvas);
        let queued: Vec<u32> = std::iter::from_fn(|| front.next(&canvas)).collect();
        assert_eq!(queued, [4, 5], "1 is 5 ms old, and the corner has no other");
        front.observe(&found(0, now, 0.001), &canvas);
        assert_eq!(front.next(&canvas), None, "too small a change");
    }

    #[test]
    fn who_was_traced_since_is_left_out() {
        let size = Size::new(3, 1);
        let mut canvas = Canvas::from_picture(size, vec![[0.0; 3]; 3]);
        let mut front = Front::new(size);
        front.observe(&found(1, Time::from_secs(1.0), 0.1), &canvas);
        canvas.replace(0, Time::from_secs(1.0), [0.0; 3]);
        assert_eq!((front.next(&canvas), front.next(&canvas)), (Some(2), None));
    }
}
