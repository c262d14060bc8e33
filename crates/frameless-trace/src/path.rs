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
//! The same request has the same [`Numbers`], and so the same answer.

use frameless::{Request, Surface};
use frameless_scene::Material;
use glam::Vec3A;

use crate::bsdf::Bsdf;
use crate::direct::{Probe, finite, sky_surface};
#[cfg(doc)]
use crate::emitters::Emitters;
use crate::first::FirstSurface;
use crate::holes::attenuation;
use crate::integrator::Settings;
use crate::moment::Moment;
use crate::numbers::Numbers;
use crate::point::Point;
use crate::ray::{Hit, Ray};
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
    /// What comes back along a ray whose direction has unit length, by one random path. `met`: what the ray meets first, by
    /// `first_chance`.
    #[inline(always)]
    pub(crate) fn path_radiance(
        &self,
        moment: &Moment,
        (mut ray, mut met, mut cone): (Ray, Option<Hit>, Cone),
        request: &Request,
        settings: &Settings,
        stack: &mut Stack,
        probe: &mut impl Probe,
    ) -> ([f32; 3], Surface) {
        let numbers = Numbers::of(request);
        let (mut radiance, mut throughput) = (Vec3A::ZERO, Vec3A::ONE);
        let mut first = FirstSurface::new(settings.surfaces);
        // Of the direction that the path took last; `None` where no other would have done.
        let mut density = None;
        // Absorption per metre of what the path is inside, if that is known.
        let mut inside = None;
        let mut depth = 0;
        // Whether the camera's ray passes backs: it has met one already.
        let mut culls = false;
        loop {
            probe
                .note(|| format!("ray {depth}: from {:.5} along {:.5}", ray.origin, ray.direction));
            let Some(hit) = met else {
                let gives = throughput * self.sky_seen(ray.direction, density);
                probe.note(|| format!("  nothing hit: adds {gives:.6}"));
                radiance += gives;
                first.see(self, || sky_surface(&ray), throughput);
                break;
            };
            let mut point = Point::new(self, moment, &ray, &hit, cone);
            probe.note(|| format!("  {hit:?}"));
            if depth == 0 && !culls && self.is_culled(&hit, &point) {
                probe.note(|| "  the back of what is single-sided, which the camera passes".into());
                culls = true;
                met = self.behind_back(moment, &ray, || numbers.chance(depth), stack);
                continue;
            }
            if culls {
                self.lift_onto_back(moment, (&ray, cone), &mut point, stack, probe);
            }
            let material = &self.scene().materials[point.material as usize];
            // Directions have unit length.
            let way_m = hit.t;
            inside = inside.or_else(|| point.behind(material));
            if let Some(sigma) = inside {
                throughput *= attenuation(sigma, way_m);
            }
            if material.unlit {
                // Shown, but no light for others.
                if density.is_none() {
                    let gives = throughput * point.matter.base;
                    probe.note(|| format!("  unlit: adds {gives:.6}"));
                    radiance += gives;
                }
                first.see(self, || point.unlit(&hit), throughput);
                break;
            }
            probe.note(|| describe(&point, material, throughput));
            let (matter, to_eye) = (&point.matter, -ray.direction);
            let mut bsdf = Bsdf::undivided(matter, point.normal, to_eye);
            bsdf.divide_lobes(matter, point.is_front, to_eye);
            let emissive = point.matter.emissive;
            if emissive != Vec3A::ZERO && (point.is_front || material.double_sided) {
                let place = [hit.instance, hit.primitive];
                let to_light = hit.t * ray.direction;
                let other = || self.emitters.density_of(&moment.lamps, place, to_light);
                let met = density.map_or(1.0, |own| weight(own, other()));
                let gives = met * throughput * emissive;
                probe.note(|| format!("  emits {emissive:.5}, weighs {met:.4}: adds {gives:.6}"));
                radiance += gives;
            }
            let is_last = depth == settings.max_depth;
            let mut scattered = Vec3A::ZERO;
            let asked = self.ask_lights(moment, &point, settings, stack, probe, |arriving| {
                scattered += bsdf.scattered(arriving.to_light) * arriving.irradiance;
            });
            let [to_follow, to_light] = numbers.at_surface(depth);
            if !self.emitters.is_empty() {
                scattered += self.ask_emitters(moment, &point, &bsdf, is_last, to_light, stack);
            }
            if let Some(surroundings) = &self.surroundings {
                let light = surroundings.sample(numbers.sky(depth));
                scattered += self.ask_surroundings(moment, &point, &bsdf, is_last, light, stack);
            }
            let gives = throughput * scattered;
            probe.note(|| format!("  of lights, lamps and environment: adds {gives:.6}"));
            radiance += gives;
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
            let Some(next) = bsdf.sample(to_follow) else { break };
            // A shading normal may lead to the wrong side of the surface itself.
            if (next.direction.dot(point.geometric_normal) <= 0.0) != next.passes {
                break;
            }
            throughput *= next.weight;
            if depth >= SAFE_DEPTH {
                let goes_on = throughput.max_element().min(MOST_LIKELY_ON);
                probe.note(|| format!("  goes on with a probability of {goes_on:.4}"));
                if numbers.roulette(depth) >= goes_on {
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
            depth += 1;
            culls = false;
            met = self.nearest(moment, &ray, || numbers.chance(depth), stack);
        }
        (finite(radiance), first.surface(&ray))
    }

    /// What comes from far away, weighed by how else it would have been found than by the path's last direction.
    #[inline(always)]
    fn sky_seen(&self, direction: Vec3A, density: Option<f32>) -> Vec3A {
        let sky = self.sky_along(direction);
        match (&self.surroundings, density) {
            (Some(surroundings), Some(own)) => weight(own, surroundings.density(direction)) * sky,
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
    #[inline(always)]
    fn ask_emitters(
        &self,
        moment: &Moment,
        point: &Point,
        bsdf: &Bsdf,
        is_last: bool,
        numbers: [f32; 2],
        stack: &mut Stack,
    ) -> Vec3A {
        let Some(light) = self.emitters.sample(self, &moment.lamps, point.shadow_origin, numbers)
        else {
            return Vec3A::ZERO;
        };
        if light.to_light.dot(point.geometric_normal) <= 0.0 {
            return Vec3A::ZERO;
        }
        // It has a length: its density is finite.
        let direction = light.to_light * light.to_light.length_recip();
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

fn describe(point: &Point, material: &Material, throughput: Vec3A) -> String {
    let matter = &point.matter;
    format!(
        "  at {:.5}, normal {:.5}, seen from its {}, throughput {throughput:.5}\n  material {} \"{}\", base colour {:.5}, metallic \
         {:.3}, roughness {:.3}",
        point.position,
        point.normal,
        if point.is_front { "front" } else { "back" },
        point.material,
        material.name,
        matter.base,
        matter.metallic,
        matter.roughness,
    )
}

/// Of a finding that had this density, and in another way would have had the other.
fn weight(own: f32, other: f32) -> f32 {
    own / (own + other)
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use frameless::Size;
    use frameless_scene::{Geometry, Material, Scene, Transform};
    use glam::{Vec3, Vec4};

    use super::*;
    use crate::test_scenes::{self as scenes, CAMERA};
    use crate::{Integrator, Still, render_still, thread_pool};

    /// Mean of what is seen with paths that end after so many surfaces.
    fn mean(scene: Scene, max_depth: u32, samples: u32) -> Vec3 {
        let world = World::new(Arc::new(scene));
        let settings =
            Settings { integrator: Integrator::Path, max_depth, lens: None, surfaces: false };
        let (secs, view, size) = (0.0, CAMERA, Size::new(8, 8));
        let still = Still { secs, view, size, settings, samples, first_sample: 0 };
        let picture = render_still(&world, &still, &thread_pool(1), || ());
        picture.iter().copied().map(Vec3::from).sum::<Vec3>() / picture.len() as f32
    }

    /// A closed room around the camera whose walls glow.
    fn room(albedo: f32, glows: f32) -> Scene {
        let mut scene = scenes::empty();
        scene.materials.push(Material {
            base_color: Vec3::splat(albedo).extend(1.0),
            emissive: Vec3::splat(glows),
            specular: 0.0,
            double_sided: true,
            ..Material::default()
        });
        let room = Transform { scale: Vec3::new(9.0, 7.0, 8.0), ..Transform::IDENTITY };
        scenes::add(&mut scene, scenes::triangle_sphere(8, 12, 0), room);
        scene
    }

    /// e Σ ρᵏ up to k = max_depth + 1: the last surface asks for light once more. Roulette begins after the fourth: it must change nothing.
    #[test]
    fn every_surface_adds_its_bounce_and_roulette_takes_none_away() {
        for (albedo, max_depth) in [(0.5f32, 0), (0.5, 1), (0.8, 2), (0.8, 3), (0.5, 8), (0.9, 8)] {
            let want: f32 = (0..=max_depth + 1).map(|k| 0.3 * albedo.powi(k as i32)).sum();
            let got = mean(room(albedo, 0.3), max_depth, 4096).x;
            assert!((got - want).abs() < 0.01 * want, "{albedo}, {max_depth}: {got}, not {want}");
        }
    }

    #[test]
    fn ways_to_find_the_same_light_weigh_one_together() {
        for (own, other) in [(1.0, 1.0), (1e-6, 3.0), (7.5, 0.0), (1e20, 1.0)] {
            assert_eq!(weight(own, other) + weight(other, own), 1.0);
        }
    }

    /// A matte white body in a white sky cannot be seen, whether the sky is asked for its light or only met.
    #[test]
    fn a_white_furnace_is_white() {
        let mut scene = scenes::empty();
        scene.sky = [Vec3::ONE; 2];
        let (base_color, specular) = (Vec4::ONE, 0.0);
        scene.materials.push(Material { base_color, specular, ..Material::default() });
        scenes::add(&mut scene, Geometry::Sphere { material: 0 }, scenes::at(0.0, 0.0, 0.0));
        let met = mean(scene.clone(), 1000, 64);
        assert!((met - 1.0).abs().max_element() < 1e-4, "{met}");
        let texels = Arc::new(vec![[1.0; 3]; 32]);
        let (width, height, rotation_rad, strength) = (8, 4, 0.0, 1.0);
        let name = String::new();
        scene.environment = Some(frameless_scene::Environment {
            name,
            width,
            height,
            texels,
            rotation_rad,
            strength,
        });
        let asked = mean(scene, 1000, 4096);
        assert!((asked - 1.0).abs().max_element() < 0.01, "{asked}");
    }

    /// A path's last surface finds light by asking alone; what is behind a corner it cannot ask for.
    #[test]
    fn what_does_not_glow_and_is_not_lit_is_black() {
        assert_eq!(mean(room(0.8, 0.0), 8, 16), Vec3::ZERO);
    }
}
