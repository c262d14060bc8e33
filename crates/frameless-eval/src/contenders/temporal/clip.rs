//! What colours the present frame allows the history to have: variance clipping.
//!
//! Source: Salvi, "An excursion in temporal supersampling", GDC 2016: a box of mean ± γ standard deviations of the 3×3 samples around, in
//! YCoCg, whose axes follow the colours of natural pictures better than red, green and blue do.

use frameless::Size;

/// Luminance and two differences of colour: Y = (R + 2G + B)/4, Co = (R − B)/2, Cg = (−R + 2G − B)/4.
pub(super) fn ycocg([r, g, b]: [f32; 3]) -> [f32; 3] {
    [0.25 * r + 0.5 * g + 0.25 * b, 0.5 * (r - b), -0.25 * r + 0.5 * g - 0.25 * b]
}

/// The inverse of [`ycocg`].
pub(super) fn rgb([y, co, cg]: [f32; 3]) -> [f32; 3] {
    [y + co - cg, y + cg, y - co - cg]
}

/// Mean and standard deviation of a neighbourhood, per channel of YCoCg.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Spread {
    pub(super) mean: [f32; 3],
    pub(super) deviation: [f32; 3],
}

impl Spread {
    /// Of the 3×3 colours (YCoCg) around every sample, fewer at the border.
    pub(super) fn around(colours: &[[f32; 3]], size: Size) -> Vec<Spread> {
        let around = |sample: u32| {
            let (x, y) = size.xy(sample);
            let (mut sum, mut squares, mut count) = ([0.0; 3], [0.0; 3], 0.0);
            for j in y.saturating_sub(1)..=(y + 1).min(size.height - 1) {
                for i in x.saturating_sub(1)..=(x + 1).min(size.width - 1) {
                    let colour = colours[size.index(i, j) as usize];
                    (0..3).for_each(|k| sum[k] += colour[k]);
                    (0..3).for_each(|k| squares[k] += colour[k] * colour[k]);
                    count += 1.0;
                }
            }
            let mean = sum.map(|s: f32| s / count);
            let variance = |k: usize| (squares[k] / count - mean[k] * mean[k]).max(0.0);
            Spread { mean, deviation: std::array::from_fn(|k| variance(k).sqrt()) }
        };
        (0..size.pixels() as u32).map(around).collect()
    }

    /// The colour (display RGB) moved towards the mean until it lies in the box of ± `gamma` deviations (and `slack`), and how much of the way
    /// from the mean was left: 1 inside the box, towards 0 far outside.
    pub(super) fn clip(&self, colour: [f32; 3], gamma: f32, slack: f32) -> ([f32; 3], f32) {
        let away = ycocg(colour);
        let away: [f32; 3] = std::array::from_fn(|k| away[k] - self.mean[k]);
        let outside = |k: usize| away[k].abs() / (gamma * self.deviation[k] + slack);
        let farthest = outside(0).max(outside(1)).max(outside(2));
        if farthest <= 1.0 {
            return (colour, 1.0);
        }
        let left = 1.0 / farthest;
        (rgb(std::array::from_fn(|k| self.mean[k] + away[k] * left)), left)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ycocg_there_and_back() {
        assert_eq!(ycocg([1.0; 3]), [1.0, 0.0, 0.0]);
        let colour = [0.25, 0.5, 1.0];
        assert_eq!(rgb(ycocg(colour)), colour);
    }

    #[test]
    fn clipping_by_hand() {
        let spread = Spread { mean: [0.5, 0.0, 0.0], deviation: [0.1, 0.1, 0.1] };
        assert_eq!(spread.clip([0.55; 3], 1.0, 0.0), ([0.55; 3], 1.0), "inside");
        let (clipped, left) = spread.clip([0.9; 3], 1.0, 0.0);
        assert!((left - 0.25).abs() < 1e-6, "{left}");
        assert!(clipped.iter().all(|c| (c - 0.6).abs() < 1e-6), "{clipped:?}");
    }

    #[test]
    fn the_spread_of_a_border_has_fewer_samples() {
        let size = Size::new(3, 1);
        let colours = [[0.0; 3], [0.5; 3], [1.0; 3]];
        let spreads = Spread::around(&colours, size);
        assert_eq!((spreads[0].mean, spreads[0].deviation), ([0.25; 3], [0.25; 3]));
        assert_eq!(spreads[1].mean, [0.5; 3]);
        assert!((spreads[1].deviation[0] - (1.0f32 / 6.0).sqrt()).abs() < 1e-6);
    }
}
