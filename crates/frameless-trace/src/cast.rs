//! Bare rays: what they meet, without a pixel and without shading.

use crate::many::WAVE;
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

    /// What [`Caster::nearest`] says of each ray. Faster: many are under way at once, and neighbours from one point, in much the same direction,
    /// are walked together where it is worth it.
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

    /// What [`Caster::is_blocked`] says of each ray. Faster: many are under way at once.
    ///
    /// # Panics
    /// If there is not as much room as there are rays.
    pub fn is_blocked_of(&mut self, rays: &[Ray], t_max: f32, blocked: &mut [bool]) {
        assert_eq!(rays.len(), blocked.len(), "room for what each ray finds");
        let Caster { targets, stack } = self;
        let rest = Targets { standing: None, ..*targets };
        for (rays, blocked) in rays.chunks(WAVE).zip(blocked.chunks_mut(WAVE)) {
            let known = targets.occluded_of((rays, t_max), |_| false, stack);
            for (index, (ray, blocked)) in rays.iter().zip(blocked).enumerate() {
                let has = |rays: u64| rays >> index & 1 != 0;
                *blocked = match (has(known.blocked), has(known.passed)) {
                    (true, _) => true,
                    (_, true) => !has(known.is_all) && rest.occluded(ray, t_max, stack),
                    _ => targets.occluded(ray, t_max, stack),
                };
            }
        }
    }
}
