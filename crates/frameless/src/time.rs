//! A point in time, as a whole number of nanoseconds.
//!
//! Integers make sums of ages exact: a tile's sum updated ten million times equals the sum from scratch.

/// Nanoseconds since the run began. Wraps after 584 years.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Time(pub u64);

impl Time {
    /// The beginning of the run; also the time of pixels that have never been traced.
    pub const ZERO: Time = Time(0);

    /// Rounds to the nearest nanosecond; negative and NaN become zero.
    pub fn from_secs(secs: f64) -> Time {
        Time((secs * 1e9).round() as u64)
    }

    /// This time in seconds.
    pub fn secs(self) -> f64 {
        self.0 as f64 * 1e-9
    }

    /// Seconds from `earlier` to `self`; zero if `earlier` is later.
    pub fn secs_since(self, earlier: Time) -> f64 {
        self.0.saturating_sub(earlier.0) as f64 * 1e-9
    }
}
