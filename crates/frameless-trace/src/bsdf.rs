//! How a surface scatters light: glTF 2.0's metallic-roughness material (specification, appendix B), sampled.
//!
//! ```text
//! f     = (1 − F) · c_diff / π + F · D · V
//! c_diff = (1 − metallic) · base        F = F0 + (F90 − F0)(1 − ωᵢ·h)⁵
//! F0 = mix(0.04 specular, base, metallic)       F90 = mix(specular, 1, metallic)
//! D = α² / (π ((n·h)² (α² − 1) + 1)²)   α = roughness²      V = G₂ / (4 (n·ωₒ)(n·ωᵢ)), height-correlated Smith
//! ```
//!
//! Directions point away from the surface; ωₒ to where light is seen from, ωᵢ to where it comes from. Below [`SMOOTHEST`] the
//! specular part is a mirror.

use std::f32::consts::{FRAC_1_PI, PI, TAU};

use frameless_scene::Material;
use glam::{Mat3A, Vec3A};

/// A surface's scattering, seen from one direction.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Bsdf {
    /// World from the shading frame: its z axis is the normal.
    frame: Mat3A,
    /// To where light is seen from, in the shading frame; z > 0.
    to_eye: Vec3A,
    diffuse: Vec3A,
    f0: Vec3A,
    f90: f32,
    /// 0: a mirror.
    alpha: f32,
    /// Probability that [`Bsdf::sample`] takes the specular part.
    specular_share: f32,
}

/// A direction from which light is to be followed.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Scattered {
    /// Unit length, world coordinates.
    pub(crate) direction: Vec3A,
    /// f · cos / probability density, or what a mirror reflects.
    pub(crate) weight: Vec3A,
    /// Solid angle; `None` in a mirror, where no other direction would have done.
    pub(crate) density: Option<f32>,
}

/// Below this α a highlight is narrower than single precision can tell.
const SMOOTHEST: f32 = 1e-3;
/// Reflectance of a dielectric at normal incidence, refractive index 1.5.
const DIELECTRIC: f32 = 0.04;
/// So that a direction along the surface is not divided by zero.
const GRAZING: f32 = 1e-4;

impl Bsdf {
    /// `base`: linear RGB; `to_eye` and `normal`: unit length, world coordinates, on the same side.
    pub(crate) fn new(material: &Material, base: Vec3A, normal: Vec3A, to_eye: Vec3A) -> Bsdf {
        let (x, y) = normal.any_orthonormal_pair();
        let frame = Mat3A::from_cols(x, y, normal);
        let mut to_eye = frame.transpose() * to_eye;
        to_eye.z = to_eye.z.max(GRAZING);
        let to_eye = to_eye.normalize();
        let metallic = material.metallic.clamp(0.0, 1.0);
        let diffuse = (1.0 - metallic) * base;
        let specular = material.specular.clamp(0.0, 1.0);
        let f0 = Vec3A::splat(DIELECTRIC * specular).lerp(base, metallic);
        let f90 = specular + metallic * (1.0 - specular);
        let alpha = (material.roughness * material.roughness).clamp(0.0, 1.0);
        let alpha = if alpha < SMOOTHEST { 0.0 } else { alpha };
        let fresnel = schlick(f0, f90, to_eye.z);
        let specular_share = share(fresnel, (Vec3A::ONE - fresnel) * diffuse);
        Bsdf { frame, to_eye, diffuse, f0, f90, alpha, specular_share }
    }

    /// Whether it reflects like a mirror and does nothing else.
    pub(crate) fn is_mirror(&self) -> bool {
        self.alpha == 0.0 && self.diffuse == Vec3A::ZERO
    }

    /// What part of the light would be scattered diffusely, as relighting needs it: it leaves the Fresnel term out.
    pub(crate) fn albedo(&self) -> Vec3A {
        self.diffuse
    }

    /// f · cos for light from a direction in the world; a mirror's reflection is not in it.
    pub(crate) fn scattered(&self, direction: Vec3A) -> Vec3A {
        let to_light = self.frame.transpose() * direction;
        if to_light.z <= 0.0 {
            return Vec3A::ZERO;
        }
        self.value(to_light) * to_light.z
    }

    /// Probability density, per solid angle, with which [`Bsdf::sample`] finds a direction in the world.
    pub(crate) fn density(&self, direction: Vec3A) -> f32 {
        let to_light = self.frame.transpose() * direction;
        if to_light.z <= 0.0 { 0.0 } else { self.local_density(to_light) }
    }

