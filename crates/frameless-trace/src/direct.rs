//! The integrator `direct`: light sources seen directly, in mirrors and through glass. Deterministic (Whitted 1980).
//!
//! L = a (emissive + matte·(o·ambient + Σ_lights E cosθ V / π) + mirrored·L(reflected) + passed·L(refracted)) + (1 − a) L(behind)
//!
//! with E the light's irradiance, V which part of it arrives (a hard shadow, lighter behind what lets light pass), o the texture of
//! occlusion, a the alpha of what blends, and the surface's [`Shares`]. Ways are followed one after the other; those that would show less
//! than 1/512 of what they lead to (behind up to four veils, all), and those after the 32nd branch, are left out.
//!
//! The camera does not see the backs of single-sided surfaces, as in viewers that rasterise. All other rays meet both sides of every
//! surface, the normal turned towards where they come from: a back that is culled would let light through walls. Two surfaces close
//! to each other are an exception, see [`crate::sheets`].

use frameless::Surface;
use frameless_scene::{AlphaMode, Material};
use glam::{Vec3, Vec3A};

use crate::asking::{Asked, Patience, Then};
use crate::first::FirstSurface;
use crate::fresnel::refracted;
use crate::holes::{Chance, attenuation, looks};
use crate::integrator::Settings;
use crate::many::SHADED;
use crate::moment::Moment;
use crate::point::Point;
use crate::ray::{Hit, Ray};
use crate::shares::{Shares, mirror_weight};
use crate::texture::Cone;
use crate::traverse::Stack;
use crate::world::World;

/// Surfaces that blend, one behind the other, before one counts as opaque.
const MOST_LAYERS: u32 = 16;
/// Ways besides the first one that a sample follows.
const MOST_BRANCHES: u32 = 32;
/// Lights that are asked for one sample, each time that one is; the first surface asks all of them in any case. Of up to 18 lights all ways have
/// all, where there are no holes. A room of mirrors with hundreds would take ten seconds for a picture.
const MOST_ASKED: u32 = 600;
/// The [effort](Asked::effort) for one sample where there are holes; that for its first surface is not counted, and the second asks in any
/// case. Then surfaces take the shadow of the one before them, and its own. Four veils before a wall need no more of four lights; 200 veils would
/// be asked 2,000 times by 18.
const MOST_EFFORT: u32 = 128;
/// Of what a way leads to, less would hardly be seen.
const LEAST_SHOWN: f32 = 1.0 / 512.0;
/// Surfaces that blend behind which all is looked at, however little of it is seen. Hair has a dozen more, of which nothing is.
const CLEAR_LAYERS: u32 = 4;

/// A surface that is shaded takes as long as so many boxes, see [`Stack::boxes`], and its [textures](looks).
const SURFACE: u64 = 50;

/// Is told what happens to a ray; see [`crate::explain`].
pub(crate) trait Probe {
    fn note(&mut self, line: impl FnOnce() -> String);
}

/// Does not listen.
pub(crate) struct NoProbe;

impl Probe for NoProbe {
    #[inline(always)]
    fn note(&mut self, _line: impl FnOnce() -> String) {}
}

/// A ray to be followed.
#[derive(Clone, Copy)]
struct Leg {
    ray: Ray,
    cone: Cone,
    /// The part of its light that is seen.
    throughput: Vec3A,
    /// Reflections and refractions before it.
    depth: u32,
    /// Surfaces that blend before it.
    layers: u32,
    /// Absorption per metre of what it is inside, if that is known.
    inside: Option<Vec3A>,
    /// The part of the lights' light that arrives where it comes from.
    lit_share: Vec3A,
    /// Whether it goes on straight from the camera.
    from_camera: bool,
    /// Whether it passes backs: it has met one already.
    culls: bool,
}

/// What comes of the rays so far.
struct Picture {
    /// The ray that is being followed.
    leg: Leg,
    radiance: Vec3A,
    first: FirstSurface,
    waiting: Vec<Leg>,
    branches: u32,
    /// Lights that have been asked.
    asked: u32,
    /// That of asking them, but for the first surface.
    effort: u32,
    /// What [`Stack::boxes`] is when the sample has to come to its end,
    until: u64,
    /// and whether it is so many.
    is_spent: bool,
}

