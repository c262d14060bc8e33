//! Khronos PBR Neutral, one colour at a time and eight: the same steps, and the same numbers.
//!
//! ```text
//! o = x − 6.25 x² if x < 0.08, else 0.04        x = min(R, G, B): the reflection of light that base colours do not have
//! p = max(C − o)
//! p′ = 1 − d² / (p + d − s)                     s = 0.8 − 0.04, where compression starts; d = 1 − s
//! C′ = mix((C − o) p′/p, p′, 1 − 1 / (0.15 (p − p′) + 1))
//! ```
//!
//! Khronos PBR Neutral Tone Mapper, specification 1.0 (2024), §3; C − o alone where p < s.

use super::BRIGHTEST;
use crate::wide::{F8, Unit};

const START: f32 = 0.8 - 0.04;
const D: f32 = 1.0 - START;
const DESATURATION: f32 = 0.15;
/// o, and the x from which on it is all of it.
const OFFSET: f32 = 0.04;
const WHOLE_FROM: f32 = 0.08;

/// Of a colour in 0..=[`BRIGHTEST`].
pub(super) fn neutral(rgb: [f32; 3]) -> [f32; 3] {
    let least = rgb.into_iter().fold(f32::INFINITY, f32::min);
    let offset = if least < WHOLE_FROM { least - 6.25 * least * least } else { OFFSET };
    let rgb = rgb.map(|channel| channel - offset);
    let peak = rgb.into_iter().fold(0.0, f32::max);
    if peak < START {
        return rgb;
    }
    let new_peak = 1.0 - D * D / (peak + D - START);
    let white = 1.0 - 1.0 / (DESATURATION * (peak - new_peak) + 1.0);
    let scale = new_peak / peak;
    rgb.map(|channel| {
        let scaled = channel * scale;
        scaled + (new_peak - scaled) * white
    })
}

/// Of any finite colours.
#[inline(always)]
pub(crate) fn neutral_of_eight<U: Unit>(rgb: [F8<U>; 3]) -> [F8<U>; 3] {
    let [zero, one] = [0.0, 1.0].map(F8::splat);
    let [d, start] = [D, START].map(F8::splat);
    let mut below = rgb;
    for channel in &mut below {
        *channel = channel.at_least(zero).at_most(F8::splat(BRIGHTEST));
    }
    let least = below[0].at_most(below[1]).at_most(below[2]);
    let part = least - F8::splat(6.25) * least * least;
    let offset = part.or(least.less_than(F8::splat(WHOLE_FROM)), F8::splat(OFFSET));
    for channel in &mut below {
        *channel = *channel - offset;
    }
    let peak = below[0].at_least(below[1]).at_least(below[2]).at_least(zero);
    let new_peak = one - F8::splat(D * D) / (peak + d - start);
    let white = one - one / (F8::splat(DESATURATION) * (peak - new_peak) + one);
    let scale = new_peak / peak;
    let mut compressed = below;
    for channel in &mut compressed {
        let scaled = *channel * scale;
        *channel = scaled + (new_peak - scaled) * white;
    }
    F8::all_or(below, peak.less_than(start), compressed)
}

#[cfg(test)]
mod tests {
    use super::super::ToneMap;
    use super::*;
    use crate::Rng;
    use crate::wide::{self, Task};

    struct Compare<'a>(&'a [[f32; 3]; 8]);

    impl Task for Compare<'_> {
        #[inline(always)]
        fn run<U: Unit>(self) {
            let channel = |k: usize| F8::<U>::new(std::array::from_fn(|lane| self.0[lane][k]));
            let eight = neutral_of_eight([channel(0), channel(1), channel(2)]);
            for (lane, &rgb) in self.0.iter().enumerate() {
                let got = eight.map(|channel| channel.lanes()[lane].clamp(0.0, 1.0));
                assert_eq!(got, ToneMap::Neutral.apply(rgb), "{rgb:?}");
            }
        }
    }

    #[test]
    fn eight_at_a_time_are_what_they_are_one_by_one() {
        let mut rng = Rng::new(1);
        // From far below the offset to far beyond the brightest, negative ones, too, and colours with channels alike.
        for round in 0..2000 {
            let colours = [(); 8].map(|()| {
                let any = [(); 3].map(|()| (60.0 * rng.unit_f32() - 30.0).exp2() - 0.01);
                let near_white = [(); 3].map(|()| 2.0 * rng.unit_f32());
                [any, near_white, [any[0]; 3], [near_white[0]; 3]][round % 4]
            });
            wide::run(Compare(&colours));
        }
        wide::run(Compare(&[[0.0; 3]; 8]));
        wide::run(Compare(&[[f32::MAX; 3]; 8]));
    }
}