    /// A direction for three random numbers in [0, 1); `None` where it would go into the surface.
    pub(crate) fn sample(&self, [choice, u, v]: [f32; 3]) -> Option<Scattered> {
        if choice < self.specular_share {
            if self.alpha == 0.0 {
                let weight = schlick(self.f0, self.f90, self.to_eye.z) / self.specular_share;
                let direction = self.frame * reflect(self.to_eye, Vec3A::Z);
                return Some(Scattered { direction, weight, density: None });
            }
            self.scatter(reflect(self.to_eye, visible_normal(self.to_eye, self.alpha, [u, v])))
        } else {
            self.scatter(cosine([u, v]))
        }
    }

    fn scatter(&self, to_light: Vec3A) -> Option<Scattered> {
        if to_light.z <= 0.0 {
            return None;
        }
        let density = self.local_density(to_light);
        let weight = self.value(to_light) * (to_light.z / density);
        let direction = self.frame * to_light;
        Some(Scattered { direction, weight, density: Some(density) })
    }

    fn value(&self, to_light: Vec3A) -> Vec3A {
        let half = (self.to_eye + to_light).normalize_or(Vec3A::Z);
        let fresnel = schlick(self.f0, self.f90, to_light.dot(half));
        let diffuse = (Vec3A::ONE - fresnel) * self.diffuse * FRAC_1_PI;
        if self.alpha == 0.0 {
            return diffuse;
        }
        let specular =
            distribution(half.z, self.alpha) * visibility(to_light.z, self.to_eye.z, self.alpha);
        diffuse + fresnel * specular
    }

    fn local_density(&self, to_light: Vec3A) -> f32 {
        let cosine = (1.0 - self.specular_share) * to_light.z * FRAC_1_PI;
        if self.alpha == 0.0 {
            return cosine;
        }
        let half = (self.to_eye + to_light).normalize_or(Vec3A::Z);
        // D G₁(ωₒ) (ωₒ·h) / (n·ωₒ) for the normal, 1 / 4(ωₒ·h) for the reflection about it.
        let normal = distribution(half.z, self.alpha) * masking(self.to_eye.z, self.alpha);
        cosine + self.specular_share * normal / (4.0 * self.to_eye.z)
    }
}

/// F0 + (F90 − F0)(1 − cos)⁵ (Schlick 1994).
fn schlick(f0: Vec3A, f90: f32, cos: f32) -> Vec3A {
    let x = (1.0 - cos).clamp(0.0, 1.0);
    f0 + (Vec3A::splat(f90) - f0) * (x * x * x * x * x)
}

/// How often the specular part is taken: as much as it reflects of what both do, but neither never.
fn share(specular: Vec3A, diffuse: Vec3A) -> f32 {
    let [specular, diffuse] = [specular, diffuse].map(|rgb| rgb.element_sum());
    if diffuse <= 0.0 || specular <= 0.0 {
        return if diffuse <= 0.0 { 1.0 } else { 0.0 };
    }
    (specular / (specular + diffuse)).clamp(0.1, 0.9)
}

/// D of Trowbridge and Reitz 1975 (GGX).
fn distribution(cos: f32, alpha: f32) -> f32 {
    let a2 = alpha * alpha;
    let d = cos * cos * (a2 - 1.0) + 1.0;
    a2 / (PI * d * d)
}

/// G₂ / (4 (n·ωₒ)(n·ωᵢ)), height-correlated (Heitz 2014).
fn visibility(to_light: f32, to_eye: f32, alpha: f32) -> f32 {
    let a2 = alpha * alpha;
    let length = |cos: f32| (cos * cos * (1.0 - a2) + a2).sqrt();
    0.5 / (to_light * length(to_eye) + to_eye * length(to_light))
}

/// G₁ (Smith 1967).
fn masking(cos: f32, alpha: f32) -> f32 {
    let a2 = alpha * alpha;
    2.0 * cos / (cos + (cos * cos * (1.0 - a2) + a2).sqrt())
}

/// A normal among those that are seen, by the area that they show (Dupuy and Benyoub 2023, "Sampling Visible GGX Normals with Spherical
/// Caps").
fn visible_normal(to_eye: Vec3A, alpha: f32, [u, v]: [f32; 2]) -> Vec3A {
    let stretch = Vec3A::new(alpha, alpha, 1.0);
    let standing = (to_eye * stretch).normalize();
    let z = (1.0 - v) * (1.0 + standing.z) - standing.z;
    let sin = (1.0 - z * z).max(0.0).sqrt();
    let (sin_phi, cos_phi) = (TAU * u).sin_cos();
    let half = Vec3A::new(sin * cos_phi, sin * sin_phi, z) + standing;
    (half * stretch).normalize_or(Vec3A::Z)
}

fn reflect(direction: Vec3A, normal: Vec3A) -> Vec3A {
    2.0 * direction.dot(normal) * normal - direction
}

