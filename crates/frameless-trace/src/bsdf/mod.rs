//! How a surface scatters light, for paths: glTF 2.0's metallic-roughness material (specification, appendix B) with the layers of its
//! extensions, sampled.
//!
//! ```text
//! f = coat · F_c D V + (1 − coat F_c(n·ωₒ)) (1 − coat F_c(n·ωᵢ)) · ( sheen f_sheen + dimmed · under )
//! under = F D V + (1 − metallic)(1 − transmission) base k / π                          on the side of ωₒ
//! F = mix(F_dielectric, F_metal, metallic)(h·ωᵢ)
//! k = (1 − F(n·ωₒ)) (1 − F(n·ωᵢ)) / (1 − F̄)       F of the dielectric, F̄ its mean over directions, by cosine
//! ```
//!
//! What is not reflected and not scattered passes to the other side: (1 − metallic) · transmission · base · (1 − F), refracted by the
//! normals that are seen (Walter et al. 2007, "Microfacet Models for Refraction through Rough Surfaces"), or by a thin wall straight on, as
//! far spread as what is reflected. That part is found by following it only, so that it has no density; and radiance is not scaled by the
//! square of the refractive index: what enters leaves again.
//!
//! Differs from the specification: there k is 1 − F(h·ωᵢ), and the coat dims once, by F_c(n·ωₒ). At grazing angles both add up to more than
//! comes in. k is that of Ashikhmin and Shirley 2000, "An Anisotropic Phong BRDF Model"; it is the same in both directions, too.
//!
//! Directions point away from the surface; ωₒ to where light is seen from, ωᵢ to where it comes from. Highlights of which the square of the
//! roughness is below 0.001 are mirrors.

mod ggx;
#[cfg(test)]
mod tests;

use std::f32::consts::FRAC_1_PI;

use glam::Vec3A;

use crate::fresnel::{Dielectric, USUAL, refracted, schlick};
use crate::matter::{LayersHere, Matter};
use crate::sheen;
use ggx::{GRAZING, Ggx, frame, sin_cos_turns};

/// A surface's scattering, seen from one direction.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Bsdf {
    base: Ggx,
    /// What is not metal, and not glass.
    diffuse: Vec3A,
    metal: Vec3A,
    metallic: f32,
    dielectric: Dielectric,
    /// (1 − F(n·ωₒ)) / (1 − F̄), F of the dielectric; 0 where nothing gets below the surface.
    under: f32,
    glass: Option<Glass>,
    coat: Option<Coat>,
    fibres: Option<Fibres>,
    /// Whether it scatters evenly and does nothing else.
    is_matte: bool,
    /// Probabilities with which [`Bsdf::sample`] takes each lobe, up to and with it: highlight, coat, glass, matte.
    up_to: [f32; 4],
}

#[derive(Clone, Copy, Debug)]
struct Glass {
    /// Part that passes if nothing is reflected.
    clear: Vec3A,
    /// Whether it bends light; else it is a thin wall.
    refracts: bool,
    /// Whether it is seen from inside.
    is_inside: bool,
}

#[derive(Clone, Copy, Debug)]
struct Coat {
    film: Ggx,
    part: f32,
}

#[derive(Clone, Copy, Debug)]
struct Fibres {
    color: Vec3A,
    roughness: f32,
}

/// A direction from which light is to be followed.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Scattered {
    /// Unit length, world coordinates.
    pub(crate) direction: Vec3A,
    /// f · cos / probability density, or what a mirror reflects.
    pub(crate) weight: Vec3A,
    /// Solid angle; `None` in a mirror and through glass, where lights are not asked.
    pub(crate) density: Option<f32>,
    /// How wide the lobe is that it was drawn from: the square of its roughness; 1: matte.
    pub(crate) alpha: f32,
    /// Whether it goes through the surface.
    pub(crate) passes: bool,
}

const HIGHLIGHT: usize = 0;
const COAT: usize = 1;
const GLASS: usize = 2;
const MATTE: usize = 3;

impl Bsdf {
    /// What has no lobes but a matte one; all others are [divided](Bsdf::divide_lobes) next, in place: it is too large to be moved.
    /// `to_eye`: unit length, world coordinates, on the side of the point's normal.
    #[inline(always)]
    pub(crate) fn undivided(matter: &Matter, normal: Vec3A, to_eye: Vec3A) -> Bsdf {
        let metallic = matter.metallic.clamp(0.0, 1.0);
        Bsdf {
            base: Ggx::new(normal, to_eye, matter.roughness),
            diffuse: (1.0 - metallic) * matter.base,
            metal: matter.base,
            metallic,
            dielectric: Dielectric::new(matter),
            under: 1.0,
            glass: None,
            coat: None,
            fibres: None,
            is_matte: matter.is_matte(),
            up_to: [0.0, 0.0, 0.0, 1.0],
        }
    }

