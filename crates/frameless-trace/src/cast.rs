//! Bare rays: what they meet, without a pixel and without shading.

use crate::moment::Moment;
use crate::ray::{Hit, Ray};
use crate::top::Targets;
use crate::traverse::Stack;
use crate::world::World;

/// Casts rays into a world at one moment. Every surface counts as there, whatever its material lets pass.
pub struct Caster<'a> {
    targets: Targets<'a>,
    stack: Stack,
}

impl World {
    /// For rays into this world at `moment`, which shows it.
    pub fn caster<'a>(&'a self, moment: &'a Moment) -> Caster<'a> {
        Caster { targets: moment.targets(self), stack: Stack::new() }
    }
}

impl Caster<'_> {
    /// The nearest hit at 0 < t < ∞.
    #[inline]
    pub fn nearest(&mut self, ray: &Ray) -> Option<Hit> {
        self.targets.closest(ray, &mut self.stack)
    }

    /// What [`Caster::nearest`] says of each ray. Faster for neighbours: from one point, in much the same direction.
    ///
    /// # Panics
    /// If there is not as much room as there are rays.
    pub fn nearest_of(&mut self, rays: &[Ray], found: &mut [Option<Hit>]) {
        assert_eq!(rays.len(), found.len(), "room for what each ray finds");
        self.targets.closest_of(rays, found, &mut self.stack);
    }

    /// Whether anything is hit at 0 < t < `t_max`.
    #[inline]
    pub fn is_blocked(&mut self, ray: &Ray, t_max: f32) -> bool {
        self.targets.occluded(ray, t_max, &mut self.stack)
    }
}
