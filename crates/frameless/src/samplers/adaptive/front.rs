//! Front propagation: where a sample found a change, its neighbours have probably changed too.

use std::collections::VecDeque;

use crate::{Canvas, Observation, Size, Time, wide};

/// A sample that differs by more than this (mean squared difference per channel) is part of a front: 5 % of the range.
const FRONT_CHANGE: f32 = 0.0025;
/// Neighbours traced later than a time before the front was found are left alone; its bounds.
const FRESH_NANOS: [f32; 2] = [1e6, 12e6];
/// How fast that adapts: this part of itself per second.
const ADAPT_PER_SEC: f64 = 29.0;
/// The most by which it is multiplied or divided at once, however long a batch takes.
const MOST_AT_ONCE: f64 = 2.0;

/// How many pixels ahead of the one looked at the next is fetched.
const AHEAD: usize = 8;

/// Pixels beside changes, first come first served.
pub(crate) struct Front {
    queue: VecDeque<(u32, Time)>,
    queued: Bits,
    capacity: usize,
    /// Neighbours younger than this are left alone.
    fresh_nanos: f32,
    /// When that was adapted last.
    adapted: Time,
    // Of the observations at hand.
    changed: Vec<Observation>,
    stale: Vec<u32>,
}

/// One bit per pixel: of a large picture bytes would be more than the nearer caches hold.
struct Bits(Vec<u8>);

impl Bits {
    #[inline]
    fn of(&self, pixel: u32) -> bool {
        self.0[pixel as usize / 8] >> (pixel % 8) & 1 != 0
    }

    #[inline]
    fn set(&mut self, pixel: u32, value: bool) {
        let (eight, bit) = (&mut self.0[pixel as usize / 8], pixel % 8);
        *eight = *eight & !(1 << bit) | u8::from(value) << bit;
    }
}

/// Whether what was known there is wrong now.
#[inline]
pub(super) fn is_part(observed: &Observation) -> bool {
    observed.known && observed.change > 3.0 * FRONT_CHANGE
}

/// Bit 3 (j + 1) + i + 1: the neighbour i columns to the right and j rows below has not been traced for a while.
#[inline]
fn stale_around(observed: &Observation, canvas: &Canvas, fresh: u64) -> u32 {
    let size = canvas.size();
    let (x, y) = size.xy(observed.pixel);
    let is_inside = x > 0 && y > 0 && x + 1 < size.width && y + 1 < size.height;
    let mut stale = 0;
    for j in 0..3 {
        if is_inside {
            let begin = size.index(x - 1, y + j - 1) as usize;
            for (i, &time) in (0..).zip(&canvas.time()[begin..begin + 3]) {
                stale |= u32::from(age_nanos(observed.now, time) >= fresh) << (3 * j + i);
            }
            continue;
        }
        for i in (0..3).filter(|i| (1..=size.width).contains(&(x + i))) {
            if (1..=size.height).contains(&(y + j)) {
                let time = canvas.time()[size.index(x + i - 1, y + j - 1) as usize];
                stale |= u32::from(age_nanos(observed.now, time) >= fresh) << (3 * j + i);
            }
        }
    }
    stale & !(1 << 4)
}

#[inline]
fn age_nanos(now: Time, time: Time) -> u64 {
    now.0.saturating_sub(time.0)
}

impl Front {
    pub(crate) fn new(size: Size) -> Front {
        let capacity = (size.pixels() / 8).max(4096);
        let queued = Bits(vec![0; size.pixels().div_ceil(8)]);
        let (changed, stale) = (Vec::new(), Vec::new());
        Front {
            queue: VecDeque::new(),
            queued,
            capacity,
            changed,
            stale,
            fresh_nanos: FRESH_NANOS[1],
            adapted: Time::ZERO,
        }
    }

    /// After a batch: where all fronts have been followed and samples are left, younger neighbours are looked at again as well; where
    /// fronts have to wait, only older ones.
    pub(crate) fn adapt(&mut self, now: Time, all_followed: bool) {
        let secs = now.secs_since(std::mem::replace(&mut self.adapted, now));
        let growth = (1.0 + ADAPT_PER_SEC * secs).min(MOST_AT_ONCE) as f32;
        let factor = if all_followed { 1.0 / growth } else { growth };
        self.fresh_nanos = (self.fresh_nanos * factor).clamp(FRESH_NANOS[0], FRESH_NANOS[1]);
    }

    /// Queue the neighbours of samples that are part of a front, but of late looks.
    pub(crate) fn observe(
        &mut self,
        observations: &[Observation],
        canvas: &Canvas,
        is_late: impl Fn(u32) -> bool,
    ) {
        let mut changed = std::mem::take(&mut self.changed);
        changed.clear();
        changed.extend(
            observations.iter().filter(|observed| is_part(observed) && !is_late(observed.pixel)),
        );
        for observed in &changed {
            let (pixel, width) = (observed.pixel as usize, canvas.size().width as usize);
            for pixel in [pixel.saturating_sub(width), pixel, pixel + width] {
                wide::prefetch(&self.queued.0, pixel / 8);
                wide::prefetch(canvas.time(), pixel);
            }
        }
        // Looking lies apart from queueing, without a branch that depends on what is seen, so that many pixels are fetched at once.
        let mut stale = std::mem::take(&mut self.stale);
        stale.clear();
        let fresh = self.fresh_nanos as u64;
        stale.extend(changed.iter().map(|observed| stale_around(observed, canvas, fresh)));
        for (observed, &stale) in changed.iter().zip(&stale) {
            self.queue_around(observed, stale, canvas.size());
        }
        (self.changed, self.stale) = (changed, stale);
    }