/// What a leg has seen.
enum Seen<'a> {
    /// All there was to see is added.
    All {
        goes_on: bool,
    },
    Lit(Lit<'a>),
}

/// Of a surface that lights may reach.
struct Lit<'a> {
    material: &'a Material,
    shares: Shares,
    /// Absorption per metre of what the leg was inside on its way.
    inside: Option<Vec3A>,
    alpha: f32,
    /// The part of the light from there that is seen, were it opaque or not.
    arriving: Vec3A,
    throughput: Vec3A,
}

impl World {
    /// What a sample takes, in [boxes](Stack::boxes): its first surface, the lights that are asked there, and the rest.
    pub(crate) fn effort_of(
        &self,
        moment: &Moment,
        (ray, cone): (Ray, Cone),
        settings: &Settings,
        stack: &mut Stack,
    ) -> [u64; 3] {
        let begin = stack.boxes;
        let met = self.nearest(moment, &ray, || Chance::Never, stack);
        stack.boxes += met.as_ref().map_or(0, |hit| looks(self, hit));
        let there = stack.boxes;
        let (mut picture, probe) = (Picture::new(ray, cone, settings), &mut NoProbe);
        let goes_on = self.see(moment, &mut picture, met.as_ref(), settings, stack, probe);
        let first = stack.boxes;
        self.follow(moment, &mut picture, goes_on, settings, stack, probe);
        [there - begin + SURFACE, first - there, stack.boxes - first]
    }

    /// What comes back along a ray, which meets `met` first.
    #[inline(always)]
    pub(crate) fn radiance(
        &self,
        moment: &Moment,
        (ray, met, cone): (Ray, Option<Hit>, Cone),
        settings: &Settings,
        stack: &mut Stack,
        probe: &mut impl Probe,
    ) -> ([f32; 3], Surface) {
        let mut picture = Picture::new(ray, cone, settings);
        let goes_on = self.see(moment, &mut picture, met.as_ref(), settings, stack, probe);
        self.follow(moment, &mut picture, goes_on, settings, stack, probe);
        (finite(picture.radiance), picture.first.surface(&ray))
    }

    /// The same of at most [`SHADED`] rays, for `take` in their order; what neighbours have in common is done once.
    #[inline(always)]
    pub(crate) fn radiances(
        &self,
        moment: &Moment,
        (rays, met, cone): (&[Ray], &[Option<Hit>], Cone),
        settings: &Settings,
        stack: &mut Stack,
        mut take: impl FnMut([f32; 3], Surface),
    ) {
        let (mut points, mut facet) = ([const { None }; SHADED], None);
        for ((point, ray), met) in points.iter_mut().zip(rays).zip(met) {
            let of = |hit| Point::on(self, moment, (ray, hit, cone), &mut facet);
            *point = met.as_ref().map(of);
        }
        let mut lit = [None; SHADED];
        for ((lit, point), met) in lit.iter_mut().zip(&points).zip(met) {
            let (Some(point), Some(hit)) = (point, met) else { continue };
            let material = &self.scene().materials[point.material as usize];
            *lit = (!material.unlit && !self.is_culled(hit, point)).then_some(point);
        }
        let asked = self.ask_lights_of(moment, &lit[..rays.len()], settings, stack);
        let probe = &mut NoProbe;
        for (((point, &ray), met), asked) in points.iter().zip(rays).zip(met).zip(&asked) {
            let picture = &mut Picture::new(ray, cone, settings);
            let goes_on = if let (Some(point), Some(hit)) = (point, met) {
                let met = (hit, point);
                match self.meet(picture, met, settings, probe) {
                    Seen::All { goes_on } => goes_on,
                    Seen::Lit(lit) => {
                        picture.may_ask(moment.lights.len());
                        self.leave(moment, picture, met, (&lit, asked), settings, probe)
                    }
                }
            } else {
                self.see_sky(picture, probe)
            };
            self.follow(moment, picture, goes_on, settings, stack, probe);
            take(finite(picture.radiance), picture.first.surface(&ray));
        }
    }

