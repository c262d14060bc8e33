//! The integrator `path`: light that has bounced any number of times (Kajiya 1986).
//!
//! ```text
//! L = L_emitted + Σ_lights f E cosθ V + E[ f cosθ / p(ω) · L(ω) ]
//! w = p / (p + q)                      balance heuristic between two ways to meet a shining triangle
//! ```
//!
//! Unidirectional paths: at every surface point all punctual lights are asked, and one point of what shines ([`Emitters`]); then one
//! direction is followed ([`Bsdf::sample`]), to the next surface or the sky. What shines is found in both ways, and so is an environment
//! ([`Surroundings`]), each weighted by how likely it was to find it (Veach and Guibas 1995, "Optimally Combining Sampling Techniques for Monte Carlo Rendering"). So on until the path is ended by Russian roulette or has met
//! [`Settings::max_depth`] surfaces after the first; from the last of them nothing is followed, so that light is asked for alone, and weighs 1. The scene's ambient light stands for what is computed here, and is left out.
//!
//! Unbiased but for that limit, and for punctual lights behind glass, which are seen straight through it. Lamps and the environment are not:
//! they are met through it. Surfaces that blend are there with their alpha as probability. What encloses a volume absorbs e^(−σ·way).
//!
//! Random numbers are Owen-scrambled Sobol points (Burley 2020, "Practical Hash-based Owen
//! Scrambling") by the request's number in its pixel's sequence: the same request has the same answer.

use frameless::{Request, Surface};
use glam::Vec3A;
use sobol_burley::{NUM_DIMENSION_SETS_4D, sample_4d};

