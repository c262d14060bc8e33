//! One jittered low-resolution frame: colours, what they show, and where that was in the frame before.

use frameless::{Pose, Request, Size, Surface};

use super::clip::{Spread, ycocg};
use crate::contender::encode;

/// One sample of the frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sample {
    /// In pixels of the full picture, from its corner.
    pub(super) at_px: [f32; 2],
    /// Display-referred sRGB.
    pub(super) colour: [f32; 3],
    pub(super) object: u32,
    /// 1 / distance along the direction of view; 0 for the sky.
    pub(super) inverse_depth: f32,
    /// Where the surface was in the frame before; `None`: it was behind the camera or did not exist.
    pub(super) motion: Option<Motion>,
}

/// From this frame back to the one before.
#[derive(Clone, Copy, Debug)]
pub(super) struct Motion {
    /// Add to the present position, in pixels of the full picture.
    pub(super) back_px: [f32; 2],
    /// 1 / depth then.
    pub(super) inverse_depth: f32,
}

/// The frame.
pub(super) struct LowFrame {
    size: Size,
    full: Size,
    jitter: [f32; 2],
    pub(super) samples: Vec<Sample>,
    pub(super) spreads: Vec<Spread>,
}

/// The 2×2 samples around a place, with bilinear weights that add up to 1.
#[derive(Clone, Copy, Debug)]
pub(super) struct Footprint {
    pub(super) samples: [u32; 4],
    pub(super) weights: [f32; 4],
}

impl LowFrame {
    /// Puts together what was traced: `requests` of size `full`, answered by `rgb` and `surfaces`.
    pub(super) fn new(
        (size, full, jitter): (Size, Size, [f32; 2]),
        requests: &[Request],
        (rgb, surfaces): (&[[f32; 3]], &[Surface]),
        (now, before): (&Pose, &Pose),
    ) -> LowFrame {
        let colours = encode(rgb);
        let motion = |surface: &Surface, at: [f32; 2]| {
            let then = before.project(surface)?;
            let back_px = [then.px[0] - at[0], then.px[1] - at[1]];
            Some(Motion { back_px, inverse_depth: then.depth.recip() })
        };
        let sample = |((request, surface), &colour): ((&Request, &Surface), &[f32; 3])| {
            let there = now.project(surface);
            let at = there.map_or(request.position_px(full), |there| there.px);
            Sample {
                at_px: request.position_px(full),
                colour,
                object: surface.object,
                inverse_depth: there.map_or(0.0, |there| there.depth.recip()),
                motion: motion(surface, at),
            }
        };
        let samples = requests.iter().zip(surfaces).zip(&colours).map(sample).collect();
        let ycocg: Vec<[f32; 3]> = colours.iter().map(|&colour| ycocg(colour)).collect();
        LowFrame { size, full, jitter, samples, spreads: Spread::around(&ycocg, size) }
    }

    /// The samples around the centre of pixel (x, y) of the full picture; beyond the outermost samples, these.
    pub(super) fn around(&self, x: u32, y: u32) -> Footprint {
        let place = |i: u32, jitter: f32, low: u32, full: u32| {
            let ratio = full as f32 / low as f32;
            let position = (i as f32 + 0.5) / ratio - 0.5 - jitter;
            let inside = position.clamp(0.0, (low - 1) as f32);
            let first = inside.floor() as u32;
            let second = (first + 1).min(low - 1);
            (first, second, inside - first as f32)
        };
        let (left, right, u) = place(x, self.jitter[0], self.size.width, self.full.width);
        let (top, bottom, v) = place(y, self.jitter[1], self.size.height, self.full.height);
        let samples = [
            self.size.index(left, top),
            self.size.index(right, top),
            self.size.index(left, bottom),
            self.size.index(right, bottom),
        ];
        Footprint { samples, weights: [(1.0 - u) * (1.0 - v), u * (1.0 - v), (1.0 - u) * v, u * v] }
    }
}

impl Sample {
    /// Squared distance from a position, in pixels of the full picture.
    pub(super) fn distance2_px(&self, [x, y]: [f32; 2]) -> f32 {
        let (dx, dy) = (self.at_px[0] - x, self.at_px[1] - y);
        dx * dx + dy * dy
    }
}

impl Footprint {
    /// The sample with the largest weight.
    pub(super) fn nearest(&self) -> u32 {
        let larger = |a: usize, b: usize| if self.weights[b] > self.weights[a] { b } else { a };
        self.samples[(0..4).fold(0, larger)]
    }

    /// Mean, by weight, of those samples for which there is a value; `None` of none.
    pub(super) fn mean<const N: usize>(
        &self,
        value: impl Fn(u32) -> Option<[f32; N]>,
    ) -> Option<[f32; N]> {
        // Lets a sample of weight 0 count where there is no other.
        const LEAST_WEIGHT: f32 = 1e-6;
        let (mut sum, mut total) = ([0.0; N], 0.0);
        for (&sample, &weight) in self.samples.iter().zip(&self.weights) {
            let Some(value) = value(sample) else { continue };
            let weight = weight + LEAST_WEIGHT;
            (0..N).for_each(|n| sum[n] += weight * value[n]);
            total += weight;
        }
        (total > 0.0).then(|| sum.map(|s| s / total))
    }
}
