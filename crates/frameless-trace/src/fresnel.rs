//! How much light a surface reflects, by angle.
//!
//! ```text
//! F = F0 + (F90 − F0)(1 − cosθ)⁵                     Schlick 1994
//! F0 = min(((ior − 1)/(ior + 1))² · colour, 1) · specular     F90 = specular     (KHR_materials_ior, KHR_materials_specular)
//! ```
//!
//! θ: on the side of the smaller refractive index. From inside, where sin²θ = ior² sin²θᵢ is above 1, everything is reflected.

use glam::Vec3A;

use crate::matter::Matter;

/// Reflectance of a dielectric at normal incidence whose refractive index is 1.5, also of coats.
pub(crate) const USUAL: f32 = 0.04;

/// F0 + (F90 − F0)(1 − cos)⁵.
#[inline]
pub(crate) fn schlick(f0: Vec3A, f90: f32, cos: f32) -> Vec3A {
    let x = (1.0 - cos).clamp(0.0, 1.0);
    f0 + (Vec3A::splat(f90) - f0) * (x * x * x * x * x)
}

/// The part of a material that is no metal.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Dielectric {
    pub(crate) f0: Vec3A,
    pub(crate) f90: f32,
    /// Refractive index, at least 1; may be infinite.
    pub(crate) ior: f32,
}

impl Dielectric {
    #[inline]
    pub(crate) fn new(matter: &Matter) -> Dielectric {
        let f90 = matter.specular.clamp(0.0, 1.0);
        let Some(layers) = &matter.layers else {
            return Dielectric { f0: Vec3A::splat(USUAL * f90), f90, ior: 1.5 };
        };
        let root =
            if layers.ior.is_finite() { (layers.ior - 1.0) / (layers.ior + 1.0) } else { 1.0 };
        let f0 = (root * root * layers.specular_color).min(Vec3A::ONE) * f90;
        Dielectric { f0, f90, ior: layers.ior }
    }

    /// From outside; `cos`: to the normal, at least 0.
    #[inline]
    pub(crate) fn reflectance(&self, cos: f32) -> Vec3A {
        schlick(self.f0, self.f90, cos)
    }

    /// From inside.
    pub(crate) fn reflectance_inside(&self, cos: f32) -> Vec3A {
        let sin2 = self.ior * self.ior * (1.0 - cos * cos).max(0.0);
        if sin2 < 1.0 { self.reflectance((1.0 - sin2).sqrt()) } else { Vec3A::ONE }
    }

    /// Average of F over directions as a matte surface sees them, ∫ F 2 cosθ d cosθ: ∫ (1 − c)⁵ 2c dc = 1/21.
    pub(crate) fn mean_reflectance(&self) -> Vec3A {
        self.f0 + (Vec3A::splat(self.f90) - self.f0) * (1.0 / 21.0)
    }
}

/// The direction behind the surface that light from the direction `to` (away from it, on the normal's side, unit length) takes;
/// `eta`: refractive index here over that behind. `None`: all is reflected.
#[inline]
pub(crate) fn refracted(to: Vec3A, normal: Vec3A, eta: f32) -> Option<Vec3A> {
    let cos = to.dot(normal);
    let cos2_behind = 1.0 - eta * eta * (1.0 - cos * cos).max(0.0);
    (cos2_behind > 0.0).then(|| (eta * cos - cos2_behind.sqrt()) * normal - eta * to)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn glass() -> Dielectric {
        Dielectric { f0: Vec3A::splat(USUAL), f90: 1.0, ior: 1.5 }
    }

    #[test]
    fn light_bends_as_snell_says_and_back() {
        for sin in [0.0f32, 0.3, 0.7, 0.99] {
            let to = Vec3A::new(sin, 0.0, (1.0 - sin * sin).sqrt());
            let inside = refracted(to, Vec3A::Z, 1.0 / 1.5).unwrap();
            assert!((inside.x + sin / 1.5).abs() < 1e-6 && inside.z < 0.0, "{inside}");
            assert!((inside.length() - 1.0).abs() < 1e-6);
            let out = refracted(inside, -Vec3A::Z, 1.5).unwrap();
            assert!(out.abs_diff_eq(to, 1e-5), "{out} {to}");
        }
        let grazing = Vec3A::new(0.7, 0.0, 0.51f32.sqrt());
        assert!(refracted(grazing, Vec3A::Z, 1.5).is_none(), "beyond the critical angle");
    }

    #[test]
    fn both_sides_reflect_the_same_part() {
        let glass = glass();
        for cos in [1.0f32, 0.9, 0.5, 0.1] {
            let behind = (1.0 - (1.0 - cos * cos) / (1.5 * 1.5)).sqrt();
            let (one, other) = (glass.reflectance(cos), glass.reflectance_inside(behind));
            assert!(one.abs_diff_eq(other, 1e-5), "{cos}: {one} {other}");
        }
        assert_eq!(glass.reflectance_inside(0.5), Vec3A::ONE, "beyond the critical angle");
    }

    #[test]
    fn the_mean_is_the_integral() {
        let glass = glass();
        let at = |k: i32| (k as f32 + 0.5) / 1000.0;
        let sum: Vec3A = (0..1000).map(|k| glass.reflectance(at(k)) * 2.0 * at(k)).sum();
        assert!((sum / 1000.0).abs_diff_eq(glass.mean_reflectance(), 1e-4));
    }

    #[test]
    fn an_infinite_index_reflects_everything_and_one_nothing() {
        let layers = |ior| {
            let scene_layers = frameless_scene::Layers::default();
            crate::matter::LayersHere {
                ior,
                specular_color: scene_layers.specular_color.into(),
                transmission: 1.0,
                refracts: true,
                coat: 0.0,
                coat_roughness: 0.0,
                coat_normal: Vec3A::Z,
                sheen: Vec3A::ZERO,
                sheen_roughness: 0.0,
            }
        };
        let of = |ior| {
            Dielectric::new(&Matter {
                specular: 1.0,
                layers: Some(Box::new(layers(ior))),
                ..Matter::BLACK
            })
        };
        assert_eq!(of(f32::INFINITY).reflectance(0.3), Vec3A::ONE);
        assert_eq!(of(1.0).f0, Vec3A::ZERO);
        assert!((of(1.5).f0.x - 0.04).abs() < 1e-6);
    }
}
