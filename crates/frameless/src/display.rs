//! From linear radiance to what the display shows: exposure, tone mapping, then the sRGB transfer function.
//!
//! Samples are kept as linear radiance; this step comes after reconstruction, so that changing the exposure
//! restarts nothing. Change is measured behind it, since that is what an eye sees.

use std::hint::select_unpredictable;

use crate::tone_map::{ToneMap, neutral_of_eight};
use crate::wide::{self, F8, Task, Unit};

/// How linear radiance becomes a display colour.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Display {
    exposure_stops: f32,
    gain: f32,
    tone_map: ToneMap,
}

impl Default for Display {
    fn default() -> Self {
        Display::new(0.0)
    }
}

impl Display {
    /// Radiance is multiplied by 2^`exposure_stops`, and what is brighter than white is white: errors are measured without tone mapping.
    pub fn new(exposure_stops: f32) -> Display {
        Display { exposure_stops, gain: exposure_stops.exp2(), tone_map: ToneMap::None }
    }

    /// The same with a tone mapping.
    pub fn with_tone_map(self, tone_map: ToneMap) -> Display {
        Display { tone_map, ..self }
    }

    /// The exposure in stops (powers of two).
    pub fn exposure_stops(&self) -> f32 {
        self.exposure_stops
    }

    /// How what is brighter than white is brought into range.
    pub fn tone_map(&self) -> ToneMap {
        self.tone_map
    }

    /// Display-referred sRGB in [0, 1] of a finite linear RGB radiance.
    #[inline(always)]
    pub fn encode(&self, rgb: [f32; 3]) -> [f32; 3] {
        match self.tone_map {
            ToneMap::None => srgb_from_linear_rgb(rgb.map(|channel| channel * self.gain)),
            _ => self.encode_mapped(rgb),
        }
    }

    /// [`Display::encode`], eight at a time.
    #[inline(always)]
    pub(crate) fn encode_eight<U: Unit>(&self, rgb: [F8<U>; 3]) -> [F8<U>; 3] {
        let mut exposed = rgb;
        for channel in &mut exposed {
            *channel = *channel * F8::splat(self.gain);
        }
        let [r, g, b] = match self.tone_map {
            ToneMap::None => exposed,
            ToneMap::Neutral => neutral_of_eight(exposed),
            ToneMap::Agx | ToneMap::Aces => {
                let mut mapped = F8::triples(exposed);
                mapped.iter_mut().for_each(|rgb| *rgb = self.tone_map.apply(*rgb));
                let channel = |k: usize| F8::new(std::array::from_fn(|lane| mapped[lane][k]));
                [channel(0), channel(1), channel(2)]
            }
        };
        [srgb_from_eight_linear(r), srgb_from_eight_linear(g), srgb_from_eight_linear(b)]
    }

    /// Apart, so that loops that map no tones stay small.
    #[inline(never)]
    fn encode_mapped(&self, rgb: [f32; 3]) -> [f32; 3] {
        srgb_from_linear_rgb(self.tone_map.apply(rgb.map(|channel| channel * self.gain)))
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
        let [r, g, b] = std::array::from_fn(|k| squared(new[k] - old[k]));
        r + g + b
    }

    /// [`Display::change`] of many pairs, put behind `changes`.
    pub(crate) fn changes(&self, new: &[[f32; 3]], old: &[[f32; 3]], changes: &mut Vec<f32>) {
        wide::run(Changes { display: self, new, old, changes });
    }
}

/// See [`Display::changes`].
struct Changes<'a> {
    display: &'a Display,
    new: &'a [[f32; 3]],
    old: &'a [[f32; 3]],
    changes: &'a mut Vec<f32>,
}

impl Task for Changes<'_> {
    #[inline(always)]
    fn run<U: Unit>(self) {
        let Changes { display, new, old, changes } = self;
        let ((new, new_rest), (old, old_rest)) = (new.as_chunks(), old.as_chunks());
        for (new, old) in new.iter().zip(old) {
            changes.extend_from_slice(&display.eight_changes::<U>(new, old));
        }
        for (&new, &old) in new_rest.iter().zip(old_rest) {
            changes.push(display.change(new, old));
        }
    }
}