    /// The same arguments again.
    #[inline(always)]
    pub(crate) fn divide_lobes(&mut self, matter: &Matter, is_front: bool, to_eye: Vec3A) {
        if !self.is_matte {
            self.divide_glossy(matter, is_front, to_eye);
        }
    }

    fn divide_glossy(&mut self, matter: &Matter, is_front: bool, to_eye: Vec3A) {
        let mean = self.dielectric.mean_reflectance().max_element();
        self.under = if mean < 0.999 { 1.0 / (1.0 - mean) } else { 0.0 };
        match matter.layers.as_deref() {
            None => self.divide_in_two(),
            Some(layers) => self.add(layers, is_front, to_eye),
        }
    }

    #[inline(never)]
    fn add(&mut self, layers: &LayersHere, is_front: bool, to_eye: Vec3A) {
        let transmission = layers.transmission.clamp(0.0, 1.0);
        let is_inside = layers.refracts && transmission > 0.0 && !is_front;
        let refracts = layers.refracts;
        if is_inside {
            // 1 − F̄ from inside, where a cone of 1/ior² of all directions leads out.
            self.under *= (layers.ior * layers.ior).min(f32::MAX);
        }
        let clear = transmission * self.diffuse;
        self.diffuse *= 1.0 - transmission;
        self.glass = (transmission > 0.0).then_some(Glass { clear, refracts, is_inside });
        let film = Ggx::new(layers.coat_normal, to_eye, layers.coat_roughness);
        let part = layers.coat.clamp(0.0, 1.0);
        self.coat = (part > 0.0 && !is_inside).then_some(Coat { film, part });
        let fibres = Fibres { color: layers.sheen, roughness: layers.sheen_roughness };
        self.fibres = (layers.sheen != Vec3A::ZERO).then_some(fibres);
        self.divide();
    }

    /// Multiplies `under` by what passes on the way to the eye, and [divides](Bsdf::divide) what has no layers.
    #[inline(always)]
    fn divide_in_two(&mut self) {
        let cos = self.base.cos;
        let below = 1.0 - self.dielectric_fresnel(cos).max_element();
        self.under *= below;
        let [highlight, matte] = [self.fresnel(cos), below * self.diffuse].map(Vec3A::element_sum);
        let total = highlight + matte;
        let kept = |lobe: f32| kept(if total > 0.0 { lobe / total } else { 0.0 });
        let [highlight, matte] = [kept(highlight), kept(matte)];
        let part = if highlight > 0.0 { highlight / (highlight + matte) } else { 0.0 };
        self.up_to = [part, part, part, 1.0];
    }

    /// Chooses how often each lobe is taken: as much as it scatters of what all do, but none seldom that scatters at all; up to ten times
    /// as often.
    fn divide(&mut self) {
        let cos = self.base.cos;
        let film = self.coat.as_ref().map_or(0.0, Coat::reflectance);
        let fibres = self.fibres.as_ref().map_or(0.0, |fibres| fibres.lit(cos));
        let below = Vec3A::splat(1.0 - self.dielectric_fresnel(cos).max_element());
        self.under *= below.x;
        let clear = self.glass.map_or(Vec3A::ZERO, |glass| glass.clear);
        let lobes = [
            (1.0 - film) * self.fresnel(cos).element_sum(),
            3.0 * film,
            (1.0 - film) * (below * clear).element_sum(),
            (1.0 - film) * ((below * self.diffuse).element_sum() + 3.0 * fibres),
        ];
        let total: f32 = lobes.iter().sum();
        let kept = lobes.map(|lobe| kept(if lobe > 0.0 { lobe / total } else { 0.0 }));
        let all: f32 = kept.iter().sum();
        let mut sum = 0.0;
        self.up_to = kept.map(|kept| {
            sum += if all > 0.0 { kept / all } else { 0.0 };
            sum
        });
        // Where nothing is scattered at all, matte black is.
        self.up_to[MATTE] = 1.0;
    }

    fn probability(&self, lobe: usize) -> f32 {
        match lobe {
            HIGHLIGHT => self.up_to[HIGHLIGHT],
            lobe => self.up_to[lobe] - self.up_to[lobe - 1],
        }
    }

    /// Whether it reflects like a mirror and does nothing else.
    pub(crate) fn is_mirror(&self) -> bool {
        let is_bare = self.glass.is_none() && self.coat.is_none() && self.fibres.is_none();
        self.base.alpha == 0.0 && self.diffuse == Vec3A::ZERO && is_bare
    }

