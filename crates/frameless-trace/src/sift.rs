//! Walks where triangles may have holes: whoever sends the ray is asked about every hit on them.

use crate::ray::{Hit, Ray};
use crate::top::{Placed, Targets};
use crate::traverse::Stack;

/// Is asked about hits, in any order, on instances that have holes.
pub(crate) trait Sieve {
    /// Whether it wants to be asked about all other meshes, too.
    fn is_for_all(&self) -> bool;

    /// Whether the hit is one.
    fn stops(&mut self, hit: &Hit) -> bool;
}

/// Whether hits are hits, as a walk asks.
pub(crate) trait Stops {
    /// Whether hits on this instance have to be asked about one by one.
    fn asks(&self, placed: &Placed) -> bool;

    /// Whether the hit is one, on an instance that has to be asked about.
    fn stops(&mut self, hit: &Hit) -> bool;
}

/// All hits are; compiled, nothing is left of it.
pub(crate) struct NoSieve;

impl Stops for NoSieve {
    #[inline(always)]
    fn asks(&self, _placed: &Placed) -> bool {
        false
    }

    #[inline(always)]
    fn stops(&mut self, _hit: &Hit) -> bool {
        true
    }
}

struct Asks<'s> {
    sieve: &'s mut dyn Sieve,
    is_for_all: bool,
}

impl Stops for Asks<'_> {
    #[inline(always)]
    fn asks(&self, placed: &Placed) -> bool {
        self.is_for_all || placed.has_holes
    }

    fn stops(&mut self, hit: &Hit) -> bool {
        self.sieve.stops(hit)
    }
}

impl Targets<'_> {
    /// The nearest hit at 0 < t < ∞ that `sieve` stops.
    pub(crate) fn closest_through(
        &self,
        ray: &Ray,
        sieve: &mut dyn Sieve,
        stack: &mut Stack,
    ) -> Option<Hit> {
        let is_for_all = sieve.is_for_all();
        self.find::<false, _>(ray, Hit::NONE, Asks { sieve, is_for_all }, stack)
    }

    /// Whether anything is hit at 0 < t < t_max that `sieve` stops.
    pub(crate) fn occluded_through(
        &self,
        ray: &Ray,
        t_max: f32,
        sieve: &mut dyn Sieve,
        stack: &mut Stack,
    ) -> bool {
        let is_for_all = sieve.is_for_all();
        let none = Hit::none_before(t_max);
        self.find::<true, _>(ray, none, Asks { sieve, is_for_all }, stack).is_some()
    }
}