impl Display {
    #[inline(always)]
    fn eight_changes<U: Unit>(&self, new: &[[f32; 3]; 8], old: &[[f32; 3]; 8]) -> [f32; 8] {
        let [new, old] = [F8::<U>::of_triples(new), F8::of_triples(old)];
        let (new, old) = (self.encode_eight(new), self.encode_eight(old));
        let mut sum = F8::splat(0.0);
        for k in 0..3 {
            let difference = new[k] - old[k];
            sum = sum + difference * difference;
        }
        sum.lanes()
    }
}

#[inline(always)]
fn squared(difference: f32) -> f32 {
    difference * difference
}

/// The sRGB transfer function (IEC 61966-2-1) of a finite number, clamped to [0, 1]; at most 4e-5 from the exact one, a
/// hundredth of an 8-bit step.
///
/// The power x^(1/2.4) is a sum of roots, fitted to the smallest maximum error on [0.0031308, 1]: square roots are
/// rounded alike on every machine, and vector instructions exist for them.
#[inline(always)]
fn srgb_from_linear(linear: f32) -> f32 {
    let x = linear.clamp(0.0, 1.0);
    let (root2, root4) = (x.sqrt(), x.sqrt().sqrt());
    let power = 1.122_677_6 * root2 + 0.196_137_15 * root4 - 0.335_496_38 * (root2 * root4)
        + 0.081_327_64 * x
        - 0.064_611_68;
    let line = 12.92 * x;
    // Both, and no branch: it would keep the channels from being worked on at once.
    select_unpredictable(x <= 0.003_130_8, line, power.min(1.0))
}

/// The same, eight at a time.
#[inline(always)]
fn srgb_from_eight_linear<U: Unit>(linear: F8<U>) -> F8<U> {
    let x = linear.clamped();
    let root2 = x.sqrt();
    let root4 = root2.sqrt();
    let power = F8::splat(1.122_677_6) * root2 + F8::splat(0.196_137_15) * root4
        - F8::splat(0.335_496_38) * (root2 * root4)
        + F8::splat(0.081_327_64) * x
        - F8::splat(0.064_611_68);
    let one = F8::splat(1.0);
    let power = one.or(one.less_than(power), power);
    power.or(F8::splat(0.003_130_8).less_than(x), F8::splat(12.92) * x)
}

/// The same of three. Four at once are one vector's work; three by themselves take three times as long.
#[inline(always)]
fn srgb_from_linear_rgb([r, g, b]: [f32; 3]) -> [f32; 3] {
    let mut lanes = [r, g, b, 0.0];
    lanes.iter_mut().for_each(|lane| *lane = srgb_from_linear(*lane));
    [lanes[0], lanes[1], lanes[2]]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn srgb_exact(linear: f64) -> f64 {
        if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
    }

    #[test]
    fn the_roots_follow_the_formula() {
        let display = Display::default();
        for i in 0..=100_000 {
            let linear = i as f32 / 100_000.0;
            let got = f64::from(display.encode([linear; 3])[0]);
            let want = srgb_exact(f64::from(linear));
            assert!((got - want).abs() < 4e-5, "sRGB of {linear}: {got}, want {want}");
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
    fn many_changes_are_the_changes_one_by_one() {
        let mut rng = crate::Rng::new(1);
        let mut colours = || -> Vec<[f32; 3]> {
            (0..101).map(|_| std::array::from_fn(|_| 1.2 * rng.unit_f32() - 0.1)).collect()
        };
        let (new, old) = (colours(), colours());
        for tone_map in ToneMap::ALL {
            let display = Display::new(0.5).with_tone_map(tone_map);
            let mut many = Vec::new();
            display.changes(&new, &old, &mut many);
            let single = new.iter().zip(&old).map(|(&new, &old)| display.change(new, old));
            assert_eq!(many, single.collect::<Vec<_>>());
        }
    }

    #[test]
    fn highlights_that_are_clipped_can_be_told_apart_where_tones_are_mapped() {
        for tone_map in ToneMap::ALL {
            let display = Display::default().with_tone_map(tone_map);
            let clips = tone_map == ToneMap::None;
            assert_eq!(display.change([3.0; 3], [1.5; 3]) == 0.0, clips, "{tone_map:?}");
            assert_eq!(display.encode([0.0; 3]), [0.0; 3]);
        }
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
