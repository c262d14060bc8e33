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

    /// Rounded down to what a canvas keeps of it.
    #[inline]
    pub(crate) fn as_kept(self) -> Time {
        Time(self.0 >> TICK_BITS << TICK_BITS)
    }

    /// Seconds from `earlier` to `self`; zero if `earlier` is later.
    pub fn secs_since(self, earlier: Time) -> f64 {
        self.0.saturating_sub(earlier.0) as f64 * 1e-9
    }
}

/// A time in units of 2¹⁴ ns (16 µs), modulo 2³² of them (19 hours).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Tick(pub(crate) u32);

pub(crate) const TICK_BITS: u32 = 14;
pub(crate) const TICK_SECS: f32 = (1u64 << TICK_BITS) as f32 * 1e-9;

impl Tick {
    #[inline(always)]
    pub(crate) fn of(time: Time) -> Tick {
        Tick((time.0 >> TICK_BITS) as u32)
    }

    /// The time, rounded down, of a tick that is not later than `now`.
    pub(crate) fn time(self, now: Time) -> Time {
        let ago = u64::from(Tick::of(now).0.wrapping_sub(self.0));
        Time(((now.0 >> TICK_BITS) - ago) << TICK_BITS)
    }

    #[inline(always)]
    pub(crate) fn is_later_than(self, other: Tick) -> bool {
        self.0.wrapping_sub(other.0) as i32 > 0
    }
}
