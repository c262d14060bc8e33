//! A rough interface of tiny mirrors (Trowbridge and Reitz 1975, "GGX"; Smith's shadowing).
//!
//! ```text
//! D = α² / (π ((n·h)² (α² − 1) + 1)²)        V = G₂ / (4 (n·ωₒ)(n·ωᵢ)), height-correlated (Heitz 2014)
//! G₁ = 2 c / (c + √(α² + (1 − α²) c²))       c = n·ω
//! ```

use std::f32::consts::{PI, TAU};

use glam::{Mat3A, Vec3A};

/// Below this α a highlight is narrower than single precision can tell.
const SMOOTHEST: f32 = 1e-3;
/// So that a direction along the surface is not divided by zero.
pub(super) const GRAZING: f32 = 1e-4;

/// An interface, seen from one direction.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ggx {
    /// World from its own frame, whose z axis is its normal.
    pub(super) frame: Mat3A,
    /// To where light is seen from, in its frame; z > 0.
    pub(super) to_eye: Vec3A,
    /// 0: a mirror.
    pub(super) alpha: f32,
}

impl Ggx {
    /// `normal`, `to_eye`: unit length, world coordinates.
    pub(super) fn new(normal: Vec3A, to_eye: Vec3A, roughness: f32) -> Ggx {
        let (x, y) = normal.any_orthonormal_pair();
        let frame = Mat3A::from_cols(x, y, normal);
        let mut to_eye = frame.transpose() * to_eye;
        to_eye.z = to_eye.z.max(GRAZING);
        let alpha = (roughness * roughness).clamp(0.0, 1.0);
        let alpha = if alpha < SMOOTHEST { 0.0 } else { alpha };
        Ggx { frame, to_eye: to_eye.normalize(), alpha }
    }

    /// Into its frame.
    pub(super) fn local(&self, direction: Vec3A) -> Vec3A {
        self.frame.transpose() * direction
    }

    /// D V; 0 of a mirror, which reflects no light but from one direction.
    pub(super) fn value(&self, to_light: Vec3A) -> f32 {
        if self.alpha == 0.0 || to_light.z <= 0.0 {
            return 0.0;
        }
        self.towards(to_light, self.half(to_light)).0
    }

    /// With which [`Ggx::sample`] finds a direction, per solid angle: D G₁(ωₒ) (ωₒ·h) / (n·ωₒ) for the normal, 1 / 4(ωₒ·h) for the
    /// reflection about it.
    pub(super) fn density(&self, to_light: Vec3A) -> f32 {
        if self.alpha == 0.0 || to_light.z <= 0.0 {
            return 0.0;
        }
        self.towards(to_light, self.half(to_light)).1
    }

    /// Both, of an interface that is no mirror, for a direction on the side of the eye; `half`: the normal between the two.
    #[inline]
    pub(super) fn towards(&self, to_light: Vec3A, half: Vec3A) -> (f32, f32) {
        let normals = distribution(half.z, self.alpha);
        let density = normals * masking(self.to_eye.z, self.alpha) / (4.0 * self.to_eye.z);
        (normals * visibility(to_light.z, self.to_eye.z, self.alpha), density)
    }

    /// The normal between two directions.
    pub(super) fn half(&self, to_light: Vec3A) -> Vec3A {
        (self.to_eye + to_light).normalize_or(Vec3A::Z)
    }

    /// One of the normals that are seen, by the area that they show (Dupuy and Benyoub 2023, "Sampling Visible GGX Normals with Spherical
    /// Caps").
    pub(super) fn visible_normal(&self, [u, v]: [f32; 2]) -> Vec3A {
        if self.alpha == 0.0 {
            return Vec3A::Z;
        }
        let stretch = Vec3A::new(self.alpha, self.alpha, 1.0);
        let standing = (self.to_eye * stretch).normalize();
        let z = (1.0 - v) * (1.0 + standing.z) - standing.z;
        let sin = (1.0 - z * z).max(0.0).sqrt();
        let (sin_phi, cos_phi) = (TAU * u).sin_cos();
        let half = Vec3A::new(sin * cos_phi, sin * sin_phi, z) + standing;
        (half * stretch).normalize_or(Vec3A::Z)
    }

    /// The direction that a normal reflects to the eye.
    pub(super) fn sample(&self, numbers: [f32; 2]) -> Vec3A {
        let normal = self.visible_normal(numbers);
        2.0 * self.to_eye.dot(normal) * normal - self.to_eye
    }

    /// G₂ / G₁(ωₒ) for a direction on either side: the part of what passes a visible normal that is not lost between the facets.
    pub(super) fn left_over(&self, cos: f32) -> f32 {
        if self.alpha == 0.0 {
            return 1.0;
        }
        let both = visibility(cos, self.to_eye.z, self.alpha) * 4.0 * cos * self.to_eye.z;
        both / masking(self.to_eye.z, self.alpha)
    }
}

fn distribution(cos: f32, alpha: f32) -> f32 {
    let a2 = alpha * alpha;
    let d = cos * cos * (a2 - 1.0) + 1.0;
    a2 / (PI * d * d)
}

fn visibility(to_light: f32, to_eye: f32, alpha: f32) -> f32 {
    let a2 = alpha * alpha;
    let length = |cos: f32| (cos * cos * (1.0 - a2) + a2).sqrt();
    0.5 / (to_light * length(to_eye) + to_eye * length(to_light))
}

fn masking(cos: f32, alpha: f32) -> f32 {
    let a2 = alpha * alpha;
    2.0 * cos / (cos + (cos * cos * (1.0 - a2) + a2).sqrt())
}
