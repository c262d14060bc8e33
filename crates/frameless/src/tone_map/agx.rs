//! AgX: Sobotka's tone mapping (2022), with the curve and the primaries of Blender's configuration (Chow, AgX_LUT_Gen).

use std::sync::LazyLock;

use super::times;

/// ```text
/// C′ = O f(I C)        f(v) = c(x)^2.4,   x = (log₂(v / 0.18) + 10) / 16.5
/// ```
///
/// I leads from Rec. 709 to Rec. 2020 and mixes the channels, so that a colour that grows brighter grows paler; O undoes it, with
/// other primaries than I. Their rows add up to 1, so that grey stays grey. c is [`curve`].
pub(super) fn agx(rgb: [f32; 3]) -> [f32; 3] {
    const IN: [[f32; 3]; 3] = [
        [0.5448686, 0.3737523, 0.0813791],
        [0.1404424, 0.7541222, 0.1054354],
        [0.0888315, 0.1788853, 0.7322833],
    ];
    const OUT: [[f32; 3]; 3] = [
        [1.964_894, -0.8560079, -0.1088861],
        [-0.2993091, 1.3263919, -0.0270828],
        [-0.1643564, -0.2382074, 1.4025638],
    ];
    times(OUT, times(IN, rgb).map(transfer))
}

/// Ten stops below middle grey everything is black; 6.5 above, white.
const STOPS: [f64; 2] = [-10.0, 6.5];
const MIDDLE_GREY: f64 = 0.18;
/// The display that the curve is made for.
const DISPLAY_GAMMA: f64 = 2.4;

/// f of any number ≥ 0: a table, linear between its knots. These are the numbers whose bits end in zeros, 64 to the octave: evenly
/// spaced within each, as good as evenly in the logarithm, and found without one. Within 2e-5 of f.
fn transfer(v: f32) -> f32 {
    let bits = v.clamp(TABLE_FROM, WHITE).to_bits() - TABLE_FROM.to_bits();
    let (knot, rest) = (bits >> KNOT_BITS, bits & ((1 << KNOT_BITS) - 1));
    let [here, next] = [knot, knot + 1].map(|knot| TABLE[knot as usize]);
    here + (next - here) * (rest as f32 / (1_u32 << KNOT_BITS) as f32)
}

/// 0.18 · 2^6.5.
const WHITE: f32 = 16.291_74;
/// Below the least number that is not black, and above white.
const TABLE_FROM: f32 = 1.0 / 8192.0;
const TABLE_TO: f32 = 16.5;
/// The bits of a number after those that choose the knot: of 23 of its fraction, 6 do.
const KNOT_BITS: u32 = 17;
const KNOTS: usize = ((TABLE_TO.to_bits() - TABLE_FROM.to_bits()) >> KNOT_BITS) as usize + 2;

static TABLE: LazyLock<[f32; KNOTS]> = LazyLock::new(|| {
    std::array::from_fn(|knot| {
        let v = f32::from_bits(TABLE_FROM.to_bits() + ((knot as u32) << KNOT_BITS));
        exact(f64::from(v)) as f32
    })
});

/// f, from its formula; it goes on beyond white, so that the table has no corner there.
fn exact(v: f64) -> f64 {
    let stops = (v / MIDDLE_GREY).log2().max(STOPS[0]);
    let x = (stops - STOPS[0]) / (STOPS[1] - STOPS[0]);
    // At its begin the curve may be off by a rounding error.
    curve(x).max(0.0).powf(DISPLAY_GAMMA)
}

/// ```text
/// c(x) = y₀ + s h(m (x − x₀) / s)        h(u) = u / (1 + |u|^1.5)^(1/1.5)
/// ```
///
/// An S from (0, 0) to (1, 1) with slope m = 2.4 at middle grey, (x₀, y₀); s, another one on either side, makes it end where it has to:
/// s = ((y₁ − y₀)^(−p) − (m (x₁ − x₀))^(−p))^(−1/p) for the end (x₁, y₁), p = 1.5.
fn curve(x: f64) -> f64 {
    const SLOPE: f64 = 2.4;
    const POWER: f64 = 1.5;
    let x0 = -STOPS[0] / (STOPS[1] - STOPS[0]);
    let y0 = MIDDLE_GREY.powf(1.0 / DISPLAY_GAMMA);
    let end = if x < x0 { 0.0 } else { 1.0 };
    let (rise, run) = ((end - y0).abs(), SLOPE * (end - x0).abs());
    let s = (rise.powf(-POWER) - run.powf(-POWER)).powf(-1.0 / POWER);
    let u = SLOPE * (x - x0) / s;
    y0 + s * u / (1.0 + u.abs().powf(POWER)).powf(1.0 / POWER)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_curve_begins_and_ends_and_turns_where_it_should() {
        for (x, want) in [(0.0, 0.0), (1.0, 1.0), (10.0 / 16.5, 0.18_f64.powf(1.0 / 2.4))] {
            assert!((curve(x) - want).abs() < 1e-12, "c({x}) = {}", curve(x));
        }
        let turn = 10.0 / 16.5;
        for side in [-1e-5, 1e-5] {
            let slope = (curve(turn + side) - curve(turn)) / side;
            assert!((slope - 2.4).abs() < 1e-2, "{slope}");
        }
    }

    #[test]
    fn the_table_follows_the_formula() {
        for step in 0..=20_000 {
            let v = (f64::from(step) / 1000.0 - 14.0).exp2();
            let (got, want) = (f64::from(transfer(v as f32)), exact(v.min(f64::from(WHITE))));
            assert!((got - want).abs() < 2e-5, "f({v}) = {want}, table {got}");
        }
        assert_eq!(transfer(0.0), 0.0);
    }

    /// Both matrices leave grey what it is, and together a dark colour nearly so.
    #[test]
    fn a_saturated_light_turns_pale_as_it_grows_brighter() {
        let saturation = |level: f32| {
            let [r, g, b] = agx([level, 0.1 * level, 0.1 * level]);
            (r - g.min(b)) / r
        };
        assert!(saturation(0.2) > saturation(2.0) && saturation(2.0) > saturation(20.0));
        let [r, g, b] = agx([4.0; 3]);
        assert!((r - g).abs() < 1e-5 && (r - b).abs() < 1e-5);
    }
}