    /// What part of the light would be scattered diffusely, as relighting needs it: it leaves the Fresnel term out.
    pub(crate) fn albedo(&self) -> Vec3A {
        self.diffuse
    }

    /// f · cos for light from a direction in the world, on the side of the eye; a mirror's reflection is not in it.
    #[inline]
    pub(crate) fn scattered(&self, direction: Vec3A) -> Vec3A {
        self.towards(direction).0
    }

    /// Probability density, per solid angle, with which [`Bsdf::sample`] finds a direction in the world.
    #[cfg(test)]
    pub(crate) fn density(&self, direction: Vec3A) -> f32 {
        self.towards(direction).1
    }

    /// f · cos and the density.
    #[inline(always)]
    pub(crate) fn towards(&self, direction: Vec3A) -> (Vec3A, f32) {
        let i = self.base.normal.dot(direction);
        if i <= 0.0 {
            return (Vec3A::ZERO, 0.0);
        }
        if self.is_matte {
            let density = i * FRAC_1_PI;
            return (self.diffuse * density, density);
        }
        let mut f = self.diffuse * (self.below(i) * FRAC_1_PI);
        let mut density = self.probability(MATTE) * i * FRAC_1_PI;
        // What never reflects has no highlight either.
        if self.up_to[HIGHLIGHT] > 0.0 && self.base.alpha > 0.0 {
            let half = self.base.half(direction);
            let (value, its_density) = self.base.towards(i, half);
            f += self.fresnel(direction.dot(half)) * value;
            density += self.up_to[HIGHLIGHT] * its_density;
        }
        if self.has_layers() {
            self.add_layers(direction, i, &mut f, &mut density);
        }
        (f * i, density)
    }

    fn has_layers(&self) -> bool {
        self.fibres.is_some() || self.coat.is_some()
    }

    #[inline(never)]
    fn add_layers(&self, direction: Vec3A, i: f32, f: &mut Vec3A, density: &mut f32) {
        if let Some(fibres) = &self.fibres {
            let below = fibres.dim(self.base.cos, i);
            let h = self.base.normal.dot(self.base.half(direction));
            let value = sheen::value([self.base.cos, i], h, fibres.roughness);
            *f = below * *f + fibres.color * value;
        }
        if let Some(coat) = &self.coat {
            *f = coat.under(direction) * *f + Vec3A::splat(coat.value(direction));
            let of_film = coat.film.density(direction);
            *density += self.probability(COAT) * of_film;
        }
    }

    /// A direction for two random numbers in [0, 1); `None` where it would go into the surface.
    #[inline(always)]
    pub(crate) fn sample(&self, numbers: [f32; 2]) -> Option<Scattered> {
        if self.is_matte {
            // Everything cancels out but the albedo.
            let local = cosine(numbers);
            let (direction, density) = (frame(self.base.normal) * local, local.z * FRAC_1_PI);
            let (weight, density) = (self.diffuse, Some(density));
            return Some(Scattered { direction, weight, density, alpha: 1.0, passes: false });
        }
        self.sample_lobe(numbers)
    }

    #[inline(never)]
    fn sample_lobe(&self, [u, v]: [f32; 2]) -> Option<Scattered> {
        let lobe = self.up_to.iter().position(|&up_to| u < up_to).unwrap_or(MATTE);
        // What is left of the number that has chosen is as even as it was.
        let before = if lobe > 0 { self.up_to[lobe - 1] } else { 0.0 };
        let u = ((u - before) / self.probability(lobe)).clamp(0.0, 1.0);
        let base = &self.base;
        match (lobe, &self.coat, &self.glass) {
            (HIGHLIGHT, ..) if base.alpha == 0.0 => {
                let direction = base.sample([u, v]);
                let fresnel = self.below_layers(direction) * self.fresnel(base.cos);
                Some(mirrored(direction, fresnel / self.probability(HIGHLIGHT)))
            }
            (HIGHLIGHT, ..) => self.scatter(base.sample([u, v]), base.alpha),
            (COAT, Some(coat), _) if coat.film.alpha == 0.0 => {
                let direction = coat.film.sample([u, v]);
                let part = coat.reflectance() / self.probability(COAT);
                Some(mirrored(direction, Vec3A::splat(part)))
            }
            (COAT, Some(coat), _) => self.scatter(coat.film.sample([u, v]), coat.film.alpha),
            (GLASS, _, Some(glass)) => self.pass(glass, [u, v]),
            _ => self.scatter(frame(base.normal) * cosine([u, v]), 1.0),
        }
    }