    /// Adds what is seen along the leg at hand, if it goes on, and along those that wait.
    #[inline(always)]
    fn follow(
        &self,
        moment: &Moment,
        picture: &mut Picture,
        mut goes_on: bool,
        settings: &Settings,
        stack: &mut Stack,
        probe: &mut impl Probe,
    ) {
        picture.until = stack.boxes + self.efforts.direct;
        while goes_on || (stack.boxes < picture.until && picture.take_up()) {
            picture.is_spent = stack.boxes >= picture.until;
            stack.boxes += SURFACE;
            let Leg { ray, culls, .. } = picture.leg;
            let met = match culls {
                false => self.nearest(moment, &ray, || Chance::Never, stack),
                true => self.behind_back(moment, &ray, || Chance::Never, stack),
            };
            stack.boxes += met.as_ref().map_or(0, |hit| looks(self, hit));
            goes_on = self.see(moment, picture, met.as_ref(), settings, stack, probe);
        }
    }

    /// Adds what a leg sees, which ends at `met`, and brings it to where it goes on; returns false if it does not.
    #[inline(always)]
    fn see(
        &self,
        moment: &Moment,
        picture: &mut Picture,
        met: Option<&Hit>,
        settings: &Settings,
        stack: &mut Stack,
        probe: &mut impl Probe,
    ) -> bool {
        let Leg { ray, cone, depth, culls, .. } = picture.leg;
        probe.note(|| format!("ray {depth}: from {:.5} along {:.5}", ray.origin, ray.direction));
        let Some(hit) = met else { return self.see_sky(picture, probe) };
        probe.note(|| format!("  {hit:?}"));
        let mut point = Point::new(self, moment, &ray, hit, cone);
        if culls {
            self.lift_onto_back(moment, (&ray, cone), &mut point, stack, probe);
        }
        let (point, met) = (&point, (hit, &point));
        match self.meet(picture, met, settings, probe) {
            Seen::All { goes_on } => goes_on,
            Seen::Lit(lit) => {
                let asked = self.ask_for(moment, picture, point, settings, stack, probe);
                self.leave(moment, picture, met, (&lit, &asked), settings, probe)
            }
        }
    }

    /// What the lights give to a point that the leg has met, as far as this sample may still ask.
    #[inline(always)]
    fn ask_for(
        &self,
        moment: &Moment,
        picture: &mut Picture,
        point: &Point,
        settings: &Settings,
        stack: &mut Stack,
        probe: &mut impl Probe,
    ) -> Asked {
        let is_first = picture.asked == 0;
        if !picture.may_ask(moment.lights.len()) {
            return Asked::NOBODY;
        }
        if self.has_holes && !picture.may_strain(moment.lights.len()) {
            let share = picture.leg.lit_share;
            probe.note(|| format!("  {share:.3} of all lights is taken to arrive"));
            stack.boxes += moment.lights.len() as u64;
            return World::assume_lights(moment, point, settings, share);
        }
        let then = Then::Assume(picture.leg.lit_share);
        // As those of many samples at once are.
        let stride = if is_first { self.efforts.stride } else { 1 };
        let patience = Patience { stride, until: picture.until, then };
        let asked = self.ask_lights(moment, point, settings, (stack, patience), probe, |_| ());
        if !is_first {
            picture.effort += asked.effort;
        }
        asked
    }

