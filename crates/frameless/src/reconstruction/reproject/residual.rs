//! Change as prediction error: a new sample against what the picture showed of its surface.
//!
//! The new hit is projected to where it was at the last refresh. For a surface at rest the error is the smaller of those against the
//! nearest pixel and against the bilinear interpolation. For a moving one it is the distance to the range of the 3×3 colours
//! there, plus a tenth of that: resampling a texture at other places is not change. What comes into the picture is compared with the border
//! where it does: that is what would be shown without a sample. And if its pixel has been traced since the last refresh and the same object
//! was hit, only what differs from that is change: what the last picture did not know has been found already.

use super::store::{SCREEN, Sample, Tick};
use super::{Reproject, ReprojectStage};
use crate::{Display, Kept, Projected, Request, Size, wide};

/// What a sample found.
pub(super) struct Found {
    /// Σ over the channels of the squared difference.
    pub(super) change: f32,
    /// Whether the pixel's other samples show something that is no longer there.
    pub(super) outdated: bool,
    /// Of the sample, where its surface was at the last refresh.
    pub(super) depth: f32,
}

/// Per channel; where nothing can be compared, a quarter of the range is assumed to have changed.
const UNKNOWN: f32 = 0.05;
/// A surface that has moved less than this between two refreshes is at rest.
const AT_REST_PX: f32 = 0.05;
/// How much the raw difference of moving surfaces counts beside the distance to the range of colours.
const RAW: f32 = 0.1;
/// As in front propagation: mean squared difference per channel.
pub(super) const OUTDATED: f32 = 0.0025;

/// Where rays differ, so many variances of the renderer's noise are no change.
const NOISE: f32 = 4.0;

/// What has changed a pixel by less (Σ over the channels) has not changed its neighbours by a step of 8 bits.
const VISIBLE: f32 = 3.0 / (255.0 * 255.0);

/// A new sample, and where its surface was at the last refresh.
pub(super) struct Landed {
    pub(super) sample: Sample,
    then: Option<Projected>,
}

impl Reproject {
    /// Sample `i` of those kept. Begins to fetch what was shown of its surface.
    #[inline(always)]
    pub(super) fn land(&self, kept: &Kept<'_>, i: usize, display: &Display) -> Landed {
        let sample = Sample::new(kept, i, display, self.options.relight);
        let is_known = self.refreshes > 0 && sample.object != SCREEN;
        let then = if is_known { self.poses[0].project(&sample.surface()) } else { None };
        if let Some(there) = then {
            let Size { width, height } = kept.size;
            let [x, y] = there.px.map(|p| p as u32);
            for y in y.saturating_sub(1)..(y + 2).min(height) {
                wide::prefetch(&self.shown, (y * width + x.min(width - 1)) as usize);
            }
        }
        Landed { sample, then }
    }

    /// What sample `i` of those kept found. Takes it up if its pixel is at rest.
    pub(super) fn residual(
        &mut self,
        landed: &Landed,
        kept: &Kept<'_>,
        i: usize,
        display: &Display,
    ) -> Found {
        let sample = &landed.sample;
        let rgb = if self.options.relight {
            self.relight.as_shown(sample, display)
        } else {
            sample.record.rgb()
        };
        let found = self.against_shown(landed, rgb, || display.encode(kept.old[i]));
        let request = kept.requests[i];
        let (x, y) = kept.size.xy(request.pixel);
        if request == Request::centre(request.pixel)
            && let Some(cell) = self.store.central(x, y)
            && self.settled.rests(self.store.object[cell])
        {
            // The same ray as before: all that differs is change. (Against the picture, a mean of old samples would differ from
            // every new one, be thought to change, and so remain a mean.)
            let before = self.store.record[cell].rgb();
            let change = squared(rgb, before);
            if !self.knows_lights && !kept.is_noisy {
                let age_secs = kept.now.secs_since(self.store.tick(cell).time(kept.now));
                self.drift.note([x, y], before, rgb, age_secs as f32);
            }
            if self.settled.count(request.pixel) > 0 {
                let (rgb, is_noisy) = (kept.new[i], kept.is_noisy);
                if change > 0.0 {
                    self.store.touched.mark(x, y);
                }
                let reaches_on = self.settled.verify(request.pixel, rgb, change, display, is_noisy);
                if reaches_on && change > VISIBLE {
                    self.settled.begin_around(&self.store, &self.relight, [x, y], display);
                }
            }
            return Found { change, outdated: change > 3.0 * OUTDATED, ..found };
        }
        if kept.is_noisy {
            let change = (found.change - NOISE * self.settled.noise(request.pixel)).max(0.0);
            return Found { change, outdated: change > 3.0 * OUTDATED, ..found };
        }
        found
    }

