//! Numbers as colours: the colour map, and the scale that says which number has which colour.

use std::sync::LazyLock;

/// Which values the colours stand for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Scale {
    /// From 0 (darkest) to `high` (brightest), evenly.
    Linear {
        /// Positive.
        high: f32,
    },
    /// From `low` (darkest) to `high` (brightest), equal steps for equal factors. Zero is darkest.
    Logarithmic {
        /// Positive, below `high`.
        low: f32,
        /// Positive.
        high: f32,
    },
}

impl Scale {
    /// Where a value lies between darkest and brightest, in [0, 1]; what lies outside is clamped, NaN is 0.
    pub fn position(&self, value: f32) -> f32 {
        let position = match *self {
            Scale::Linear { high } => value / high,
            Scale::Logarithmic { low, .. } if value <= low => 0.0,
            Scale::Logarithmic { low, high } => (value / low).ln() / (high / low).ln(),
        };
        if position.is_nan() { 0.0 } else { position.clamp(0.0, 1.0) }
    }

    /// Values worth a tick, with their position in [0, 1], from dark to bright.
    pub fn ticks(&self) -> Vec<(f32, f32)> {
        match *self {
            // Quarters of 1, 2 or 5 times a power of ten have at most three digits.
            Scale::Linear { high } => {
                (0..=4).map(|i| i as f32 / 4.0).map(|at| (at, at * high)).collect()
            }
            Scale::Logarithmic { low, high } => {
                let decades = (high / low).log10().round() as i32;
                let values = (0..=decades).map(|i| low * 10f32.powi(i));
                values.map(|value| (self.position(value), value)).collect()
            }
        }
    }

    /// A linear scale for values up to about `largest`: its end is 1, 2 or 5 times a power of ten, so that it
    /// stays the same while the values flicker. Without any positive value it ends at 1.
    pub fn linear_up_to(largest: f32) -> Scale {
        if !(largest.is_finite() && largest > 0.0) {
            return Scale::Linear { high: 1.0 };
        }
        let decade = 10f32.powf(largest.log10().floor());
        let steps = [1.0, 2.0, 5.0, 10.0].map(|step| step * decade);
        // 10 · decade is above `largest` but for rounding; then it is as good.
        let high = steps.into_iter().find(|&end| end >= largest).unwrap_or(steps[3]);
        Scale::Linear { high }
    }
}

/// The value that about 99 % of `values` do not exceed, from every 61st of them: a few extreme pixels must not
/// darken all others. 0 if there are none.
pub fn typical_largest(values: impl ExactSizeIterator<Item = f32>) -> f32 {
    // Prime, so that it visits all columns of pictures whose width is a multiple of a tile's.
    const STRIDE: usize = 61;
    let stride = if values.len() > 64 * STRIDE { STRIDE } else { 1 };
    let mut some: Vec<f32> = values.step_by(stride).filter(|value| value.is_finite()).collect();
    if some.is_empty() {
        return 0.0;
    }
    let rank = (some.len() - 1) * 99 / 100;
    *some.select_nth_unstable_by(rank, f32::total_cmp).1
}

const STEPS: usize = 256;

static INFERNO: LazyLock<[[u8; 4]; STEPS]> = LazyLock::new(|| {
    std::array::from_fn(|i| {
        let [r, g, b] = inferno(i as f32 / (STEPS - 1) as f32).map(|c| (255.0 * c).round() as u8);
        [r, g, b, 255]
    })
});

/// sRGB colour with alpha 255 of a position in [0, 1].
pub fn colour(position: f32) -> [u8; 4] {
    INFERNO[((position * (STEPS - 1) as f32 + 0.5) as usize).min(STEPS - 1)]
}

