//! A pixel of the new history from the new frame and the history so far.

use super::clip::Spread;
use super::history::{History, Past};
use super::low_frame::{Footprint, LowFrame, Sample};

/// What `temporal` was tuned for; docs/evaluation.md has the table.
#[derive(Clone, Copy, Debug)]
pub(super) struct Tuning {
    /// How far from a pixel's centre, in pixels, a sample is worth a quarter of one at the centre. Larger: softer, sooner settled.
    pub(super) kernel_px: f32,
    /// What is left of the weight of a pixel that has been resampled: every resampling softens it.
    pub(super) resampled: f32,
    /// γ of the variance clipping, in standard deviations. Larger: finer detail where nothing changes, longer ghosts where it does.
    pub(super) gamma: f32,
    /// Added to the clipping box, in display sRGB, so that flat places are not clipped for rounding.
    pub(super) slack: f32,
    /// Change in display sRGB that makes a pixel's history half as trustworthy.
    pub(super) doubt: f32,
}

/// Below a thousandth of a pixel nothing has moved: projecting to and fro has rounded.
const STILL_PX: f32 = 1e-3;

/// History of more weight than this has had a sample at the pixel's centre, and little has come between.
const SHARP: f32 = 0.5;

/// What a frame is added to the history with.
pub(super) struct Resolve<'a> {
    frame: &'a LowFrame,
    history: &'a History,
    /// Per sample: by how much its colour differs from a history that was as sharp.
    changes: Vec<f32>,
    secs: f32,
    tuning: Tuning,
}

/// A place in the history that shows what a pixel shows now.
#[derive(Clone, Copy)]
struct Found {
    object: u32,
    /// In pixels from the picture's corner.
    at: [f32; 2],
    moved: bool,
    /// 1 / depth now.
    inverse_depth: f32,
    past: Past,
}