    fn queue_around(&mut self, observed: &Observation, mut stale: u32, size: Size) {
        while stale != 0 && self.queue.len() < self.capacity {
            let i = stale.trailing_zeros();
            stale &= stale - 1;
            // Bit 0 is one row up and one column to the left: a step back, which wraps.
            let step = (i / 3 * size.width + i % 3).wrapping_sub(size.width + 1);
            let pixel = observed.pixel.wrapping_add(step);
            if !self.queued.of(pixel) {
                self.queued.set(pixel, true);
                self.queue.push_back((pixel, observed.now));
            }
        }
    }

    /// Queue a pixel that had better be looked at again.
    pub(crate) fn suspect(&mut self, observed: &Observation) {
        if self.queue.len() < self.capacity && !self.queued.of(observed.pixel) {
            self.queued.set(observed.pixel, true);
            self.queue.push_back((observed.pixel, Time(u64::MAX)));
        }
    }

    /// Of how many nanoseconds neighbours are left alone now.
    #[cfg(test)]
    pub(crate) fn fresh_nanos(&self) -> f32 {
        self.fresh_nanos
    }

    /// The next pixel that has not been traced since it was queued.
    pub(crate) fn next(&mut self, canvas: &Canvas) -> Option<u32> {
        while let Some((pixel, found)) = self.queue.pop_front() {
            if let Some(&(later, _)) = self.queue.get(AHEAD) {
                wide::prefetch(canvas.time(), later as usize);
                wide::prefetch(canvas.known(), later as usize);
                wide::prefetch(&self.queued.0, later as usize / 8);
            }
            self.queued.set(pixel, false);
            let traced = canvas.time()[pixel as usize];
            if age_nanos(found, traced) > self.fresh_nanos as u64 || !canvas.known()[pixel as usize]
            {
                return Some(pixel);
            }
        }
        None
    }

    pub(crate) fn clear(&mut self) {
        for (pixel, _) in self.queue.drain(..) {
            self.queued.set(pixel, false);
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
        front.observe(&[found(0, now, 0.1)], &canvas, |_| false);
        let queued: Vec<u32> = std::iter::from_fn(|| front.next(&canvas)).collect();
        assert_eq!(queued, [4, 5], "1 is 5 ms old, and the corner has no other");
        assert!(is_part(&found(0, now, 0.1)));
        assert!(!is_part(&found(0, now, 0.001)), "too small a change");
        let unknown = Observation { known: false, ..found(0, now, 0.1) };
        assert!(!is_part(&unknown), "its change says nothing");
    }

    #[test]
    fn who_was_traced_since_is_left_out() {
        let size = Size::new(3, 1);
        let mut canvas = Canvas::from_picture(size, vec![[0.0; 3]; 3]);
        let mut front = Front::new(size);
        front.observe(&[found(1, Time::from_secs(1.0), 0.1)], &canvas, |_| false);
        canvas.replace(0, Time::from_secs(1.0), [0.0; 3]);
        assert_eq!((front.next(&canvas), front.next(&canvas)), (Some(2), None));
    }

    #[test]
    fn every_pixel_has_the_neighbours_that_it_has() {
        let (size, now) = (Size::new(4, 3), Time::from_secs(1.0));
        let canvas = Canvas::from_picture(size, vec![[0.0; 3]; 12]);
        for pixel in 0..12 {
            let mut front = Front::new(size);
            front.observe(&[found(pixel, now, 0.1)], &canvas, |_| false);
            let queued: Vec<u32> = std::iter::from_fn(|| front.next(&canvas)).collect();
            let near = |other: &u32| {
                let ((x, y), (u, v)) = (size.xy(pixel), size.xy(*other));
                *other != pixel && x.abs_diff(u) < 2 && y.abs_diff(v) < 2
            };
            assert_eq!(queued, (0..12).filter(near).collect::<Vec<u32>>(), "pixel {pixel}");
        }
    }

    #[test]
    fn late_looks_begin_no_fronts() {
        let canvas = Canvas::from_picture(Size::new(3, 1), vec![[0.0; 3]; 3]);
        let mut front = Front::new(canvas.size());
        front.observe(&[found(1, Time::from_secs(1.0), 0.1)], &canvas, |pixel| pixel == 1);
        assert_eq!(front.next(&canvas), None);
    }

    #[test]
    fn where_all_fronts_are_followed_younger_neighbours_are_looked_at_again() {
        let mut canvas = Canvas::from_picture(Size::new(3, 1), vec![[0.0; 3]; 3]);
        let mut front = Front::new(canvas.size());
        let now = Time::from_secs(1.0);
        (0..3).for_each(|pixel| _ = canvas.replace(pixel, Time::from_secs(0.995), [0.0; 3]));
        let next = |front: &mut Front| {
            front.observe(&[found(1, now, 0.1)], &canvas, |_| false);
            std::iter::from_fn(|| front.next(&canvas)).count()
        };
        assert_eq!(next(&mut front), 0, "5 ms are young at first");
        let millis = |millis: u64| Time(millis * 1_000_000);
        (1..101).for_each(|time| front.adapt(millis(time), true));
        assert_eq!(next(&mut front), 2);
        (101..201).for_each(|time| front.adapt(millis(time), false));
        assert_eq!(next(&mut front), 0, "and again where fronts have to wait");
    }
}
