//! How radiance beyond what a display can show is brought into its range: between exposure and the sRGB transfer function.
//!
//! All take linear Rec. 709 RGB ≥ 0, exposed, and give linear Rec. 709 RGB in [0, 1]. Black stays black, and a brighter grey is never darker.

mod agx;
mod neutral;

use agx::agx;
use neutral::neutral;
pub(crate) use neutral::neutral_of_eight;

/// A tone mapping.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ToneMap {
    /// Khronos PBR Neutral: base colours as they are up to 0.76, highlights compressed and desaturated.
    #[default]
    Neutral,
    /// AgX by Sobotka, as Blender has it: bright colours turn pale before they turn white, as on film.
    Agx,
    /// The ACES reference rendering and sRGB output transforms, as fitted by Hill: the contrast of film.
    Aces,
    /// What is brighter than white is white, channel by channel: colours as they are, and hard edges around what is too bright.
    None,
}

impl ToneMap {
    /// All of them.
    pub const ALL: [ToneMap; 4] = [ToneMap::Neutral, ToneMap::Agx, ToneMap::Aces, ToneMap::None];

    /// As on the command line and in messages.
    pub fn name(self) -> &'static str {
        match self {
            ToneMap::Neutral => "neutral",
            ToneMap::Agx => "agx",
            ToneMap::Aces => "aces",
            ToneMap::None => "none",
        }
    }

    /// The one with that name.
    pub fn from_name(name: &str) -> Option<ToneMap> {
        ToneMap::ALL.into_iter().find(|known| known.name() == name)
    }

    /// What it does, in a sentence.
    pub fn explanation(self) -> &'static str {
        match self {
            ToneMap::Neutral => "Khronos PBR Neutral: colours as they are, highlights compressed",
            ToneMap::Agx => "AgX, as in Blender: bright colours turn pale, as on film",
            ToneMap::Aces => "ACES, fitted by Hill: the contrast of film",
            ToneMap::None => "what is brighter than white is white",
        }
    }

    /// Any finite linear colour to one in [0, 1].
    #[inline]
    pub(crate) fn apply(self, rgb: [f32; 3]) -> [f32; 3] {
        let rgb = rgb.map(|channel| channel.clamp(0.0, BRIGHTEST));
        match self {
            ToneMap::Neutral => neutral(rgb),
            ToneMap::Agx => agx(rgb),
            ToneMap::Aces => aces(rgb),
            ToneMap::None => rgb,
        }
        .map(|channel| channel.clamp(0.0, 1.0))
    }
}

/// Beyond that every curve has reached its end, and squares would overflow.
const BRIGHTEST: f32 = 1e6;

/// ```text
/// C′ = O f(I C)        f(v) = (v (v + 0.0245786) − 0.000090537) / (v (0.983729 v + 0.4329510) + 0.238081)
/// ```
///
/// Stephen Hill's fit of ACES' RRT and ODT for sRGB displays (2015), in MJP's BakingLab, `ACES.hlsl`. I leads from Rec. 709 into the
/// space where the curve is applied, O out of it.
fn aces(rgb: [f32; 3]) -> [f32; 3] {
    const IN: [[f32; 3]; 3] =
        [[0.59719, 0.35458, 0.04823], [0.07600, 0.90834, 0.01566], [0.02840, 0.13383, 0.83777]];
    const OUT: [[f32; 3]; 3] = [
        [1.60475, -0.53108, -0.07367],
        [-0.10208, 1.10813, -0.00605],
        [-0.00327, -0.07276, 1.07602],
    ];
    let curve =
        |v: f32| (v * (v + 0.0245786) - 0.000090537) / (v * (0.983729 * v + 0.432_951) + 0.238081);
    times(OUT, times(IN, rgb).map(curve))
}

/// The product of a matrix, by rows, and a column.
fn times(matrix: [[f32; 3]; 3], v: [f32; 3]) -> [f32; 3] {
    matrix.map(|row| row[0] * v[0] + row[1] * v[1] + row[2] * v[2])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn greys() -> impl Iterator<Item = f32> {
        // 2^-20 to 2^20.
        (0..=4000).map(|i| ((i - 2000) as f32 / 100.0).exp2())
    }

    #[test]
    fn black_stays_black_and_brighter_is_never_darker() {
        for map in ToneMap::ALL {
            assert_eq!(map.apply([0.0; 3]), [0.0; 3], "{map:?}");
            let mut before = 0.0;
            for level in greys() {
                let [r, g, b] = map.apply([level; 3]);
                assert!((0.0..=1.0).contains(&r), "{map:?} of {level}: {r}");
                assert!((r - g).abs() < 2e-4 && (r - b).abs() < 2e-4, "{map:?}: grey stays grey");
                assert!(r >= before - 1e-6, "{map:?} of {level}: {r} after {before}");
                before = r;
            }
            assert!(before > 0.98, "{map:?}: {before} is not white");
        }
    }

    #[test]
    fn every_colour_comes_into_range() {
        let mut rng = crate::Rng::new(1);
        for map in ToneMap::ALL {
            for _ in 0..10_000 {
                let rgb = [0; 3].map(|_| (60.0 * rng.unit_f32() - 30.0).exp2() - 0.01);
                let mapped = map.apply(rgb);
                assert!(
                    mapped.iter().all(|channel| (0.0..=1.0).contains(channel)),
                    "{rgb:?} {mapped:?}"
                );
            }
            assert_eq!(map.apply([f32::MAX; 3]), map.apply([BRIGHTEST; 3]));
            assert_eq!(map.apply([-1.0; 3]), [0.0; 3]);
        }
    }

    /// What the specifications say of themselves.
    #[test]
    fn known_points_are_met() {
        // Neutral gives back a base colour that is lit by its own reflection of 4 %.
        let [r, g, b] = ToneMap::Neutral.apply([0.54, 0.34, 0.14]);
        for (got, want) in [(r, 0.5), (g, 0.3), (b, 0.1)] {
            assert!((got - want).abs() < 1e-6, "{got}, want {want}");
        }
        // ... and compresses without a step where it begins to.
        let [below, above] = [0.7999, 0.8001].map(|level| ToneMap::Neutral.apply([level; 3])[0]);
        assert!(above - below < 3e-4, "{below} {above}");
        // AgX leaves middle grey where it is: its curve turns there.
        let middle = ToneMap::Agx.apply([0.18; 3])[0];
        assert!((middle - 0.18).abs() < 1e-3, "{middle}");
        // f(1) = 0.6163 for a grey: both matrices leave grey what it is.
        let white = ToneMap::Aces.apply([1.0; 3])[0];
        assert!((white - 0.6193).abs() < 5e-3, "{white}");
    }

    #[test]
    fn names_are_found_again() {
        for map in ToneMap::ALL {
            assert_eq!(ToneMap::from_name(map.name()), Some(map));
        }
        assert_eq!(ToneMap::from_name("None"), None);
    }
}