impl<'a> Resolve<'a> {
    /// `secs`: the moment that the frame shows.
    pub(super) fn new(
        frame: &'a LowFrame,
        history: &'a History,
        secs: f64,
        tuning: Tuning,
    ) -> Resolve<'a> {
        let changes = frame.samples.iter().map(|sample| change(sample, history)).collect();
        Resolve { frame, history, changes, secs: secs as f32, tuning }
    }

    /// Pixel (x, y).
    pub(super) fn pixel(&self, x: u32, y: u32) -> Past {
        let centre = [x as f32 + 0.5, y as f32 + 0.5];
        let footprint = self.frame.around(x, y);
        let nearest = self.sample(footprint.nearest());
        if nearest.at_px == centre {
            return self.fresh(nearest, nearest.colour, 1.0);
        }
        match self.find(&footprint, centre) {
            Some(found) => self.blended(&footprint, centre, &found),
            None => {
                let colour = footprint.mean(|i| Some(self.sample(i).colour));
                let weight = self.kernel(nearest, centre);
                self.fresh(nearest, colour.unwrap_or(nearest.colour), weight)
            }
        }
    }

    fn sample(&self, index: u32) -> &Sample {
        &self.frame.samples[index as usize]
    }

    /// Nothing of the history is used.
    fn fresh(&self, sample: &Sample, colour: [f32; 3], weight: f32) -> Past {
        let Sample { object, inverse_depth, .. } = *sample;
        Past { colour, weight, object, inverse_depth, secs: self.secs }
    }

    /// What a sample is worth for a pixel: 1 / (1 + d²/k²)², d = distance from its centre. It falls so slowly that of samples far
    /// away still the nearest counts most.
    fn kernel(&self, sample: &Sample, centre: [f32; 2]) -> f32 {
        let falloff =
            1.0 + sample.distance2_px(centre) / (self.tuning.kernel_px * self.tuning.kernel_px);
        1.0 / (falloff * falloff)
    }

    /// Of the objects around, the frontmost one that the history shows at the place where it was. Motion and depths
    /// are interpolated between the samples of the object.
    fn find(&self, footprint: &Footprint, centre: [f32; 2]) -> Option<Found> {
        let mut best: Option<Found> = None;
        for &index in &footprint.samples {
            let object = self.sample(index).object;
            if best.is_some_and(|best| best.object == object) {
                continue;
            }
            let mean = footprint.mean(|i| {
                let sample = self.sample(i);
                let motion = sample.motion.filter(|_| sample.object == object)?;
                let [dx, dy] = motion.back_px;
                Some([dx, dy, motion.inverse_depth, sample.inverse_depth])
            });
            let Some([dx, dy, inverse_depth_then, inverse_depth]) = mean else { continue };
            let moved = dx.abs() > STILL_PX || dy.abs() > STILL_PX;
            let at = if moved { [centre[0] + dx, centre[1] + dy] } else { centre };
            let Some(&past) = self.history.at(at) else { continue };
            let in_front = best.is_none_or(|best| inverse_depth > best.inverse_depth);
            if in_front && past.shows(object, inverse_depth_then) {
                best = Some(Found { object, at, moved, inverse_depth, past });
            }
        }
        best
    }

    fn blended(&self, footprint: &Footprint, centre: [f32; 2], found: &Found) -> Past {
        let of_object = |i: u32| Some(self.sample(i)).filter(|s| s.object == found.object);
        let present =
            footprint.mean(|i| of_object(i).map(|s| s.colour)).unwrap_or(found.past.colour);
        let weights =
            footprint.samples.map(|i| of_object(i).map_or(0.0, |s| self.kernel(s, centre)));
        let weight = weights.into_iter().fold(0.0, f32::max);

        let (past, trust) = self.past(footprint, found);
        let kept = found.past.weight * trust;
        // A history that was sampled at the centre, and that nothing casts doubt on, gains nothing from samples beside it.
        let is_known = !found.moved && kept > SHARP;
        let t = if weight > 0.0 && !is_known { weight / (weight + kept) } else { 0.0 };
        Past {
            colour: std::array::from_fn(|k| past[k] + t * (present[k] - past[k])),
            weight: (weight + kept).min(1.0),
            object: found.object,
            inverse_depth: found.inverse_depth,
            secs: found.past.secs + t * (self.secs - found.past.secs),
        }
    }

    /// The history's colour as far as the present frame allows it, and what of its weight is left.
    fn past(&self, footprint: &Footprint, found: &Found) -> ([f32; 3], f32) {
        let Tuning { resampled, gamma, slack, doubt, .. } = self.tuning;
        let (colour, resampled) = if found.moved {
            (self.history.colour(found.at, &found.past), resampled)
        } else {
            (found.past.colour, 1.0)
        };
        // What stands still and was sampled at its centre is known better than its neighbourhood could tell; doubt remains.
        let is_sharp = !found.moved && found.past.weight > SHARP;
        let (colour, unclipped) = if is_sharp {
            (colour, 1.0)
        } else {
            self.spread(footprint).clip(colour, gamma, slack)
        };
        let change = footprint.mean(|i| {
            (self.sample(i).object == found.object).then_some([self.changes[i as usize]])
        });
        let doubts = change.map_or(0.0, |[change]| change / doubt);
        (colour, resampled * unclipped / (1.0 + doubts * doubts))
    }

    /// What colours the neighbourhood has.
    fn spread(&self, footprint: &Footprint) -> Spread {
        let spread = |i: u32| &self.frame.spreads[i as usize];
        Spread {
            mean: footprint.mean(|i| Some(spread(i).mean)).unwrap_or_default(),
            deviation: footprint.mean(|i| Some(spread(i).deviation)).unwrap_or_default(),
        }
    }
}

/// By how much a sample's colour differs, in its most different channel, from what the history shows at the same place; 0 where the
/// history is not as sharp as the sample, so that nothing can be told.
fn change(sample: &Sample, history: &History) -> f32 {
    let Some(motion) = sample.motion else { return 0.0 };
    if motion.back_px.iter().any(|d| d.abs() > STILL_PX) {
        return 0.0;
    }
    match history.at(sample.at_px) {
        Some(past) if past.weight > SHARP && past.shows(sample.object, motion.inverse_depth) => {
            (0..3).map(|k| (sample.colour[k] - past.colour[k]).abs()).fold(0.0, f32::max)
        }
        _ => 0.0,
    }
}