    /// Adds what a leg sees of the point that it has met, if that needs no light. Else it is for [`World::leave`].
    #[inline(always)]
    fn meet<'a>(
        &'a self,
        picture: &mut Picture,
        (hit, point): (&Hit, &Point),
        settings: &Settings,
        probe: &mut impl Probe,
    ) -> Seen<'a> {
        let leg = &mut picture.leg;
        let depth = leg.depth;
        if leg.from_camera && !leg.culls && self.is_culled(hit, point) {
            probe.note(|| "  the back of what is single-sided, which the camera passes".to_owned());
            leg.culls = true;
            return Seen::All { goes_on: true };
        }
        let material = &self.scene().materials[point.material as usize];
        let inside = leg.inside.or_else(|| point.behind(material));
        let arriving = match inside {
            None => leg.throughput,
            Some(sigma) => leg.throughput * attenuation(sigma, leg.way_m(hit)),
        };
        let is_last = picture.is_spent;
        let alpha = if leg.layers < MOST_LAYERS && !is_last { point.matter.alpha } else { 1.0 };
        let throughput = alpha * arriving;
        if material.unlit {
            let gives = throughput * point.matter.base;
            probe.note(|| format!("  unlit, throughput {throughput:.5}: adds {gives:.6}"));
            leg.throughput = (1.0 - alpha) * arriving;
            let goes_on = leg.throughput != Vec3A::ZERO && leg.go_through(point, leg.way_m(hit));
            picture.radiance += gives;
            picture.see(self, alpha, || point.unlit(hit), throughput);
            return Seen::All { goes_on };
        }
        let goes_on = depth < settings.max_depth && !is_last;
        let shares = Shares::of(point, -leg.ray.direction, goes_on);
        probe.note(|| describe(point, material, &shares));
        Seen::Lit(Lit { material, shares, inside, alpha, arriving, throughput })
    }

    /// Adds what a surface that lights may reach shows, and brings the leg to where it goes on; returns false if it does not.
    #[inline(always)]
    fn leave(
        &self,
        moment: &Moment,
        picture: &mut Picture,
        (hit, point): (&Hit, &Point),
        (lit, asked): (&Lit<'_>, &Asked),
        settings: &Settings,
        probe: &mut impl Probe,
    ) -> bool {
        let &Lit { material, ref shares, inside, alpha, arriving, throughput } = lit;
        let Leg { ray, depth, layers, lit_share, .. } = picture.leg;
        picture.leg.lit_share = asked.share(lit_share);
        // Of what is seen behind a veil or through glass, only this part belongs to the surface.
        let veil = if depth == 0 { throughput } else { Vec3A::ONE };
        let emissive = point.matter.emissive;
        let ambient = point.matter.occlusion * self.ambient(point.normal);
        let gives = throughput * (emissive + shares.matte * (ambient + asked.all));
        probe.note(|| format!("  ambient {ambient:.5} per albedo; emits {emissive:.5}"));
        probe.note(|| {
            let albedo = shares.matte;
            format!("  albedo {albedo:.5}, throughput {throughput:.5}: adds {gives:.6}")
        });
        picture.radiance += gives;
        let seen = || point.surface(hit, veil * shares.matte, asked.unhindered, asked.lit);
        picture.see(self, alpha, seen, throughput);
        if depth == 0 && layers == 0 && settings.surfaces {
            picture.first.look_into_mirror(self, moment, hit, ray.direction);
        }
        let mirrored = throughput * shares.mirrored;
        if alpha < 1.0 || shares.passed != Vec3A::ZERO {
            let behind = (1.0 - alpha) * arriving;
            let ways = [behind, throughput * shares.passed, mirrored];
            return picture.branch((hit, point, material), ways, inside);
        }
        let leg = &mut picture.leg;
        leg.throughput = mirrored;
        mirrored != Vec3A::ZERO && leg.go_back(point, inside, leg.way_m(hit))
    }

    /// Adds what is far away, where a leg ends.
    #[inline(always)]
    fn see_sky(&self, picture: &mut Picture, probe: &mut impl Probe) -> bool {
        let Leg { ray, throughput, .. } = picture.leg;
        let sky = self.sky(ray.direction);
        let gives = throughput * sky;
        probe.note(|| {
            format!("  nothing hit: sky {sky:.5}, throughput {throughput:.5}: adds {gives:.6}")
        });
        picture.radiance += gives;
        picture.see(self, 1.0, || sky_surface(&ray), throughput);
        false
    }
}

impl Picture {
    #[inline(always)]
    fn new(ray: Ray, cone: Cone, settings: &Settings) -> Picture {
        let (leg, first) = (Leg::from_camera(ray, cone), FirstSurface::new(settings.surfaces));
        let (radiance, waiting) = (Vec3A::ZERO, Vec::new());
        Picture {
            leg,
            radiance,
            first,
            waiting,
            branches: 0,
            asked: 0,
            effort: 0,
            until: u64::MAX,
            is_spent: false,
        }
    }

