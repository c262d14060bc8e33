//! From linear radiance to what the display shows: exposure, then the sRGB transfer function.
//!
//! Samples are kept as linear radiance; this step comes after reconstruction, so that changing the exposure
//! restarts nothing. Change is measured behind it, since that is what an eye sees.

use std::sync::LazyLock;

/// How linear radiance becomes a display colour.
#[derive(Clone, Copy, Debug)]
pub struct Display {
    exposure_stops: f32,
    gain: f32,
    table: &'static [f32],
}

impl Default for Display {
    fn default() -> Self {
        Display::new(0.0)
    }
}

impl PartialEq for Display {
    fn eq(&self, other: &Self) -> bool {
        self.exposure_stops == other.exposure_stops
    }
}

impl Display {
    /// Radiance is multiplied by 2^`exposure_stops`.
    pub fn new(exposure_stops: f32) -> Display {
        Display { exposure_stops, gain: exposure_stops.exp2(), table: &SRGB_TABLE }
    }

    /// The exposure in stops (powers of two).
    pub fn exposure_stops(&self) -> f32 {
        self.exposure_stops
    }

    /// Display-referred sRGB in [0, 1] of a finite linear RGB radiance.
    #[inline]
    pub fn encode(&self, rgb: [f32; 3]) -> [f32; 3] {
        rgb.map(|c| srgb_from_linear(self.table, c * self.gain))
    }

    /// The same in 8 bits per channel, with alpha 255.
    #[inline]
    pub fn encode_rgba8(&self, rgb: [f32; 3]) -> [u8; 4] {
        let [r, g, b] = self.encode(rgb).map(Display::quantize);
        [r, g, b, 255]
    }

    /// An encoded channel in [0, 1] to the nearest of 256 steps.
    #[inline]
    pub fn quantize(encoded: f32) -> u8 {
        (encoded * 255.0 + 0.5) as u8
    }

    /// d = Σₖ (newₖ − oldₖ)² of two linear RGB radiances, over display-referred sRGB; in [0, 3].
    #[inline]
    pub fn change(&self, new: [f32; 3], old: [f32; 3]) -> f32 {
        let (new, old) = (self.encode(new), self.encode(old));
        (0..3).map(|k| (new[k] - old[k]) * (new[k] - old[k])).sum()
    }
}

/// The sRGB transfer function (IEC 61966-2-1): linear [0, 1] to encoded [0, 1], in full precision.
fn srgb_exact(linear: f64) -> f64 {
    if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}

// A table over the float's own bits: equal steps within each power of two, so the relative precision is
// the same for dark and bright. 128 steps per octave keep the interpolation error below 4e-6, a thousandth
// of an 8-bit step. Below 2⁻¹³ the function is a straight line.
const SMALLEST: f32 = 1.0 / 8192.0;
const OCTAVES: usize = 13;
const STEPS_LOG2: u32 = 7;
const FRACTION_BITS: u32 = 23 - STEPS_LOG2;

static SRGB_TABLE: LazyLock<Vec<f32>> = LazyLock::new(|| {
    (0..=OCTAVES << STEPS_LOG2)
        .map(|i| f32::from_bits(SMALLEST.to_bits() + ((i as u32) << FRACTION_BITS)))
        .map(|linear| srgb_exact(f64::from(linear)) as f32)
        .collect()
});

#[inline]
fn srgb_from_linear(table: &[f32], linear: f32) -> f32 {
    if linear < SMALLEST {
        return 12.92 * linear.max(0.0);
    }
    if linear >= 1.0 {
        return 1.0;
    }
    let offset = linear.to_bits() - SMALLEST.to_bits();
    let i = (offset >> FRACTION_BITS) as usize;
    let fraction =
        (offset & ((1 << FRACTION_BITS) - 1)) as f32 * (1.0 / (1u32 << FRACTION_BITS) as f32);
    table[i] + (table[i + 1] - table[i]) * fraction
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_follows_the_formula() {
        let display = Display::default();
        for i in 0..=100_000 {
            let linear = i as f32 / 100_000.0;
            let got = f64::from(display.encode([linear; 3])[0]);
            let want = srgb_exact(f64::from(linear));
            assert!((got - want).abs() < 4e-6, "sRGB of {linear}: {got}, want {want}");
        }
    }

    #[test]
    fn out_of_range_is_clamped() {
        let display = Display::default();
        assert_eq!(display.encode([-1.0, 0.0, -0.0]), [0.0; 3]);
        assert_eq!(display.encode([1.0, 1e30, f32::MAX]), [1.0; 3]);
        assert_eq!(display.encode_rgba8([0.0, 1.0, 2.0]), [0, 255, 255, 255]);
    }

    #[test]
    fn a_stop_is_a_factor_of_two() {
        let (brighter, plain) = (Display::new(1.0), Display::default());
        assert_eq!(brighter.encode([0.1, 0.2, 0.3]), plain.encode([0.2, 0.4, 0.6]));
    }

    #[test]
    fn change_is_the_squared_distance_of_display_colours() {
        let display = Display::default();
        assert_eq!(display.change([1.0; 3], [0.0; 3]), 3.0);
        assert_eq!(display.change([0.3; 3], [0.3; 3]), 0.0);
        // White can get no whiter: a change that the display cannot show is none.
        assert_eq!(display.change([5.0; 3], [1.0; 3]), 0.0);
    }
}