/// By the cosine to the normal: a disc lifted onto the hemisphere.
fn cosine([u, v]: [f32; 2]) -> Vec3A {
    let (radius, (sin, cos)) = (u.sqrt(), (TAU * v).sin_cos());
    Vec3A::new(radius * cos, radius * sin, (1.0 - u).max(GRAZING * GRAZING).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    const NORMAL: Vec3A = Vec3A::new(0.6, 0.0, 0.8);

    fn bsdf(metallic: f32, roughness: f32, tilt_rad: f32) -> Bsdf {
        let material = Material { metallic, roughness, ..Material::default() };
        let across = Vec3A::new(0.8, 0.0, -0.6);
        let to_eye = tilt_rad.cos() * NORMAL + tilt_rad.sin() * across;
        Bsdf::new(&material, Vec3A::new(0.9, 0.6, 0.3), NORMAL, to_eye)
    }

    /// Directions over the hemisphere, all weighing the same: (n + ½)/N in cos and φ.
    fn hemisphere(per_side: u32) -> impl Iterator<Item = Vec3A> {
        let (x, y) = NORMAL.any_orthonormal_pair();
        let at = move |i: u32| (i as f32 + 0.5) / per_side as f32;
        (0..per_side * per_side).map(move |i| {
            let (cos, phi) = (at(i % per_side), TAU * at(i / per_side));
            let sin = (1.0 - cos * cos).sqrt();
            cos * NORMAL + sin * (phi.cos() * x + phi.sin() * y)
        })
    }

    const CASES: [[f32; 3]; 6] = [
        [0.0, 1.0, 0.0],
        [0.0, 0.5, 1.0],
        [1.0, 0.3, 0.5],
        [1.0, 1.0, 1.3],
        [0.5, 0.4, 1.4],
        [0.0, 0.25, 0.2],
    ];

    #[test]
    fn densities_add_up_to_the_samples_that_stay_above() {
        for [metallic, roughness, tilt] in CASES {
            let bsdf = bsdf(metallic, roughness, tilt);
            let sum: f64 = hemisphere(800).map(|w| f64::from(bsdf.density(w))).sum();
            let integral = sum * f64::from(TAU) / (800.0 * 800.0);
            let above =
                grid(64).filter(|&u| bsdf.sample(u).is_some()).count() as f64 / 64f64.powi(3);
            assert!((integral - above).abs() < 0.01, "{metallic} {roughness}: {integral}, {above}");
        }
    }

    fn grid(per_side: u32) -> impl Iterator<Item = [f32; 3]> {
        let at = move |i: u32| ((i % per_side) as f32 + 0.5) / per_side as f32;
        (0..per_side.pow(3)).map(move |i| [at(i), at(i / per_side), at(i / per_side / per_side)])
    }

    #[test]
    fn samples_reflect_as_much_as_the_integral_says() {
        for [metallic, roughness, tilt] in CASES {
            let bsdf = bsdf(metallic, roughness, tilt);
            let sum: Vec3A = hemisphere(800).map(|w| bsdf.scattered(w)).sum();
            let integral = sum * (TAU / (800.0 * 800.0));
            let weights: Vec3A =
                grid(64).filter_map(|u| bsdf.sample(u)).map(|scattered| scattered.weight).sum();
            let mean = weights / 64f32.powi(3);
            assert!((mean - integral).abs().max_element() < 0.01, "{integral} {mean}");
            assert!(integral.max_element() <= 1.0, "{integral}");
        }
    }

    #[test]
    fn light_goes_both_ways_alike() {
        for [metallic, roughness, tilt] in CASES {
            let there = bsdf(metallic, roughness, tilt);
            let to_eye = there.frame * there.to_eye;
            for to_light in hemisphere(7) {
                let material = Material { metallic, roughness, ..Material::default() };
                let base = Vec3A::new(0.9, 0.6, 0.3);
                let back = Bsdf::new(&material, base, NORMAL, to_light);
                let one = there.scattered(to_light) * to_eye.dot(NORMAL);
                let other = back.scattered(to_eye) * to_light.dot(NORMAL);
                assert!((one - other).abs().max_element() < 1e-3 * one.max_element().max(1e-3));
            }
        }
    }

    #[test]
    fn a_mirror_reflects_its_colour_and_more_at_the_edge() {
        let mirror = bsdf(1.0, 0.0, 0.4);
        let scattered = mirror.sample([0.5; 3]).expect("above");
        assert!((scattered.direction.dot(NORMAL) - 0.4f32.cos()).abs() < 1e-5);
        assert!((scattered.weight - Vec3A::new(0.9, 0.6, 0.3)).abs().max_element() < 1e-3);
        assert_eq!(mirror.scattered(scattered.direction), Vec3A::ZERO);
        let edge = bsdf(1.0, 0.0, 1.56).sample([0.5; 3]).expect("above");
        assert!(edge.weight.min_element() > 0.9, "{edge:?}");
    }
}
