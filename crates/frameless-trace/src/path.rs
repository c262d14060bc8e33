//! The integrator `path`: light that has bounced any number of times (Kajiya 1986).
//!
//! ```text
//! L = L_emitted + Σ_lights f E cosθ V + E[ f cosθ / p(ω) · L(ω) ]
//! w = p / (p + q)                      balance heuristic between two ways to meet a shining triangle
//! ```
//!
//! Unidirectional paths: at every surface point all punctual lights are asked, and one point of what shines ([`Emitters`]); then one
//! direction is followed ([`Bsdf::sample`]), to the next surface or the sky. What shines is found in both ways, each weighted by how
//! likely it was to find it (Veach and Guibas 1995, "Optimally Combining Sampling Techniques for Monte Carlo Rendering"). So on until the path is ended by Russian roulette or has met
//! [`Settings::max_depth`] surfaces after the first. The scene's ambient light stands for what is computed here, and is left out.
//!
//! Unbiased but for that limit. Random numbers are Owen-scrambled Sobol points (Burley 2020, "Practical Hash-based Owen
//! Scrambling") by the request's number in its pixel's sequence: the same request has the same answer.

use frameless::{Request, Surface};
use glam::Vec3A;
use sobol_burley::{NUM_DIMENSION_SETS_4D, sample_4d};

use crate::bsdf::Bsdf;
use crate::direct::{NoProbe, finite, sky_surface};
#[cfg(doc)]
use crate::emitters::Emitters;
use crate::first::FirstSurface;
use crate::integrator::Settings;
use crate::moment::Moment;
use crate::point::Point;
use crate::ray::Ray;
use crate::traverse::Stack;
use crate::world::World;

/// Surfaces that every path may meet before roulette begins.
const SAFE_DEPTH: u32 = 3;
/// Shadow rays end before what shines.
const NEARLY_THERE: f32 = 1.0 - 1e-4;
/// Of a path that has lost nothing: it has to end some time in a closed white room.
const MOST_LIKELY_ON: f32 = 0.95;

impl World {
    /// What comes back along a ray, by one random path.
    pub(crate) fn path_radiance(
        &self,
        moment: &Moment,
        mut ray: Ray,
        request: &Request,
        settings: &Settings,
        stack: &mut Stack,
    ) -> ([f32; 3], Surface) {
        let numbers = Numbers::of(request);
        let (mut radiance, mut throughput) = (Vec3A::ZERO, Vec3A::ONE);
        let mut first = FirstSurface::default();
        // Of the direction that the path took last; `None` where no other would have done.
        let mut density = None;
        for depth in 0..=settings.max_depth {
            let Some(hit) = moment.targets(self).closest(&ray, stack) else {
                radiance += throughput * self.sky(ray.direction);
                first.see(self, || sky_surface(&ray), throughput);
                break;
            };
            let point = Point::new(self, moment, &ray, &hit);
            let material = &self.scene().materials[point.material as usize];
            let to_eye = -ray.direction.normalize_or_zero();
            let bsdf = Bsdf::new(material, point.base, point.normal, to_eye);
            let emissive = Vec3A::from(material.emissive);
            if emissive != Vec3A::ZERO {
                let place = [hit.instance, hit.primitive];
                let to_light = hit.t * ray.direction;
                let other = || self.emitters.density_of(self, moment, place, to_light);
                radiance += density.map_or(1.0, |own| weight(own, other())) * throughput * emissive;
            }
            let numbers = numbers.at(depth);
            let (mut scattered, mut irradiance) = (Vec3A::ZERO, Vec3A::ZERO);
            let lit = self.ask_lights(moment, &point, settings, stack, &mut NoProbe, |arriving| {
                scattered += bsdf.scattered(arriving.to_light) * arriving.irradiance;
                irradiance += arriving.per_albedo();
            });
            scattered += self.ask_emitters(moment, &point, &bsdf, numbers.light, stack);
            radiance += throughput * scattered;
            let albedo = bsdf.albedo();
            first.see(self, || point.surface(&hit, albedo, irradiance, lit), throughput);
            if depth == 0 && settings.surfaces && bsdf.is_mirror() {
                first.look_into_mirror(self, moment, &hit, ray.direction);
            }
            let Some(next) = bsdf.sample(numbers.direction) else { break };
            // A shading normal may lead below the surface itself.
            if next.direction.dot(point.geometric_normal) <= 0.0 {
                break;
            }
            throughput *= next.weight;
            if depth >= SAFE_DEPTH {
                let goes_on = throughput.max_element().min(MOST_LIKELY_ON);
                if numbers.roulette >= goes_on {
                    break;
                }
                throughput /= goes_on;
            }
            density = next.density;
            ray = Ray { origin: point.outside, direction: next.direction };
        }
        (finite(radiance), first.surface(&ray))
    }

    /// What reaches the eye of one point of what shines.
    fn ask_emitters(
        &self,
        moment: &Moment,
        point: &Point,
        bsdf: &Bsdf,
        numbers: [f32; 3],
        stack: &mut Stack,
    ) -> Vec3A {
        let Some(light) = self.emitters.sample(self, moment, point.shadow_origin, numbers) else {
            return Vec3A::ZERO;
        };
        let direction = light.to_light.normalize_or_zero();
        let scattered = bsdf.scattered(direction);
        if scattered == Vec3A::ZERO || direction.dot(point.geometric_normal) <= 0.0 {
            return Vec3A::ZERO;
        }
        let shadow_ray = Ray { origin: point.shadow_origin, direction: light.to_light };
        if moment.targets(self).occluded(&shadow_ray, NEARLY_THERE, stack) {
            return Vec3A::ZERO;
        }
        let weight = weight(light.density, bsdf.density(direction));
        scattered * light.radiance * (weight / light.density)
    }
}

/// Of a finding that had this density, and in another way would have had the other.
fn weight(own: f32, other: f32) -> f32 {
    own / (own + other)
}

/// The random numbers of one request.
#[derive(Clone, Copy)]
struct Numbers {
    index: u32,
    seed: u32,
}

/// In [0, 1), for one surface.
struct AtSurface {
    direction: [f32; 3],
    light: [f32; 3],
    roulette: f32,
}

impl Numbers {
    fn of(request: &Request) -> Numbers {
        // The sequence has 2¹⁶ points; then another begins.
        let (index, turn) = (request.sample_index & 0xffff, request.sample_index >> 16);
        Numbers { index, seed: mixed(mixed(request.pixel) ^ turn) }
    }

    /// For the surface that a path meets after `depth` others.
    fn at(&self, depth: u32) -> AtSurface {
        const TURN: u32 = NUM_DIMENSION_SETS_4D / 2;
        let (set, turn) = (2 * (depth % TURN), depth / TURN);
        let four = |set| sample_4d(self.index, set, mixed(self.seed ^ turn));
        let ([choice, u, v, roulette], [pick, s, t, _]) = (four(set), four(set + 1));
        AtSurface { direction: [choice, u, v], light: [pick, s, t], roulette }
    }
}

/// Every bit of the result depends on every bit of the number ("lowbias32", Wellons 2018).
fn mixed(mut x: u32) -> u32 {
    x ^= x >> 16;
    x = x.wrapping_mul(0x7feb_352d);
    x ^= x >> 15;
    x = x.wrapping_mul(0x846c_a68b);
    x ^ (x >> 16)
}
