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
    /// In the place of a ray that is not known yet.
    pub(crate) const NONE: Ray = Ray { origin: Vec3A::ZERO, direction: Vec3A::ZERO };

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

impl Hit {
    /// Before anything is hit: every hit is before it.
    pub(crate) const NONE: Hit =
        Hit { t: f32::MAX, barycentric: [0.0; 2], primitive: u32::MAX, instance: u32::MAX };

    /// Before anything is hit that counts only if its t is less than `t_max`.
    #[inline(always)]
    pub(crate) fn none_before(t_max: f32) -> Hit {
        Hit { t: t_max.next_down(), ..Hit::NONE }
    }

    /// Whether this is found rather than `other`: the nearer, and of surfaces that coincide the first by instance and triangle, in
    /// whichever order a walk meets them.
    #[inline(always)]
    pub(crate) fn is_before(&self, other: &Hit) -> bool {
        let place = |hit: &Hit| u64::from(hit.instance) << 32 | u64::from(hit.primitive);
        self.t < other.t || (self.t == other.t && place(self) < place(other))
    }

    /// `None` if nothing was hit.
    #[inline(always)]
    pub(crate) fn found(self) -> Option<Hit> {
        (self.instance != Hit::NONE.instance).then_some(self)
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