/// The colour map "inferno" (Smith & van der Walt 2015, matplotlib): perceptually uniform, from black over
/// red to pale yellow, lightness rising evenly, so that it also reads in grey and with colour-blind eyes.
///
/// Polynomial of degree 6 fitted to it: M. Zucker, shadertoy.com/view/WlfXRN, CC0.
fn inferno(t: f32) -> [f32; 3] {
    const COEFFICIENTS: [[f32; 3]; 7] = [
        [0.000_218_94, 0.001_651, -0.019_480_9],
        [0.106_513_42, 0.563_956_44, 3.932_712_4],
        [11.602_493, -3.972_854, -15.942_394],
        [-41.703_996, 17.436_4, 44.354_145],
        [77.162_94, -33.402_36, -81.807_31],
        [-71.319_43, 32.626_064, 73.209_52],
        [25.131_126, -12.242_669, -23.070_325],
    ];
    let horner = |k: usize| COEFFICIENTS.iter().rev().fold(0.0, |sum, power| sum * t + power[k]);
    [0, 1, 2].map(|k| horner(k).clamp(0.0, 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_fit_meets_the_published_table() {
        // matplotlib's inferno, entries 0, 128 and 255.
        for (t, want) in [
            (0.0, [0.001, 0.000, 0.014]),
            (128.0 / 255.0, [0.736, 0.216, 0.330]),
            (1.0, [0.988, 0.998, 0.645]),
        ] {
            for (got, want) in inferno(t).into_iter().zip(want) {
                assert!((got - want).abs() < 0.02, "inferno({t}): {got}, want {want}");
            }
        }
    }

    #[test]
    fn lightness_rises() {
        let luma = |i: usize| {
            let [r, g, b, _] = INFERNO[i].map(f32::from);
            0.299 * r + 0.587 * g + 0.114 * b
        };
        for i in (8..STEPS).step_by(8) {
            assert!(luma(i) > luma(i - 8), "entry {i}");
        }
    }

    #[test]
    fn the_ends_of_a_scale_are_the_ends_of_the_colours() {
        let linear = Scale::Linear { high: 2.0 };
        assert_eq!(
            [0.0, 1.0, 2.0, 9.0, -1.0].map(|v| linear.position(v)),
            [0.0, 0.5, 1.0, 1.0, 0.0]
        );
        let logarithmic = Scale::Logarithmic { low: 1e-4, high: 1.0 };
        assert_eq!(logarithmic.position(0.0), 0.0);
        assert_eq!(logarithmic.position(3.0), 1.0);
        assert!((logarithmic.position(1e-2) - 0.5).abs() < 1e-6);
        for scale in [linear, logarithmic] {
            assert_eq!(scale.position(f32::NAN), 0.0);
            assert_eq!(colour(scale.position(f32::INFINITY)), INFERNO[STEPS - 1]);
        }
    }

    #[test]
    fn linear_scales_end_at_round_numbers_above_the_largest_value() {
        for (largest, want) in [
            (0.9, 1.0),
            (1.0, 1.0),
            (1.1, 2.0),
            (3.0, 5.0),
            (7e3, 1e4),
            (0.0, 1.0),
            (f32::NAN, 1.0),
        ] {
            let Scale::Linear { high } = Scale::linear_up_to(largest) else { unreachable!() };
            assert!((high / want - 1.0).abs() < 1e-5, "up to {largest}: {high}, want {want}");
        }
        let tiny = Scale::linear_up_to(f32::MIN_POSITIVE);
        assert!(tiny.position(f32::MIN_POSITIVE).is_finite());
    }

    #[test]
    fn ticks_lie_where_their_values_are() {
        for scale in [Scale::linear_up_to(37.0), Scale::Logarithmic { low: 1e-4, high: 1.0 }] {
            let ticks = scale.ticks();
            assert_eq!(ticks.len(), 5);
            assert_eq!((ticks[0].0, ticks[4].0), (0.0, 1.0));
            for (at, value) in ticks {
                assert!((scale.position(value) - at).abs() < 1e-5);
            }
        }
    }

    #[test]
    fn the_typical_largest_value_ignores_a_few_extreme_ones() {
        let mut values = vec![1.0_f32; 10_000];
        values[61 * 3] = 1e9;
        values[61 * 4] = f32::NAN;
        assert_eq!(typical_largest(values.iter().copied()), 1.0);
        assert_eq!(typical_largest([].into_iter()), 0.0);
        assert_eq!(typical_largest([3.0].into_iter()), 3.0);
    }
}