    /// Takes note that so many lights are asked, if they may be.
    #[inline(always)]
    fn may_ask(&mut self, lights: usize) -> bool {
        let all = self.asked.saturating_add(lights as u32);
        let may = self.asked == 0 || all <= MOST_ASKED;
        if may {
            self.asked = all;
        }
        may
    }

    /// Whether there is effort left to ask so many lights once more.
    #[inline(always)]
    fn may_strain(&self, lights: usize) -> bool {
        self.effort == 0 || self.effort.saturating_add(lights as u32) <= MOST_EFFORT
    }

    /// Told of every surface. A veil of which less than half is there leaves the sample to what is behind.
    #[inline(always)]
    fn see(&mut self, world: &World, alpha: f32, seen: impl FnOnce() -> Surface, part: Vec3A) {
        if alpha >= 0.5 {
            self.first.see(world, seen, part);
        }
    }

    /// Divides a way: straight on, through the surface, and back from it, with these parts of the light. The first of them that there is
    /// is followed next, the others later.
    #[inline(never)]
    fn branch(
        &mut self,
        (hit, point, material): (&Hit, &Point, &Material),
        [behind, passed, mirrored]: [Vec3A; 3],
        inside: Option<Vec3A>,
    ) -> bool {
        let (leg, way_m) = (self.leg, self.leg.way_m(hit));
        let with = |throughput: Vec3A, go: &dyn Fn(&mut Leg) -> bool| {
            let mut way = Leg { throughput, ..leg };
            (throughput != Vec3A::ZERO && go(&mut way)).then_some(way)
        };
        let is_lost = leg.layers >= CLEAR_LAYERS && behind.max_element() < LEAST_SHOWN;
        let behind = with(behind, &|leg| !is_lost && leg.go_through(point, way_m));
        let passed = with(passed, &|leg| leg.go_in(point, material, way_m));
        let mirrored = with(mirrored, &|leg| leg.go_back(point, inside, way_m));
        let mut legs = [behind, passed, mirrored].into_iter().flatten();
        let Some(next) = legs.next() else { return false };
        for later in legs {
            let is_seen = later.throughput.max_element() >= LEAST_SHOWN;
            if is_seen && self.branches < MOST_BRANCHES {
                self.branches += 1;
                self.waiting.push(later);
            }
        }
        self.leg = next;
        true
    }

    /// Whether there is another way to be followed, which is then the leg at hand.
    #[inline(always)]
    fn take_up(&mut self) -> bool {
        match self.waiting.pop() {
            None => false,
            Some(waiting) => {
                self.leg = waiting;
                true
            }
        }
    }
}

impl Leg {
    #[inline(always)]
    fn from_camera(ray: Ray, cone: Cone) -> Leg {
        let (throughput, lit_share) = (Vec3A::ONE, Vec3A::ONE);
        let (depth, layers, inside, from_camera, culls) = (0, 0, None, true, false);
        Leg { ray, cone, throughput, depth, layers, inside, lit_share, from_camera, culls }
    }

    /// To where it hits.
    #[inline(always)]
    fn way_m(&self, hit: &Hit) -> f32 {
        hit.t * self.ray.direction.length()
    }

    /// Straight on, behind a surface that blends.
    fn go_through(&mut self, point: &Point, way_m: f32) -> bool {
        self.ray.origin = point.inside();
        self.cone = self.cone.after(way_m);
        self.layers += 1;
        // What is behind faces the same way, as a rule: its light has passed here.
        self.lit_share *= 1.0 - point.matter.alpha;
        self.culls = false;
        true
    }

