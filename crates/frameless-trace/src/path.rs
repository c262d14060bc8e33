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

use crate::asking::{Patience, Then};
use crate::bsdf::Bsdf;
use crate::direct::{NoProbe, Probe, finite, sky_surface};
#[cfg(doc)]
use crate::emitters::Emitters;
use crate::first::FirstSurface;
use crate::holes::{Chance, attenuation};
use crate::integrator::Settings;
use crate::many::WAVE;
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

/// A path under way.
struct Path {
    numbers: Numbers,
    /// Where it goes.
    ray: Ray,
    cone: Cone,
    radiance: Vec3A,
    throughput: Vec3A,
    first: FirstSurface,
    /// Of the direction that the path took last; `None` where no other would have done.
    density: Option<f32>,
    /// Absorption per metre of what the path is inside, if that is known.
    inside: Option<Vec3A>,
    depth: u32,
    /// What asking the lights has taken, see [`Stack::boxes`].
    boxes: u64,
    /// Whether the camera's ray passes backs: it has met one already.
    culls: bool,
}

impl Path {
    #[inline(always)]
    fn new(ray: Ray, cone: Cone, request: &Request, settings: &Settings) -> Path {
        Path {
            numbers: Numbers::of(request),
            ray,
            cone,
            radiance: Vec3A::ZERO,
            throughput: Vec3A::ONE,
            first: FirstSurface::new(settings.surfaces),
            density: None,
            inside: None,
            depth: 0,
            boxes: 0,
            culls: false,
        }
    }

    /// How what it meets next and blends decides whether it is there.
    #[inline(always)]
    fn chance(&self) -> Chance {
        self.numbers.chance(self.depth)
    }

    #[inline(always)]
    fn seen(&self) -> ([f32; 3], Surface) {
        (finite(self.radiance), self.first.surface(&self.ray))
    }
}

impl World {
    /// What comes back along a ray whose direction has unit length, by one random path. `met`: what the ray meets first, by
    /// `first_chance`.
    #[inline(always)]
    pub(crate) fn path_radiance(
        &self,
        moment: &Moment,
        (ray, mut met, cone): (Ray, Option<Hit>, Cone),
        request: &Request,
        settings: &Settings,
        stack: &mut Stack,
        probe: &mut impl Probe,
    ) -> ([f32; 3], Surface) {
        let mut path = Path::new(ray, cone, request, settings);
        while self.bounce(moment, &mut path, met, settings, stack, probe) {
            met = match path.culls {
                false => self.nearest(moment, &path.ray, || path.chance(), stack),
                true => self.behind_back(moment, &path.ray, || path.chance(), stack),
            };
        }
        path.seen()
    }

    /// The same of at most [`WAVE`] rays, for `take` in their order: each bounce of all of them, so that many rays are under way at once.
    #[inline(always)]
    pub(crate) fn path_radiances(
        &self,
        moment: &Moment,
        (rays, first_met, cone): (&[Ray], &[Option<Hit>], Cone),
        requests: &[Request],
        settings: &Settings,
        stack: &mut Stack,
        mut take: impl FnMut(&Request, [f32; 3], Surface),
    ) {
        let begin = |(&ray, request)| Path::new(ray, cone, request, settings);
        let mut paths: Vec<Path> = rays.iter().zip(requests).map(begin).collect();
        let mut met = [None; WAVE];
        met[..rays.len()].copy_from_slice(first_met);
        // Those that go on.
        let mut going: Vec<usize> = (0..paths.len()).collect();
        let probe = &mut NoProbe;
        while !going.is_empty() {
            let mut count = 0;
            for place in 0..going.len() {
                let path = going[place];
                if self.bounce(moment, &mut paths[path], met[place], settings, stack, probe) {
                    going[count] = path;
                    count += 1;
                }
            }
            going.truncate(count);
            let mut rays = [Ray::NONE; WAVE];
            for (ray, &path) in rays.iter_mut().zip(&going) {
                *ray = paths[path].ray;
            }
            let (rays, met) = (&rays[..going.len()], &mut met[..going.len()]);
            self.nearest_of(moment, rays, |place| paths[going[place]].chance(), met, stack);
            for (&path, met) in going.iter().zip(met) {
                let path = &paths[path];
                if path.culls {
                    *met = self.behind_back(moment, &path.ray, || path.chance(), stack);
                }
            }
        }
        for (path, request) in paths.iter().zip(requests) {
            let (rgb, surface) = path.seen();
            take(request, rgb, surface);
        }
    }