use crate::bsdf::Bsdf;
use crate::direct::{NoProbe, finite, sky_surface};
#[cfg(doc)]
use crate::emitters::Emitters;
use crate::first::FirstSurface;
use crate::holes::{Chance, attenuation};
use crate::integrator::Settings;
use crate::moment::Moment;
use crate::point::Point;
use crate::ray::Ray;
use crate::surroundings::FromAfar;
#[cfg(doc)]
use crate::surroundings::Surroundings;
use crate::texture::Cone;
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
        (mut ray, mut cone): (Ray, Cone),
        request: &Request,
        settings: &Settings,
        stack: &mut Stack,
    ) -> ([f32; 3], Surface) {
        let numbers = Numbers::of(request);
        let (mut radiance, mut throughput) = (Vec3A::ZERO, Vec3A::ONE);
        let mut first = FirstSurface::new(settings.surfaces);
        // Of the direction that the path took last; `None` where no other would have done.
        let mut density = None;
        // Absorption per metre of what the path is inside, if that is known.
        let mut inside = None;
        for depth in 0..=settings.max_depth {
            let chance = numbers.chance(depth);
            let mut met = self.nearest(moment, &ray, chance, stack);
            if depth == 0
                && let Some(hit) = &met
                && self.shows_its_back(moment, &ray, hit)
            {
                met = self.behind_back(moment, &ray, chance, stack);
            }
            let Some(hit) = met else {
                radiance += throughput * self.sky_seen(ray.direction, density);
                first.see(self, || sky_surface(&ray), throughput);
                break;
            };
            let point = Point::new(self, moment, &ray, &hit, cone);
            let material = &self.scene().materials[point.material as usize];
            let way_m = hit.t * ray.direction.length();
            inside = inside.or_else(|| point.behind(material));
            if let Some(sigma) = inside {
                throughput *= attenuation(sigma, way_m);
            }
            if material.unlit {
                // Shown, but no light for others.
                if density.is_none() {
                    radiance += throughput * point.matter.base;
                }
                first.see(self, || point.unlit(&hit), throughput);
                break;
            }
            let bsdf = Bsdf::new(&point, -ray.direction.normalize_or_zero());
            let emissive = point.matter.emissive;
            if emissive != Vec3A::ZERO && (point.is_front || material.double_sided) {
                let place = [hit.instance, hit.primitive];
                let to_light = hit.t * ray.direction;
                let other = || self.emitters.density_of(self, moment, place, to_light);
                radiance += density.map_or(1.0, |own| weight(own, other())) * throughput * emissive;
            }
            let is_last = depth == settings.max_depth;
            let mut scattered = Vec3A::ZERO;
            let asked =
                self.ask_lights(moment, &point, settings, stack, &mut NoProbe, |arriving| {
                    scattered += bsdf.scattered(arriving.to_light) * arriving.irradiance;
                });
            if !self.emitters.is_empty() {
                let numbers = numbers.light(depth);
                scattered += self.ask_emitters(moment, &point, &bsdf, is_last, numbers, stack);
            }
            if let Some(surroundings) = &self.surroundings {
                let light = surroundings.sample(numbers.sky(depth));
                scattered += self.ask_surroundings(moment, &point, &bsdf, is_last, light, stack);
            }
            radiance += throughput * scattered;
            let albedo = bsdf.albedo();
            let seen = || point.surface(&hit, albedo, asked.unhindered, asked.lit);
            first.see(self, seen, throughput);
            // Through a lens what is seen in a mirror is as blurred as if it were where its image is; it goes with the mirror.
            let wants_images = settings.surfaces && settings.lens.is_none();
            if depth == 0 && wants_images && bsdf.is_mirror() {
                first.look_into_mirror(self, moment, &hit, ray.direction);
            }
            if is_last {
                break;
            }
            let [choice, u, v, roulette] = numbers.direction(depth);
            let Some(next) = bsdf.sample([choice, u, v]) else { break };
            // A shading normal may lead to the wrong side of the surface itself.
            if (next.direction.dot(point.geometric_normal) <= 0.0) != next.passes {
                break;
            }
            throughput *= next.weight;
            if depth >= SAFE_DEPTH {
                let goes_on = throughput.max_element().min(MOST_LIKELY_ON);
                if roulette >= goes_on {
                    break;
                }
                throughput /= goes_on;
            }
            density = next.density;
            cone = cone.after(way_m).scattered(next.alpha);
            if next.passes {
                inside = point.beyond(material, inside);
            }
            let origin = if next.passes { point.inside() } else { point.outside };
            ray = Ray { origin, direction: next.direction };
        }
        (finite(radiance), first.surface(&ray))
    }

    /// What comes from far away, weighed by how else it would have been found than by the path's last direction.
    fn sky_seen(&self, direction: Vec3A, density: Option<f32>) -> Vec3A {
        let sky = self.sky(direction);
        match (&self.surroundings, density) {
            (Some(surroundings), Some(own)) => {
                weight(own, surroundings.density(direction.normalize_or_zero())) * sky
            }
            _ => sky,
        }
    }

    /// What reaches the eye from one direction of the environment.
    fn ask_surroundings(
        &self,
        moment: &Moment,
        point: &Point,
        bsdf: &Bsdf,
        is_last: bool,
        light: Option<FromAfar>,
        stack: &mut Stack,
    ) -> Vec3A {
        let Some(light) = light else { return Vec3A::ZERO };
        let (scattered, density) = bsdf.towards(light.direction);
        if scattered == Vec3A::ZERO || light.direction.dot(point.geometric_normal) <= 0.0 {
            return Vec3A::ZERO;
        }
        let shadow_ray = Ray { origin: point.shadow_origin, direction: light.direction };
        let passes = self.passing(moment, &shadow_ray, f32::INFINITY, false, stack);
        let weight = if is_last { 1.0 } else { weight(light.density, density) };
        passes * scattered * light.radiance * (weight / light.density)
    }

    /// What reaches the eye of one point of what shines.
    fn ask_emitters(
        &self,
        moment: &Moment,
        point: &Point,
        bsdf: &Bsdf,
        is_last: bool,
        numbers: [f32; 3],
        stack: &mut Stack,
    ) -> Vec3A {
        let Some(light) = self.emitters.sample(self, moment, point.shadow_origin, numbers) else {
            return Vec3A::ZERO;
        };
        let direction = light.to_light.normalize_or_zero();
        if direction.dot(point.geometric_normal) <= 0.0 {
            return Vec3A::ZERO;
        }
        let (scattered, density) = bsdf.towards(direction);
        if scattered == Vec3A::ZERO {
            return Vec3A::ZERO;
        }
        let shadow_ray = Ray { origin: point.shadow_origin, direction: light.to_light };
        let passes = self.passing(moment, &shadow_ray, NEARLY_THERE, false, stack);
        let weight = if is_last { 1.0 } else { weight(light.density, density) };
        passes * scattered * light.radiance * (weight / light.density)
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

impl Numbers {
    fn of(request: &Request) -> Numbers {
        // The sequence has 2¹⁶ points; then another begins.
        let (index, turn) = (request.sample_index & 0xffff, request.sample_index >> 16);
        Numbers { index, seed: mixed(mixed(request.pixel) ^ turn) }
    }

    /// In [0, 1), for the direction that a path takes from the surface that it meets after `depth` others: three, and one for roulette.
    fn direction(&self, depth: u32) -> [f32; 4] {
        self.four(depth, 0)
    }

    /// For a point of what shines.
    fn light(&self, depth: u32) -> [f32; 3] {
        let [pick, s, t, _] = self.four(depth, 1);
        [pick, s, t]
    }

    /// For a direction of the environment.
    fn sky(&self, depth: u32) -> [f32; 2] {
        let [s, t, ..] = self.four(depth, 2);
        [s, t]
    }

    #[inline]
    fn four(&self, depth: u32, part: u32) -> [f32; 4] {
        // 21 surfaces have sets of their own; one set is left over, for the lens.
        const TURN: u32 = NUM_DIMENSION_SETS_4D / 3;
        let (surface, turn) = (depth % TURN, depth / TURN);
        sample_4d(self.index, 3 * surface + part, mixed(self.seed ^ turn))
    }

    /// For the ray that goes there: whether what blends is there.
    fn chance(&self, depth: u32) -> Chance {
        Chance::By(mixed(self.seed ^ mixed(self.index ^ (depth << 16))))
    }
}

/// For the place on the lens: the last set of dimensions, which no surface uses.
pub(crate) fn numbers_on_lens(request: &Request) -> [f32; 2] {
    let Numbers { index, seed } = Numbers::of(request);
    let [u, v, ..] = sample_4d(index, NUM_DIMENSION_SETS_4D - 1, seed);
    [u, v]
}

/// Every bit of the result depends on every bit of the number ("lowbias32", Wellons 2018).
pub(crate) fn mixed(mut x: u32) -> u32 {
    x ^= x >> 16;
    x = x.wrapping_mul(0x7feb_352d);
    x ^= x >> 15;
    x = x.wrapping_mul(0x846c_a68b);
    x ^ (x >> 16)
}