    /// Into the surface, or out of it; false where all is reflected.
    fn go_in(&mut self, point: &Point, material: &Material, way_m: f32) -> bool {
        let Some(layers) = &point.matter.layers else { return false };
        let to_eye = -self.ray.direction.normalize_or_zero();
        let mut direction = -to_eye;
        if layers.refracts {
            let eta = if point.is_front { 1.0 / layers.ior } else { layers.ior };
            let Some(bent) = refracted(to_eye, point.normal, eta) else { return false };
            // A shading normal may lead out again.
            if bent.dot(point.geometric_normal) < 0.0 {
                direction = bent;
            }
        }
        self.inside = point.beyond(material, self.inside);
        self.ray = Ray { origin: point.inside(), direction };
        self.cone = self.cone.after(way_m);
        self.depth += 1;
        (self.from_camera, self.culls) = (false, false);
        true
    }

    /// Mirrored.
    #[inline(always)]
    fn go_back(&mut self, point: &Point, inside: Option<Vec3A>, way_m: f32) -> bool {
        self.ray = Ray { origin: point.outside, direction: reflect(self.ray.direction, point) };
        self.cone = self.cone.after(way_m);
        self.depth += 1;
        self.inside = inside;
        (self.from_camera, self.culls) = (false, false);
        true
    }
}

impl Point {
    /// Absorption per metre of what a ray comes out of that meets the surface from behind.
    #[inline(always)]
    pub(crate) fn behind(&self, material: &Material) -> Option<Vec3A> {
        if self.is_front || self.matter.layers.is_none() {
            return None;
        }
        let layers = material.layers.as_ref()?;
        let volume = layers.volume.filter(|_| layers.transmission > 0.0)?;
        Some(volume.absorption_per_m.into())
    }

    /// The same of what a ray is in that has passed the surface and was in `inside` before.
    pub(crate) fn beyond(&self, material: &Material, inside: Option<Vec3A>) -> Option<Vec3A> {
        match material.layers.as_ref().and_then(|layers| layers.volume) {
            None => inside,
            Some(volume) => self.is_front.then_some(volume.absorption_per_m.into()),
        }
    }

    /// What a sample says of a point of constant colour.
    pub(crate) fn unlit(&self, hit: &Hit) -> Surface {
        self.surface(hit, Vec3A::ZERO, Vec3A::ZERO, u32::MAX)
    }
}

pub(crate) fn sky_surface(ray: &Ray) -> Surface {
    Surface {
        object: Surface::SKY,
        primitive: 0,
        position: ray.direction.to_array(),
        normal: (-ray.direction).to_array(),
        albedo: [0.0; 3],
        direct: [0.0; 3],
        lit: u32::MAX,
    }
}

/// r = d − 2(d·n)n; where that would go into the surface, about the triangle's own normal.
fn reflect(direction: Vec3A, point: &Point) -> Vec3A {
    let about = |normal: Vec3A| direction - 2.0 * direction.dot(normal) * normal;
    let reflected = about(point.normal);
    if reflected.dot(point.geometric_normal) > 0.0 {
        reflected
    } else {
        about(point.geometric_normal)
    }
}

/// Radiance as promised: what is not a number becomes black, what is beyond all reason so bright that sums of it are still numbers.
#[inline(always)]
pub(crate) fn finite(radiance: Vec3A) -> [f32; 3] {
    const BRIGHTEST: f32 = 1e30;
    // Of a number and one that is none the maximum is the number.
    radiance.max(Vec3A::ZERO).min(Vec3A::splat(BRIGHTEST)).to_array()
}

/// Whether the material reflects and does nothing else, wherever on it.
pub(crate) fn is_pure_mirror(material: &Material) -> bool {
    mirror_weight(material.metallic, material.roughness) == 1.0
        && material.metallic_roughness_texture.is_none()
        && material.normal_texture.is_none()
        && material.emissive == Vec3::ZERO
        && material.alpha_mode == AlphaMode::Opaque
        && !material.unlit
        && material.layers.is_none()
}