    fn against_shown(&self, landed: &Landed, rgb: [f32; 3], old: impl Fn() -> [f32; 3]) -> Found {
        let Landed { sample, then } = landed;
        if self.refreshes == 0 || sample.object == SCREEN {
            let change = squared(sample.record.rgb(), old());
            return Found { change, outdated: change > 3.0 * OUTDATED, depth: f32::INFINITY };
        }
        let size = self.store.layout.size;
        let depth = then.map_or(f32::INFINITY, |there| there.depth);
        let Some(px) = then.map(|there| there.px) else {
            return Found { change: UNKNOWN, outdated: true, depth };
        };
        let end = [size.width, size.height].map(|end| end as f32 - 0.01);
        let px = [0, 1].map(|k| px[k].clamp(0.0, end[k]));
        let shown = self.around(px);
        let raw = squared(rgb, shown.nearest()).min(squared(rgb, shown.bilinear(px)));
        let outdated = raw > 3.0 * OUTDATED;
        let moving = self.options.without != Some(ReprojectStage::Range)
            && self.refreshes >= 2
            && !self.settled.rests(sample.object)
            && self.poses[1].project(&sample.surface()).is_some_and(|before| {
                let [dx, dy] = [before.px[0] - px[0], before.px[1] - px[1]];
                dx * dx + dy * dy > AT_REST_PX * AT_REST_PX
            });
        let change = if moving { shown.beyond_range(rgb) + RAW * raw } else { raw };
        let found =
            self.found_since(sample).map_or(change, |since| change.min(squared(rgb, since)));
        Found { change: found, outdated, depth }
    }

    /// The colour of the sample in the same cell, if it is of the same object and has been traced since the last refresh.
    #[inline(always)]
    fn found_since(&self, sample: &Sample) -> Option<[f32; 3]> {
        let cell = self.store.layout.of_px(sample.px)?;
        let is_same = self.store.object[cell] == sample.object;
        let is_new = self.store.tick(cell).is_later_than(Tick::of(self.shown_at));
        (is_same && is_new).then(|| self.store.record[cell].rgb())
    }

    /// What is shown around a position inside the picture; beyond its border, what is shown at the border.
    #[inline(always)]
    pub(super) fn around(&self, px: [f32; 2]) -> Around {
        let height = self.store.layout.size.height;
        let (x, y) = (px[0] as u32, px[1] as u32);
        Around {
            middle: [x as f32, y as f32],
            rows: [
                self.three(x, y.saturating_sub(1)),
                self.three(x, y),
                self.three(x, (y + 1).min(height - 1)),
            ],
        }
    }

    /// What is shown in and to both sides of pixel (x, y).
    #[inline(always)]
    fn three(&self, x: u32, y: u32) -> [f32; 9] {
        let (width, column) = (self.store.layout.size.width, x as usize);
        let row = &self.shown[(y * width) as usize..][..width as usize];
        if let Some(three) = row.get(column.wrapping_sub(1)..column + 2) {
            return three.as_flattened().as_chunks().0[0];
        }
        let columns = [column.saturating_sub(1), column, (column + 1).min(row.len() - 1)];
        let [[a, b, c], [d, e, f], [g, h, i]] = columns.map(|column| row[column]);
        [a, b, c, d, e, f, g, h, i]
    }
}

/// The colours of 3×3 pixels.
pub(super) struct Around {
    /// Column and row of the one in the middle.
    middle: [f32; 2],
    /// Of three pixels in a row red, green and blue, one after the other.
    rows: [[f32; 9]; 3],
}

impl Around {
    fn nearest(&self) -> [f32; 3] {
        [self.rows[1][3], self.rows[1][4], self.rows[1][5]]
    }

    /// Interpolated between the pixels' centres.
    #[inline(always)]
    fn bilinear(&self, px: [f32; 2]) -> [f32; 3] {
        let from_centre = [px[0] - self.middle[0] - 0.5, px[1] - self.middle[1] - 0.5];
        // The first of the two columns, and of the two rows.
        let [(x, u), (y, v)] = from_centre.map(|d| if d < 0.0 { (0, d + 1.0) } else { (1, d) });
        let [above, below] = [&self.rows[y][3 * x..3 * x + 6], &self.rows[y + 1][3 * x..3 * x + 6]];
        std::array::from_fn(|k| {
            let between = |row: &[f32]| row[k] * (1.0 - u) + row[k + 3] * u;
            between(above) * (1.0 - v) + between(below) * v
        })
    }

    /// Squared distance to the range of the colours.
    #[inline(always)]
    pub(super) fn beyond_range(&self, rgb: [f32; 3]) -> f32 {
        let [mut low, mut high] = [self.rows[0]; 2];
        for row in &self.rows[1..] {
            for (k, &c) in row.iter().enumerate() {
                (low[k], high[k]) = (least(low[k], c), most(high[k], c));
            }
        }
        let beyond = |k: usize| {
            let low = least(least(low[k], low[k + 3]), low[k + 6]);
            let high = most(most(high[k], high[k + 3]), high[k + 6]);
            let beyond = most(most(low - rgb[k], rgb[k] - high), 0.0);
            beyond * beyond
        };
        beyond(0) + beyond(1) + beyond(2)
    }
}

/// Of two numbers, neither of which is NaN: one instruction.
#[inline(always)]
fn least(a: f32, b: f32) -> f32 {
    if b < a { b } else { a }
}

/// The same.
#[inline(always)]
fn most(a: f32, b: f32) -> f32 {
    if b > a { b } else { a }
}

pub(super) fn squared(a: [f32; 3], b: [f32; 3]) -> f32 {
    (0..3).map(|k| (a[k] - b[k]).powi(2)).sum()
}
