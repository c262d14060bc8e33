//! The surface that a sample belongs to: the first that its ray hit, or the image of the second in a plane mirror.

use frameless::Surface;
use glam::Vec3A;

use crate::direct::sky_surface;
use crate::images::{self, MirrorSide};
use crate::moment::Moment;
use crate::ray::{Hit, Ray};
use crate::world::World;

/// Collects it along a path.
pub(crate) struct FirstSurface {
    is_asked_for: bool,
    found: Option<Surface>,
    /// The mirror in which the next surface is seen.
    mirror: Option<MirrorSide>,
}

impl FirstSurface {
    /// Where nobody asks for surfaces, none is made.
    #[inline(always)]
    pub(crate) fn new(is_asked_for: bool) -> FirstSurface {
        FirstSurface { is_asked_for, found: None, mirror: None }
    }

    /// Told of every surface along the path, with the part of its light that reaches the eye.
    #[inline(always)]
    pub(crate) fn see(&mut self, world: &World, seen: impl FnOnce() -> Surface, throughput: Vec3A) {
        if !self.is_asked_for {
            return;
        }
        if let Some(side) = self.mirror.take() {
            let surface = seen();
            let object = world.mirrors.image_of(surface.object, side);
            self.found = Some(images::image(surface, object, throughput));
        } else {
            self.found.get_or_insert_with(seen);
        }
    }

    /// Told that the first surface mirrors what the path meets next, and does nothing else.
    #[inline]
    pub(crate) fn look_into_mirror(
        &mut self,
        world: &World,
        moment: &Moment,
        hit: &Hit,
        direction: Vec3A,
    ) {
        let geometry = world.scene().instances[hit.instance as usize].geometry;
        let placed = moment.placed(hit.instance);
        self.mirror = world.mirrors.seen(geometry, hit.instance, hit.primitive, placed, direction);
    }

    /// What was found; a path that met nothing saw the sky along its last ray.
    #[inline(always)]
    pub(crate) fn surface(&self, last: &Ray) -> Surface {
        if !self.is_asked_for {
            return Surface::default();
        }
        self.found.unwrap_or_else(|| sky_surface(last))
    }
}