fn describe(point: &Point, material: &Material, shares: &Shares) -> String {
    let matter = &point.matter;
    format!(
        "  at {:.5} (in the object {:.5}), normal {:.5}\n  material {} \"{}\", base colour {:.5}, alpha {:.3}, metallic {:.3}, \
         roughness {:.3}: mirrored {:.3}, passed {:.3}, emissive {:.5}",
        point.position,
        point.local_position,
        point.normal,
        point.material,
        material.name,
        matter.base,
        matter.alpha,
        matter.metallic,
        matter.roughness,
        shares.mirrored,
        shares.passed,
        matter.emissive,
    )
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use glam::Vec4;

    use super::*;
    use crate::test_scenes as scenes;

    /// Counts the rays to lights.
    #[derive(Default)]
    struct Counts {
        rays: usize,
    }

    impl Probe for Counts {
        fn note(&mut self, line: impl FnOnce() -> String) {
            self.rays += usize::from(line().contains("of it passes"));
        }
    }

    const ALPHA: f32 = 0.05;

    /// What is seen of white veils over a black floor, under lights far above, and how many rays to lights that takes.
    fn seen_through(veils: u32, lights: u32) -> (f32, usize) {
        let mut scene = scenes::empty();
        let black = scenes::add_material(&mut scene, Vec3::ZERO, 0.0, 1.0);
        scene.materials.push(Material {
            base_color: Vec4::new(1.0, 1.0, 1.0, ALPHA),
            alpha_mode: AlphaMode::Blend,
            double_sided: true,
            ..Material::default()
        });
        scenes::add(&mut scene, scenes::floor(9.0, -1.0, black), scenes::at(0.0, 0.0, 0.0));
        for k in 0..veils {
            let place = scenes::at(0.0, 1e-3 * k as f32, 0.0);
            scenes::add(&mut scene, scenes::floor(9.0, 0.0, black + 1), place);
        }
        for _ in 0..lights {
            scenes::add_point_light(&mut scene, Vec3::new(0.0, 1e3, 0.0), 1e6);
        }
        let (world, mut stack) = (World::new(Arc::new(scene)), Stack::new());
        let moment = world.moment(0.0);
        let ray = Ray { origin: Vec3A::new(0.1, 5.0, 0.2), direction: Vec3A::NEG_Y };
        let met = world.nearest(&moment, &ray, || Chance::Never, &mut stack);
        let (sample, mut counts) = ((ray, met, Cone::default()), Counts::default());
        let settings = Settings::default();
        let (seen, _) = world.radiance(&moment, sample, &settings, &mut stack, &mut counts);
        (seen[0], counts.rays)
    }

    /// Per light Σ a (1 − a)²ᵏ / π: as far to the eye as from the light.
    fn known(veils: i32) -> f32 {
        let part = |k| ALPHA * (1.0 - ALPHA).powi(2 * k) * std::f32::consts::FRAC_1_PI;
        (0..veils).map(part).sum()
    }

    #[test]
    fn few_veils_have_the_shadows_of_few_lights() {
        for (veils, lights) in [(1, 1), (4, 1), (1, 4), (4, 4)] {
            let (seen, rays) = seen_through(veils, lights);
            // The floor asks, too.
            assert_eq!(rays as u32, (veils + 1) * lights);
            let want = lights as f32 * known(veils as i32);
            assert!((seen / want - 1.0).abs() < 0.01, "{veils}, {lights}: {seen}, {want}");
        }
    }

    #[test]
    fn many_veils_take_the_shadows_of_those_before_them() {
        // The first asks, then those that pass one, two and three veils: 18 · (2 + 3 + 4) is too much for another.
        let (seen, rays) = seen_through(15, 18);
        assert_eq!(rays, 4 * 18);
        let want = 18.0 * known(15);
        assert!((seen / want - 1.0).abs() < 0.01, "{seen}, {want}");
    }

    #[test]
    fn the_first_surface_asks_all_lights_and_the_others_what_is_left() {
        let picture = || Picture::new(Ray::NONE, Cone::default(), &Settings::default());
        let mut many = picture();
        assert!(many.may_ask(100_000));
        assert!(!many.may_ask(1));
        let mut few = picture();
        // 33 ways: as many as there are.
        assert!((0..=MOST_BRANCHES).all(|_| few.may_ask(18)));
        let mut some = picture();
        let asked = (0..=MOST_BRANCHES).filter(|_| some.may_ask(100)).count();
        assert_eq!(asked, 6);
    }
}