    /// Adds what comes from where a path has met something, or the sky, and brings it to where it goes on; returns false if it ends.
    #[inline(always)]
    fn bounce(
        &self,
        moment: &Moment,
        path: &mut Path,
        met: Option<Hit>,
        settings: &Settings,
        stack: &mut Stack,
        probe: &mut impl Probe,
    ) -> bool {
        probe.note(|| {
            format!(
                "ray {}: from {:.5} along {:.5}",
                path.depth, path.ray.origin, path.ray.direction
            )
        });
        let Some(hit) = met else {
            let gives = path.throughput * self.sky_seen(path.ray.direction, path.density);
            probe.note(|| format!("  nothing hit: adds {gives:.6}"));
            path.radiance += gives;
            path.first.see(self, || sky_surface(&path.ray), path.throughput);
            return false;
        };
        let mut point = Point::new(self, moment, &path.ray, &hit, path.cone);
        probe.note(|| format!("  {hit:?}"));
        if path.depth == 0 && !path.culls && self.is_culled(&hit, &point) {
            probe.note(|| "  the back of what is single-sided, which the camera passes".into());
            path.culls = true;
            return true;
        }
        if path.culls {
            self.lift_onto_back(moment, (&path.ray, path.cone), &mut point, stack, probe);
        }
        let material = &self.scene().materials[point.material as usize];
        // Directions have unit length.
        let way_m = hit.t;
        path.inside = path.inside.or_else(|| point.behind(material));
        if let Some(sigma) = path.inside {
            path.throughput *= attenuation(sigma, way_m);
        }
        if material.unlit {
            // Shown, but no light for others.
            if path.density.is_none() {
                let gives = path.throughput * point.matter.base;
                probe.note(|| format!("  unlit: adds {gives:.6}"));
                path.radiance += gives;
            }
            path.first.see(self, || point.unlit(&hit), path.throughput);
            return false;
        }
        probe.note(|| describe(&point, material, path.throughput));
        let (matter, to_eye) = (&point.matter, -path.ray.direction);
        let mut bsdf = Bsdf::undivided(matter, point.normal, to_eye);
        bsdf.divide_lobes(matter, point.is_front, to_eye);
        let emissive = point.matter.emissive;
        if emissive != Vec3A::ZERO && (point.is_front || material.double_sided) {
            let place = [hit.instance, hit.primitive];
            let to_light = hit.t * path.ray.direction;
            let other = || self.emitters.density_of(&moment.lamps, place, to_light);
            let met = path.density.map_or(1.0, |own| weight(own, other()));
            let gives = met * path.throughput * emissive;
            probe.note(|| format!("  emits {emissive:.5}, weighs {met:.4}: adds {gives:.6}"));
            path.radiance += gives;
        }
        let is_last = path.depth == settings.max_depth;
        let mut scattered = Vec3A::ZERO;
        let before = stack.boxes;
        let until = before.saturating_add(self.efforts.path.saturating_sub(path.boxes));
        let then = Then::Draw(path.numbers.light(path.depth));
        let patience = Patience { stride: 1, until, then };
        let asking = (&mut *stack, patience);
        let asked = self.ask_lights(moment, &point, settings, asking, probe, |arriving| {
            scattered += bsdf.scattered(arriving.to_light) * arriving.irradiance;
        });
        path.boxes += stack.boxes - before;
        let [to_follow, to_light] = path.numbers.at_surface(path.depth);
        if !self.emitters.is_empty() {
            scattered += self.ask_emitters(moment, &point, &bsdf, is_last, to_light, stack);
        }
        if let Some(surroundings) = &self.surroundings {
            let light = surroundings.sample(path.numbers.sky(path.depth));
            scattered += self.ask_surroundings(moment, &point, &bsdf, is_last, light, stack);
        }
        let gives = path.throughput * scattered;
        probe.note(|| format!("  of lights, lamps and environment: adds {gives:.6}"));
        path.radiance += gives;
        let albedo = bsdf.albedo();
        let seen = || point.surface(&hit, albedo, asked.unhindered, asked.lit);
        path.first.see(self, seen, path.throughput);
        // Through a lens what is seen in a mirror is as blurred as if it were where its image is; it goes with the mirror.
        let wants_images = settings.surfaces && settings.lens.is_none();
        if path.depth == 0 && wants_images && bsdf.is_mirror() {
            path.first.look_into_mirror(self, moment, &hit, path.ray.direction);
        }
        if is_last {
            return false;
        }
        let Some(next) = bsdf.sample(to_follow) else { return false };
        // A shading normal may lead to the wrong side of the surface itself.
        if (next.direction.dot(point.geometric_normal) <= 0.0) != next.passes {
            return false;
        }
        path.throughput *= next.weight;
        if path.depth >= SAFE_DEPTH {
            let goes_on = path.throughput.max_element().min(MOST_LIKELY_ON);
            probe.note(|| format!("  goes on with a probability of {goes_on:.4}"));
            if path.numbers.roulette(path.depth) >= goes_on {
                return false;
            }
            path.throughput /= goes_on;
        }
        path.density = next.density;
        path.cone = path.cone.after(way_m).scattered(next.alpha);
        if next.passes {
            path.inside = point.beyond(material, path.inside);
        }
        let origin = if next.passes { point.inside() } else { point.outside };
        path.ray = Ray { origin, direction: next.direction };
        path.depth += 1;
        path.culls = false;
        true
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
        let texels = Arc::new(frameless_scene::Texels::Linear(vec![[1.0; 3]; 32]));
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
