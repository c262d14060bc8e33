//! How the integrator `direct` divides what a surface does with light: scattered evenly, mirrored, passed.
//!
//! ```text
//! s(r) = 1 − smoothstep(0.1, 0.5, r)        how much of a mirror roughness r leaves
//! c = coat · F_coat · s(coat roughness)     m = metallic · s(roughness)      t = (1 − metallic) · transmission
//! mirrored = c + (1 − c)(m · base + t · F · s(roughness))
//! passed   = (1 − c) t (1 − F) base
//! matte    = (1 − c)(1 − m − t) base, under sheen: (1 − max(sheen) E) matte + sheen E
//! ```
//!
//! Up to roughness 0.1 a highlight is narrower than a degree or two and a mirror tells it well; from 0.5 on a matte surface is the nearer
//! picture: rough metals are matte in their base colour instead of black. What is no glass reflects nothing but by its coat. Rough glass
//! is as clear as polished glass. F: see [`crate::fresnel`]; E: see [`crate::sheen`].

use glam::Vec3A;

use crate::fresnel::{Dielectric, USUAL, schlick};
use crate::point::Point;
use crate::sheen;

/// Parts of light, linear RGB.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Shares {
    /// Albedo of what is scattered evenly.
    pub(crate) matte: Vec3A,
    pub(crate) mirrored: Vec3A,
    pub(crate) passed: Vec3A,
}

impl Shares {
    /// `to_eye`: from the point; `goes_on`: whether there may be another ray. If not, all is matte.
    #[inline(always)]
    pub(crate) fn of(point: &Point, to_eye: Vec3A, goes_on: bool) -> Shares {
        let matter = &point.matter;
        let mirror = if goes_on { mirror_weight(matter.metallic, matter.roughness) } else { 0.0 };
        let plain = Shares {
            matte: (1.0 - mirror) * matter.base,
            mirrored: mirror * matter.base,
            passed: Vec3A::ZERO,
        };
        if matter.layers.is_none() { plain } else { plain.layered(point, to_eye, goes_on) }
    }

    fn layered(self, point: &Point, to_eye: Vec3A, goes_on: bool) -> Shares {
        let matter = &point.matter;
        let Some(layers) = &matter.layers else { return self };
        let to_eye = to_eye.normalize_or_zero();
        let cosine = |normal: Vec3A| normal.dot(to_eye).clamp(0.0, 1.0);
        let dielectric = Dielectric::new(matter);
        let fresnel = match point.is_front || !layers.refracts {
            true => dielectric.reflectance(cosine(point.normal)),
            false => dielectric.reflectance_inside(cosine(point.normal)),
        };
        let [glass, coat] = match goes_on {
            false => [0.0; 2],
            true => {
                let film = schlick(Vec3A::splat(USUAL), 1.0, cosine(layers.coat_normal)).x;
                let coat = layers.coat * film * smoothness(layers.coat_roughness);
                [(1.0 - matter.metallic) * layers.transmission, coat]
            }
        };
        let under = 1.0 - coat;
        let white = self.matte + self.mirrored;
        let matte = under * (self.matte - glass * white).max(Vec3A::ZERO);
        let fibres = sheen::albedo(cosine(point.normal), layers.sheen_roughness);
        let dimmed = 1.0 - layers.sheen.max_element() * fibres;
        Shares {
            matte: dimmed * matte + under * fibres * layers.sheen,
            mirrored: Vec3A::splat(coat)
                + under * (self.mirrored + glass * smoothness(matter.roughness) * fresnel),
            passed: under * glass * (1.0 - fresnel.max_element()) * matter.base,
        }
    }
}

/// How much of a surface is a mirror: metallic · s(roughness).
#[inline(always)]
pub(crate) fn mirror_weight(metallic: f32, roughness: f32) -> f32 {
    metallic * smoothness(roughness)
}

#[inline(always)]
fn smoothness(roughness: f32) -> f32 {
    let x = ((roughness - 0.1) / (0.5 - 0.1)).clamp(0.0, 1.0);
    1.0 - x * x * (3.0 - 2.0 * x)
}
