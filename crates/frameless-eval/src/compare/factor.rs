//! How many times more samples per second somebody needs to be as good: scanned in factors of two, interpolated in between.

use crate::results::Bound;

/// The grid begins at 2⁻² = 1/4 of the rate: who needs less than that is in another class.
const LEAST_EXPONENT: i32 = -2;
/// A second of more samples takes minutes to simulate.
const MOST_SAMPLES_PER_SEC: f64 = 1e8;

/// The exponents n of the factors 2ⁿ that are scanned: from 1/4 to the largest power of two within `max_factor` and the
/// highest rate that is simulated; at least to 1.
pub(super) fn exponents(samples_per_sec: f64, max_factor: f64) -> std::ops::RangeInclusive<i32> {
    let most = max_factor.min(MOST_SAMPLES_PER_SEC / samples_per_sec);
    LEAST_EXPONENT..=(most.log2().floor() as i32).max(0)
}

/// What is known about a factor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Step {
    /// The error at 2ⁿ times the rate is needed next.
    Measure(i32),
    /// The factor, or the end of the range it lies beyond.
    Found(f64, Bound),
}

/// Looks for the factor f at which the opponent's error e(f) falls to `target`.
///
/// From f = 1 upwards while e > target, or downwards while e ≤ target, until two neighbours 2ⁿ and 2ⁿ⁺¹ have
/// e(2ⁿ) > target ≥ e(2ⁿ⁺¹); between them log e is taken as linear in log f:
///
///   log2 f = n + log(e(2ⁿ) / target) / log(e(2ⁿ) / e(2ⁿ⁺¹))
///
/// Where e is not monotonic that is the crossing nearest to 1 in that direction. Where e(2ⁿ⁺¹) is 0, which has no logarithm, the
/// factor is 2ⁿ⁺¹.
pub(super) fn next_step(
    target: f64,
    exponents: &std::ops::RangeInclusive<i32>,
    error_at: impl Fn(i32) -> Option<f64>,
) -> Step {
    let Some(at_one) = error_at(0) else { return Step::Measure(0) };
    let is_up = at_one > target;
    let (mut n, mut error) = (0, at_one);
    loop {
        let neighbour = if is_up { n + 1 } else { n - 1 };
        if !exponents.contains(&neighbour) {
            let bound = if is_up { Bound::MoreThan } else { Bound::LessThan };
            return Step::Found(f64::from(n).exp2(), bound);
        }
        let Some(there) = error_at(neighbour) else { return Step::Measure(neighbour) };
        if is_up && there <= target {
            return Step::Found(interpolated(n, error, there, target), Bound::Exact);
        }
        if !is_up && there > target {
            return Step::Found(interpolated(neighbour, there, error, target), Bound::Exact);
        }
        (n, error) = (neighbour, there);
    }
}

/// The factor between 2ⁿ, where the error is `high`, and 2ⁿ⁺¹, where it is `low`; high > target ≥ low.
fn interpolated(n: i32, high: f64, low: f64, target: f64) -> f64 {
    let part = if low == 0.0 { 1.0 } else { (high / target).ln() / (high / low).ln() };
    (f64::from(n) + part).exp2()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The whole scan against an opponent whose error is known; also how many rates were asked for.
    fn scan(target: f64, max_factor: f64, error: impl Fn(f64) -> f64) -> (f64, Bound, usize) {
        let exponents = exponents(900_000.0, max_factor);
        let mut known = std::collections::BTreeMap::new();
        loop {
            match next_step(target, &exponents, |n| known.get(&n).copied()) {
                Step::Measure(n) => {
                    assert!(exponents.contains(&n), "2^{n} is outside");
                    let before = known.insert(n, error(f64::from(n).exp2()));
                    assert!(before.is_none(), "2^{n} is asked for twice");
                }
                Step::Found(factor, bound) => return (factor, bound, known.len()),
            }
        }
    }

    #[test]
    fn a_power_law_is_found_exactly() {
        // e(f) = f^(-1/2): a target of 1/√f₀ is reached at f₀.
        for wanted in [0.3, 0.5, 0.9, 1.0, 1.1, 2.0, 3.0, 10.0, 63.0, 64.0] {
            let (factor, bound, _) = scan(1.0 / f64::sqrt(wanted), 64.0, |f| f.powf(-0.5));
            assert!((factor / wanted - 1.0).abs() < 1e-9, "{wanted}: {factor}");
            assert_eq!(bound, Bound::Exact);
        }
    }

    #[test]
    fn no_more_is_measured_than_needed() {
        let (factor, _, measured) = scan(0.6, 64.0, |f| f.powf(-0.5));
        assert!((2.0..4.0).contains(&factor));
        assert_eq!(measured, 3, "1, 2 and 4");
    }

    #[test]
    fn what_lies_outside_is_a_bound() {
        assert_eq!(scan(0.1, 64.0, |_| 0.2), (64.0, Bound::MoreThan, 7));
        assert_eq!(scan(0.2, 64.0, |_| 0.1), (0.25, Bound::LessThan, 3));
        // 900,000 · 64 is simulated, · 128 is beyond the highest rate.
        assert_eq!(scan(0.1, 4096.0, |_| 0.2), (64.0, Bound::MoreThan, 7));
        assert_eq!(scan(0.1, 3.0, |_| 0.2), (2.0, Bound::MoreThan, 2));
    }

    #[test]
    fn no_error_at_all_has_no_logarithm() {
        assert_eq!(scan(0.0, 64.0, |f| if f < 4.0 { 0.1 } else { 0.0 }), (4.0, Bound::Exact, 3));
        assert_eq!(scan(0.05, 64.0, |f| if f < 2.0 { 0.1 } else { 0.0 }).0, 2.0);
        assert_eq!(scan(0.0, 64.0, |_| 0.0).1, Bound::LessThan);
    }
}