    fn scatter(&self, direction: Vec3A, alpha: f32) -> Option<Scattered> {
        let (scattered, density) = self.towards(direction);
        let weight = scattered / density;
        let found = Scattered { direction, weight, density: Some(density), alpha, passes: false };
        (density > 0.0 && weight.is_finite()).then_some(found)
    }

    /// Through one of the normals that are seen.
    fn pass(&self, glass: &Glass, numbers: [f32; 2]) -> Option<Scattered> {
        let base = &self.base;
        let normal = base.visible_normal(numbers);
        let cos = base.to_eye.dot(normal);
        let direction = if glass.refracts {
            let ior = self.dielectric.ior;
            refracted(base.to_eye, normal, if glass.is_inside { ior } else { 1.0 / ior })?
        } else {
            // What would be reflected, behind the wall.
            let reflected = 2.0 * cos * normal - base.to_eye;
            reflected - 2.0 * reflected.dot(base.normal) * base.normal
        };
        let behind = -direction.dot(base.normal);
        if behind <= 0.0 {
            return None;
        }
        let below = 1.0 - self.dielectric_fresnel(cos).max_element();
        let part = below * base.left_over(behind) / self.probability(GLASS);
        let weight = self.below_layers(direction) * part * glass.clear;
        let (density, alpha) = (None, base.alpha);
        Some(Scattered { direction, weight, density, alpha, passes: true })
    }

    /// What coat and fibres leave of light that what is below them scatters there.
    fn below_layers(&self, direction: Vec3A) -> f32 {
        let i = self.base.normal.dot(direction).abs();
        let coat = self.coat.as_ref().map_or(1.0, |coat| coat.under(direction));
        coat * self.fibres.as_ref().map_or(1.0, |fibres| fibres.dim(self.base.cos, i))
    }

    /// F; `cos`: between a direction and the normal that reflects it.
    #[inline]
    fn fresnel(&self, cos: f32) -> Vec3A {
        let metal = schlick(self.metal, 1.0, cos);
        self.dielectric_fresnel(cos).lerp(metal, self.metallic)
    }

    #[inline]
    fn dielectric_fresnel(&self, cos: f32) -> Vec3A {
        match self.glass {
            Some(Glass { is_inside: true, .. }) => self.dielectric.reflectance_inside(cos),
            _ => self.dielectric.reflectance(cos),
        }
    }

    /// k.
    #[inline(always)]
    fn below(&self, i: f32) -> f32 {
        (1.0 - self.dielectric_fresnel(i).max_element()) * self.under
    }
}

/// How often a lobe is taken that scatters this part of all: none seldom that scatters at all.
#[inline(always)]
fn kept(part: f32) -> f32 {
    const LEAST: f32 = 0.1;
    const MOST_MORE: f32 = 10.0;
    part.max(LEAST.min(MOST_MORE * part))
}

impl Coat {
    /// As a mirror.
    fn reflectance(&self) -> f32 {
        self.part * film_fresnel(self.film.cos)
    }

    fn value(&self, direction: Vec3A) -> f32 {
        let cos = direction.dot(self.film.half(direction));
        self.part * film_fresnel(cos) * self.film.value(direction)
    }

    /// What it leaves of light from a direction that what is below scatters.
    fn under(&self, direction: Vec3A) -> f32 {
        let passes = |cos: f32| 1.0 - self.part * film_fresnel(cos);
        passes(self.film.cos) * passes(self.film.normal.dot(direction).abs())
    }
}

impl Fibres {
    /// What they send back of light from everywhere, as a mean over the colours.
    fn lit(&self, cos: f32) -> f32 {
        self.color.element_sum() / 3.0 * sheen::albedo(cos, self.roughness)
    }

    /// What they leave of light that what is below scatters.
    fn dim(&self, o: f32, i: f32) -> f32 {
        let most = self.color.max_element();
        let left = |cos: f32| 1.0 - most * sheen::albedo(cos, self.roughness);
        left(o).min(left(i))
    }
}

/// Of a coat, whose refractive index is 1.5.
fn film_fresnel(cos: f32) -> f32 {
    schlick(Vec3A::splat(USUAL), 1.0, cos).x
}

fn mirrored(direction: Vec3A, weight: Vec3A) -> Scattered {
    Scattered { direction, weight, density: None, alpha: 0.0, passes: false }
}

/// By the cosine to the normal: a disc lifted onto the hemisphere.
#[inline(always)]
fn cosine([u, v]: [f32; 2]) -> Vec3A {
    let (radius, [sin, cos]) = (u.sqrt(), sin_cos_turns(v));
    Vec3A::new(radius * cos, radius * sin, (1.0 - u).max(GRAZING * GRAZING).sqrt())
}
