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

/// An interface, seen from one direction. Directions are the world's; a frame is made where one is drawn.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ggx {
    pub(super) normal: Vec3A,
    /// To where light is seen from, above the surface.
    pub(super) to_eye: Vec3A,
    /// n·ωₒ, positive.
    pub(super) cos: f32,
    /// 0: a mirror.
    pub(super) alpha: f32,
}

impl Ggx {
    /// `normal`, `to_eye`: unit length.
    #[inline(always)]
    pub(super) fn new(normal: Vec3A, to_eye: Vec3A, roughness: f32) -> Ggx {
        let alpha = (roughness * roughness).clamp(0.0, 1.0);
        let alpha = if alpha < SMOOTHEST { 0.0 } else { alpha };
        let cos = normal.dot(to_eye);
        match cos >= GRAZING {
            true => Ggx { normal, to_eye, cos, alpha },
            false => Ggx::grazing(normal, to_eye, alpha),
        }
    }

    #[cold]
    fn grazing(normal: Vec3A, to_eye: Vec3A, alpha: f32) -> Ggx {
        let along = to_eye - normal.dot(to_eye) * normal;
        let to_eye = (along + GRAZING * normal).normalize_or(normal);
        Ggx { normal, to_eye, cos: normal.dot(to_eye).max(GRAZING), alpha }
    }

    /// D V; 0 of a mirror, which reflects no light but from one direction.
    pub(super) fn value(&self, to_light: Vec3A) -> f32 {
        let i = self.normal.dot(to_light);
        if self.alpha == 0.0 || i <= 0.0 {
            return 0.0;
        }
        self.towards(i, self.half(to_light)).0
    }

    /// With which [`Ggx::sample`] finds a direction, per solid angle: D G₁(ωₒ) (ωₒ·h) / (n·ωₒ) for the normal, 1 / 4(ωₒ·h) for the
    /// reflection about it.
    pub(super) fn density(&self, to_light: Vec3A) -> f32 {
        let i = self.normal.dot(to_light);
        if self.alpha == 0.0 || i <= 0.0 {
            return 0.0;
        }
        self.towards(i, self.half(to_light)).1
    }

    /// Both, of an interface that is no mirror, for a direction on the side of the eye with i = n·ωᵢ; `half`: the normal between the two.
    #[inline(always)]
    pub(super) fn towards(&self, i: f32, half: Vec3A) -> (f32, f32) {
        let normals = distribution(self.normal.dot(half), self.alpha);
        let density = normals * masking(self.cos, self.alpha) / (4.0 * self.cos);
        (normals * visibility(i, self.cos, self.alpha), density)
    }

    /// The normal between two directions.
    #[inline(always)]
    pub(super) fn half(&self, to_light: Vec3A) -> Vec3A {
        (self.to_eye + to_light).normalize_or(self.normal)
    }

    /// One of the normals that are seen, by the area that they show (Dupuy and Benyoub 2023, "Sampling Visible GGX Normals with Spherical
    /// Caps").
    pub(super) fn visible_normal(&self, [u, v]: [f32; 2]) -> Vec3A {
        if self.alpha == 0.0 {
            return self.normal;
        }
        let frame = frame(self.normal);
        let stretch = Vec3A::new(self.alpha, self.alpha, 1.0);
        let standing = ((frame.transpose() * self.to_eye) * stretch).normalize();
        let z = (1.0 - v) * (1.0 + standing.z) - standing.z;
        let sin = (1.0 - z * z).max(0.0).sqrt();
        let [sin_phi, cos_phi] = sin_cos_turns(u);
        let half = Vec3A::new(sin * cos_phi, sin * sin_phi, z) + standing;
        frame * (half * stretch).normalize_or(Vec3A::Z)
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
        let both = visibility(cos, self.cos, self.alpha) * 4.0 * cos * self.cos;
        both / masking(self.cos, self.alpha)
    }
}

/// World from coordinates whose z axis is `normal`.
#[inline(always)]
pub(super) fn frame(normal: Vec3A) -> Mat3A {
    let (x, y) = normal.any_orthonormal_pair();
    Mat3A::from_cols(x, y, normal)
}

/// Sine and cosine of 2π `turns`, for `turns` in [0, 1], off by less than 2e-7: Taylor's series within an eighth of a turn of the next quarter.
#[inline(always)]
pub(super) fn sin_cos_turns(turns: f32) -> [f32; 2] {
    let quarter = (4.0 * turns + 0.5) as i32;
    let x = (4.0 * turns - quarter as f32) * (0.25 * TAU);
    let x2 = x * x;
    let sin = x
        * (1.0
            + x2 * (-1.0 / 6.0
                + x2 * (1.0 / 120.0 + x2 * (-1.0 / 5_040.0 + x2 * (1.0 / 362_880.0)))));
    let cos = 1.0 + x2 * (-0.5 + x2 * (1.0 / 24.0 + x2 * (-1.0 / 720.0 + x2 * (1.0 / 40_320.0))));
    // By bits, since no branch can foresee a random number: in odd quarters the two change places.
    let odd = (quarter as u32 & 1).wrapping_neg();
    let swap = (sin.to_bits() ^ cos.to_bits()) & odd;
    let below = (quarter as u32) << 30 & SIGN;
    let left = (quarter as u32 + 1) << 30 & SIGN;
    [sin.to_bits() ^ swap ^ below, cos.to_bits() ^ swap ^ left].map(f32::from_bits)
}

const SIGN: u32 = 1 << 31;

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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn turns_have_the_sine_and_cosine_of_the_library() {
        for k in 0..=1 << 20 {
            let turns = k as f32 / (1 << 20) as f32;
            let (sin, cos) = (f64::from(turns) * std::f64::consts::TAU).sin_cos();
            let [s, c] = sin_cos_turns(turns);
            let off = (f64::from(s) - sin).abs().max((f64::from(c) - cos).abs());
            assert!(off < 2e-7, "{turns}: {s} {c}, not {sin} {cos}");
        }
    }
}
