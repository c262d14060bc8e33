//! Rays and what they hit.

use glam::{Affine3A, Vec3A};

/// The half line `origin + t · direction`, 0 < t.
///
/// The direction need not have unit length: a ray taken into an instance's space keeps its t.
#[derive(Clone, Copy, Debug)]
pub struct Ray {
    /// Where it begins.
    pub origin: Vec3A,
    /// Where it goes.
    pub direction: Vec3A,
}

impl Ray {
    /// Whether traversal may be begun: all numbers finite and a direction to go.
    #[inline(always)]
    pub(crate) fn is_traceable(&self) -> bool {
        // Below this length reciprocals overflow and products in the triangle test underflow.
        const SHORTEST: f32 = 1e-15;
        self.origin.is_finite()
            && self.direction.is_finite()
            && self.direction.abs().max_element() > SHORTEST
    }

    #[inline(always)]
    pub(crate) fn transformed(&self, to_from_here: &Affine3A) -> Ray {
        Ray {
            origin: to_from_here.transform_point3a(self.origin),
            direction: to_from_here.transform_vector3a(self.direction),
        }
    }
}

/// The nearest intersection of a ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Along the ray, in multiples of its direction.
    pub t: f32,
    /// Barycentric weights of the triangle's second and third vertex; 0 on spheres.
    pub barycentric: [f32; 2],
    /// Triangle; 0 on spheres.
    pub primitive: u32,
    /// Index into the scene's instances.
    pub instance: u32,
}
