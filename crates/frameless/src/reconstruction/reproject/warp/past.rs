//! Rays that have gone past a nearer surface tell where it ends.
//!
//! A sample stands for its pixel's centre, beside which it lies. If a ray has gone on to something behind it, its surface has an end
//! between the two; carried along with the surface, that ray's place still lies beyond the end:
//!
//! ```text
//! r = ray + (m − b) · age / T        m, b: how far the nearer sample, and the farther where it is carried along, move in a refresh's T
//! the nearer one is not what is seen at the centre if |r − centre| < 2 |sample − centre|
//! ```
//!
//! Twice, since of the nearer surface's samples in a pixel that next to the centre counts, of the rays only one. So what is behind shows
//! as soon as it has been seen, and an object is not wider than it is by what its samples are beside their centres.

use super::Moving;
use crate::Pose;
use crate::reconstruction::reproject::store::{self, Record, Sample, Tick};

/// Depths within this ratio may be of one surface, some of them from before the last refresh.
const BEHIND: f32 = 0.07;
/// Squared: how many times as far from the centre as the nearer sample a ray may have passed.
const FARTHER2: f32 = 4.0;

/// How everything has moved.
pub(in super::super) struct Motion<'a> {
    /// Where everything is now, and where it was at the refresh before.
    pub(in super::super) poses: [&'a Pose; 2],
    /// When that is, and was.
    pub(in super::super) ticks: [Tick; 2],
    /// Whether anything is known of the refresh before.
    pub(in super::super) is_known: bool,
}

/// Where in the picture a ray went, in pixels, when, and how far.
#[derive(Clone, Copy)]
pub(super) struct Ray {
    px: [f32; 2],
    tick: Tick,
    depth: f32,
}

impl Ray {
    pub(super) fn of(sample: &Sample) -> Ray {
        Ray { px: sample.px, tick: sample.record.tick(), depth: sample.record.depth() }
    }

    /// Whether it has gone on behind a depth, by more than a ratio.
    #[inline(always)]
    pub(super) fn is_behind(&self, depth: f32, by: f32) -> bool {
        depth < self.depth * (1.0 - by)
    }
}

impl Motion<'_> {
    #[cfg(test)]
    pub(super) fn unknown(pose: &Pose) -> Motion<'_> {
        Motion { poses: [pose, pose], ticks: [Tick::default(); 2], is_known: false }
    }

    pub(super) fn now(&self) -> &Pose {
        self.poses[0]
    }

    /// How far a sample has moved since the refresh before, in pixels.
    fn of(&self, sample: &Moving<'_>) -> Option<[f32; 2]> {
        let surface = store::surface(sample.object, sample.primitive, sample.surfel);
        let [now, before] = self.poses.map(|pose| pose.project(&surface).map(|there| there.px));
        let (now, before) = (now?, before?);
        Some([0, 1].map(|k| now[k] - before[k]))
    }

    /// Whether a ray, later than a nearer sample that has been carried, has gone past it. `moves`: what was hit, in pixels per refresh, if
    /// the ray's place is where that is now.
    pub(super) fn is_past(&self, ray: &Ray, moves: [f32; 2], near: &Moving<'_>) -> bool {
        if !self.is_known || !ray.tick.is_later_than(near.record.tick()) {
            return false;
        }
        let Some(near_moves) = self.of(near) else { return false };
        let [now, before] = self.ticks;
        let interval = now.0.wrapping_sub(before.0) as f32;
        let age = now.0.wrapping_sub(ray.tick.0) as f32 / interval;
        let [near_from, ray_from]: [[f32; 2]; 2] = {
            let centre = near.px.map(|p| p as i32 as f32 + 0.5);
            let carried = |k: usize| ray.px[k] + (near_moves[k] - moves[k]) * age;
            [[0, 1].map(|k| near.px[k] - centre[k]), [0, 1].map(|k| carried(k) - centre[k])]
        };
        let distance2 = |from: [f32; 2]| from[0] * from[0] + from[1] * from[1];
        interval > 0.0 && distance2(ray_from) < FARTHER2 * distance2(near_from)
    }

    /// Whether the ray of a farther sample in the same cell, which has been carried, too, has gone past a nearer one.
    // Few samples meet; those that do not are to be put down fast.
    #[inline(never)]
    pub(super) fn sample_is_past(&self, far: &Moving<'_>, near: &Moving<'_>) -> bool {
        let tick = far.record.tick();
        if !tick.is_later_than(near.record.tick()) {
            return false;
        }
        let ray = Ray { px: far.px, tick, depth: far.record.depth() };
        self.of(far).is_some_and(|moves| self.is_past(&ray, moves, near))
    }

    /// The same of whoever was in the cell of a sample until now, if its ray went there since the refresh before.
    #[inline(always)]
    pub(super) fn last_is_past(&self, last: &Record, near: &Moving<'_>) -> bool {
        let [_, before] = self.ticks;
        let tick = last.tick();
        tick.is_later_than(before) && self.fresh_is_past(last, near)
    }

    #[inline(never)]
    fn fresh_is_past(&self, last: &Record, near: &Moving<'_>) -> bool {
        let (offset, pixel) = (last.offset(), near.px.map(|p| p as i32 as f32 + 0.5));
        let px = [0, 1].map(|k| pixel[k] + offset[k]);
        let ray = Ray { px, tick: last.tick(), depth: last.depth() };
        ray.is_behind(near.record.depth(), BEHIND) && self.is_past(&ray, [0.0; 2], near)
    }
}
