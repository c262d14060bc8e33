//! Single-sided surfaces face to face, close to each other: who looks through the back of one sees the other.
//!
//! Viewers that rasterise light what is seen there as if nothing were before it. To us the one that is passed is a surface, and next to no
//! light would come in between the two. They count as one sheet instead: what is seen lies on the back through which it is seen, so that
//! rays to light, mirrored and scattered ones begin there. Where they are farther apart, as walls of a room that is looked into from
//! outside are, both stay what they are and where they are.

use crate::direct::Probe;
use crate::holes::{Chance, has_no_back};
use crate::moment::Moment;
use crate::point::Point;
use crate::ray::Ray;
use crate::texture::Cone;
use crate::traverse::Stack;
use crate::world::World;

/// How far apart they are at most, of the diagonal of the passed one's box: to the middle of a square no more than a fortieth of the light
/// comes in from its sides then.
const CLOSE: f32 = 1.0 / 16.0;
/// Cosine between their normals: a wall and the floor that it stands on are no sheet.
const PARALLEL: f32 = 0.9;

impl World {
    /// Lifts a point onto the back through which a camera's ray has met it, if they are one sheet. What lets light pass stays where it is.
    #[cold]
    pub(crate) fn lift_onto_back(
        &self,
        moment: &Moment,
        (ray, cone): (&Ray, Cone),
        point: &mut Point,
        stack: &mut Stack,
        probe: &mut impl Probe,
    ) {
        let is_clear = point.matter.layers.as_ref().is_some_and(|layers| layers.transmission > 0.0);
        if point.matter.alpha < 1.0 || is_clear {
            return;
        }
        let back = Ray { origin: point.outside, direction: -ray.direction };
        let Some(hit) = self.nearest(moment, &back, || Chance::Never, stack) else { return };
        let passed = Point::new(self, moment, &back, &hit, cone);
        let normal = point.geometric_normal;
        let is_parallel = -normal.dot(passed.geometric_normal) >= PARALLEL;
        let apart_m = normal.dot(passed.position - point.position);
        let is_sheet = passed.is_front
            && has_no_back(self, &hit)
            && is_parallel
            && apart_m <= CLOSE * self.diagonal_m(moment, hit.instance);
        if is_sheet {
            probe.note(|| {
                format!("  lies on the back through which it is seen, {apart_m:.5} m before it")
            });
            let lifted = passed.inside();
            (point.outside, point.shadow_origin) = (lifted, lifted);
        }
    }

    /// Of the box around an instance's shape at rest.
    fn diagonal_m(&self, moment: &Moment, instance: u32) -> f32 {
        let geometry = self.scene().instances[instance as usize].geometry as usize;
        let place = &moment.placed(instance).world_from_object;
        self.boxes[geometry].map_or(0.0, |bounds| 2.0 * bounds.transformed(place).radius())
    }
}
