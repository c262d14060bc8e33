//! Rays through what has holes: masked texels, surfaces that blend with what is behind them, glass.
//!
//! Asked from within the walk through a mesh's tree, and only of meshes that [may have holes](may_have_holes): all others are as fast as
//! if there were none.

use frameless_scene::{AlphaMode, Geometry, Material, Mesh, Scene};
use glam::Vec3A;

use crate::fresnel::Dielectric;
use crate::many::{Occluded, SHADED};
use crate::matter::{Matter, coverage};
use crate::moment::Moment;
use crate::numbers::{self, mixed};
use crate::point::{Placement, Point, looked_at};
use crate::ray::{Hit, Ray};
use crate::sift::Sieve;
use crate::top::{Shape, Targets};
use crate::traverse::Stack;
use crate::world::World;

/// Holes that a ray is asked about; whatever it meets beyond them is there. Woods have a hundred leaves behind each other: a file with
/// thousands would take seconds for each picture.
const MOST_ASKED: u32 = 256;
/// The same of a ray to a light: so many of all rays from one point, but of each no fewer than the first and no more than the second.
const MOST_ASKED_OF_LIGHTS: u32 = 512;
const ASKED_OF_LIGHT: [u32; 2] = [4, 128];
/// A hole that is asked about takes as long as so many boxes, for a look-up in a texture; one in glass as so many of these, and so
/// many more for each texture, most of whose texels are far apart in memory.
const HOLE: u64 = 8;
const GLASS: u32 = 3;
const TEXTURE: u32 = 2;

/// How a surface that blends decides whether it is there.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Chance {
    /// It is, unless it is wholly transparent: whoever asks goes on behind it.
    Never,
    /// With its alpha as the probability. The same number, surface and triangle always have the same answer.
    By(u32),
}

/// Whether rays may pass a mesh's triangles.
pub(crate) fn may_have_holes(scene: &Scene, mesh: &Mesh) -> bool {
    let lets_pass = |material: &Material| {
        let is_whole = material.base_color.w >= 1.0
            && material.base_color_texture.is_none()
            && mesh.colors.is_empty();
        let is_clear = material.layers.as_ref().is_some_and(|layers| layers.transmission > 0.0);
        is_clear
            || match material.alpha_mode {
                AlphaMode::Opaque => false,
                AlphaMode::Blend => !is_whole,
                AlphaMode::Mask { cutoff } => !is_whole || cutoff > 1.0,
            }
    };
    let lets_pass: Vec<bool> = scene.materials.iter().map(lets_pass).collect();
    mesh.triangle_materials.used().any(|m| lets_pass.get(m as usize) == Some(&true))
}

impl World {
    /// The nearest hit along a ray that is there.
    #[inline(always)]
    pub(crate) fn nearest(
        &self,
        moment: &Moment,
        ray: &Ray,
        chance: impl FnOnce() -> Chance,
        stack: &mut Stack,
    ) -> Option<Hit> {
        if self.has_holes {
            return self.nearest_through(moment, ray, (chance(), false), stack);
        }
        moment.targets(self).closest(ray, stack)
    }

    /// What [`World::nearest`] says of each of many rays. `chance`: of the ray with that index.
    #[inline(always)]
    pub(crate) fn nearest_of(
        &self,
        moment: &Moment,
        rays: &[Ray],
        chance: impl Fn(usize) -> Chance,
        found: &mut [Option<Hit>],
        stack: &mut Stack,
    ) {
        moment.targets(self).closest_of(rays, found, stack);
        if !self.has_holes {
            return;
        }
        for (index, (ray, found)) in rays.iter().zip(found).enumerate() {
            // What is nearest of all is so of what is there, if it is there.
            if let Some(hit) = found
                && moment.placed(hit.instance).has_holes
            {
                let (chance, culls) = (chance(index), false);
                let mut holes =
                    Holes { world: self, moment, ray, chance, culls, asked: 0, counted: 0 };
                if !holes.stops(hit) {
                    *found = self.nearest_through(moment, ray, (chance, culls), stack);
                }
            }
        }
    }

    /// Whether the camera does not see what it has hit, but what is [behind](World::behind_back).
    #[inline(always)]
    pub(crate) fn is_culled(&self, hit: &Hit, point: &Point) -> bool {
        !point.is_front && has_no_back(self, hit)
    }

    /// What a camera's ray meets that passes backs: seldom asked, since whoever looks at a closed body from outside meets its front first.
    #[cold]
    pub(crate) fn behind_back(
        &self,
        moment: &Moment,
        ray: &Ray,
        chance: impl FnOnce() -> Chance,
        stack: &mut Stack,
    ) -> Option<Hit> {
        self.nearest_through(moment, ray, (chance(), true), stack)
    }

    #[inline(never)]
    fn nearest_through(
        &self,
        moment: &Moment,
        ray: &Ray,
        (chance, culls): (Chance, bool),
        stack: &mut Stack,
    ) -> Option<Hit> {
        let mut holes = Holes { world: self, moment, ray, chance, culls, asked: 0, counted: 0 };
        let found = moment.targets(self).closest_through(ray, &mut holes, stack);
        stack.boxes += HOLE * u64::from(holes.counted);
        found
    }

    /// Which part of the light reaches a ray's origin from its point at `t_max`. Glass lets it pass, straight on, if `through_glass`.
    #[inline(always)]
    pub(crate) fn passing(
        &self,
        moment: &Moment,
        ray: &Ray,
        t_max: f32,
        through_glass: bool,
        stack: &mut Stack,
    ) -> Vec3A {
        self.passing_counted(moment, (ray, t_max), through_glass, stack).0
    }

    /// The same, and how many holes it passes if any of it does: in whichever order they are met, that is the same number.
    #[inline(always)]
    pub(crate) fn passing_counted(
        &self,
        moment: &Moment,
        way: (&Ray, f32),
        through_glass: bool,
        stack: &mut Stack,
    ) -> (Vec3A, u32) {
        self.passing_targets(moment, &moment.targets(self), way, through_glass, stack)
    }

    /// What [`World::passing`] says of each of at most [`SHADED`] rays, through glass.
    #[inline(always)]
    pub(crate) fn passing_of(
        &self,
        moment: &Moment,
        rays: &[Ray],
        t_max: f32,
        stack: &mut Stack,
    ) -> [Vec3A; SHADED] {
        let all = moment.targets(self);
        let asks = |instance: u32| moment.placed(instance).has_holes;
        let Occluded { blocked, passed, is_all } = all.occluded_of((rays, t_max), asks, stack);
        let rest = Targets { standing: None, ..all };
        let mut passes = [Vec3A::ZERO; SHADED];
        for (index, (ray, passes)) in rays.iter().zip(&mut passes).enumerate() {
            let has = |rays: u64| rays >> index & 1 != 0;
            if has(blocked) {
                continue;
            }
            *passes = match has(passed) {
                true if has(is_all) => Vec3A::ONE,
                true => self.passing_targets(moment, &rest, (ray, t_max), true, stack).0,
                false => self.passing_targets(moment, &all, (ray, t_max), true, stack).0,
            };
        }
        passes
    }

    #[inline(always)]
    fn passing_targets(
        &self,
        moment: &Moment,
        targets: &Targets<'_>,
        (ray, t_max): (&Ray, f32),
        through_glass: bool,
        stack: &mut Stack,
    ) -> (Vec3A, u32) {
        if self.has_holes {
            return self.passing_holes(moment, targets, (ray, t_max), through_glass, stack);
        }
        let is_shaded = targets.occluded(ray, t_max, stack);
        (if is_shaded { Vec3A::ZERO } else { Vec3A::ONE }, 0)
    }

    #[inline(never)]
    fn passing_holes(
        &self,
        moment: &Moment,
        targets: &Targets<'_>,
        (ray, t_max): (&Ray, f32),
        through_glass: bool,
        stack: &mut Stack,
    ) -> (Vec3A, u32) {
        let (lights, [least, most]) = (moment.lights.len() as u32, ASKED_OF_LIGHT);
        let may_ask = (MOST_ASKED_OF_LIGHTS / lights.max(1)).clamp(least, most);
        let mut shade = Shade {
            world: self,
            moment,
            ray,
            through_glass,
            left: may_ask,
            counted: 0,
            passes: Vec3A::ONE,
            depth: Vec3A::ZERO,
            inside: Vec3A::ZERO,
        };
        let is_shaded = targets.occluded_through(ray, t_max, &mut shade, stack);
        stack.boxes += HOLE * u64::from(shade.counted);
        if is_shaded {
            return (Vec3A::ZERO, 0);
        }
        (shade.result(t_max), may_ask - shade.left)
    }
}

/// What a camera's or a path's ray meets.
struct Holes<'a> {
    world: &'a World,
    moment: &'a Moment,
    ray: &'a Ray,
    chance: Chance,
    /// Whether the backs of single-sided triangles are not there.
    culls: bool,
    /// How often it has been asked about a hole.
    asked: u32,
    /// Of those that are in [`Stack::boxes`].
    counted: u32,
}

impl Sieve for Holes<'_> {
    fn is_for_all(&self) -> bool {
        self.culls
    }

    fn stops(&mut self, hit: &Hit) -> bool {
        let Some((mesh, material)) = surface(self.world, hit) else { return true };
        let asks_side = self.culls && has_no_back(self.world, hit);
        if material.alpha_mode == AlphaMode::Opaque && !asks_side {
            return true;
        }
        if self.asked == MOST_ASKED {
            return true;
        }
        self.asked += 1;
        self.counted += u32::from(counts(self.moment, hit));
        if asks_side && !Placement::new(self.world, self.moment, self.ray, hit).is_front {
            return false;
        }
        let (patch, color) = looked_at(self.moment, mesh, hit);
        let coverage = coverage(self.world, material, &patch, color);
        match (material.alpha_mode, self.chance) {
            (AlphaMode::Blend, Chance::By(number)) => unit(number, hit) < coverage,
            _ => coverage > 0.0,
        }
    }
}

/// Whether a hole is in [`Stack::boxes`]: of a mesh that deforms the price is.
fn counts(moment: &Moment, hit: &Hit) -> bool {
    !matches!(moment.placed(hit.instance).shape, Shape::Deforming(_))
}

/// What is on the way of light.
struct Shade<'a> {
    world: &'a World,
    moment: &'a Moment,
    ray: &'a Ray,
    through_glass: bool,
    /// How often it may be asked about a hole.
    left: u32,
    /// How often it has been asked about one that is in [`Stack::boxes`].
    counted: u32,
    passes: Vec3A,
    /// Σ σ · way in what encloses, of leaving minus entering it: in whichever order they are met.
    depth: Vec3A,
    /// Σ σ of what is entered and not left.
    inside: Vec3A,
}

impl Sieve for Shade<'_> {
    fn is_for_all(&self) -> bool {
        false
    }

    fn stops(&mut self, hit: &Hit) -> bool {
        let Some((mesh, number)) = made_of(self.world, hit) else { return true };
        let material = &self.world.scene().materials[number];
        let is_clear = material.layers.as_ref().is_some_and(|layers| layers.transmission > 0.0);
        let lets_pass = self.through_glass && is_clear;
        if material.alpha_mode == AlphaMode::Opaque && !lets_pass {
            return true;
        }
        if self.left == 0 {
            return true;
        }
        self.left -= 1;
        let (patch, color) = looked_at(self.moment, mesh, hit);
        let coverage = coverage(self.world, material, &patch, color);
        if counts(self.moment, hit) {
            self.counted +=
                if lets_pass { GLASS + TEXTURE * self.world.textures[number] } else { 1 };
        }
        let through = if lets_pass && coverage > 0.0 {
            let place = Placement::new(self.world, self.moment, self.ray, hit);
            self.glass(material, &place, hit)
        } else {
            Vec3A::ZERO
        };
        self.passes *= Vec3A::splat(1.0 - coverage) + coverage * through;
        self.passes == Vec3A::ZERO
    }
}

impl Shade<'_> {
    /// What a clear surface lets pass.
    fn glass(&mut self, material: &Material, place: &Placement<'_>, hit: &Hit) -> Vec3A {
        let matter = Matter::new(self.world, material, &place.patch, place.color);
        let Some(layers) = &matter.layers else { return Vec3A::ZERO };
        let volume = material.layers.as_ref().and_then(|layers| layers.volume);
        let sigma = volume.map_or(Vec3A::ZERO, |volume| volume.absorption_per_m.into());
        let sign = if place.is_front { -1.0 } else { 1.0 };
        self.depth += sign * hit.t * sigma;
        self.inside -= sign * sigma;
        let fresnel = Dielectric::new(&matter).reflectance(place.cosine);
        let clear = layers.transmission * (1.0 - matter.metallic) * (1.0 - fresnel.max_element());
        clear * matter.base
    }

    fn result(&self, t_max: f32) -> Vec3A {
        if self.depth == Vec3A::ZERO && self.inside == Vec3A::ZERO {
            return self.passes;
        }
        let still_inside = if t_max.is_finite() { t_max } else { 0.0 };
        let depth = self.depth + still_inside * self.inside.max(Vec3A::ZERO);
        let metres = self.ray.direction.length();
        self.passes * attenuation(depth, metres)
    }
}

/// e^(−σ · way), at most 1.
pub(crate) fn attenuation(sigma: Vec3A, way_m: f32) -> Vec3A {
    let depth = (sigma * way_m).max(Vec3A::ZERO);
    // 0 · ∞: what absorbs nothing.
    Vec3A::from_array((-depth).to_array().map(|x| if x.is_nan() { 1.0 } else { x.exp() }))
}

/// Whether the camera passes the surface from behind. The back of what encloses a volume is the way out of it, which is seen whatever the
/// file says.
pub(crate) fn has_no_back(world: &World, hit: &Hit) -> bool {
    let encloses = |material: &Material| {
        let layers = material.layers.as_ref();
        layers.is_some_and(|layers| layers.volume.is_some() && layers.transmission > 0.0)
    };
    surface(world, hit).is_some_and(|(_, material)| !material.double_sided && !encloses(material))
}

/// `None` for spheres, which have no holes and no backs.
fn surface<'a>(world: &'a World, hit: &Hit) -> Option<(&'a Mesh, &'a Material)> {
    let (mesh, number) = made_of(world, hit)?;
    Some((mesh, &world.scene().materials[number]))
}

/// With the material's number.
fn made_of<'a>(world: &'a World, hit: &Hit) -> Option<(&'a Mesh, usize)> {
    let scene = world.scene();
    let geometry = scene.instances[hit.instance as usize].geometry;
    match &scene.geometries[geometry as usize] {
        Geometry::Sphere { .. } => None,
        Geometry::Mesh(mesh) => {
            Some((mesh, mesh.triangle_materials[hit.primitive as usize] as usize))
        }
    }
}

/// What a surface takes to be shaded, in [boxes](Stack::boxes), besides what all do: its textures.
pub(crate) fn looks(world: &World, hit: &Hit) -> u64 {
    made_of(world, hit).map_or(0, |(_, number)| HOLE * u64::from(TEXTURE * world.textures[number]))
}

/// In [0, 1), by a number and a triangle.
fn unit(number: u32, hit: &Hit) -> f32 {
    numbers::unit(mixed(number ^ mixed(hit.instance ^ mixed(hit.primitive))))
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use frameless_scene::Layers;
    use glam::{Vec3, Vec4};

    use super::*;
    use crate::integrator::Settings;
    use crate::test_scenes as scenes;
    use crate::texture::Cone;

    /// Masked sheets of which nothing is there, above a floor, which is the first instance.
    fn sheets(count: u32) -> World {
        let mut scene = scenes::empty();
        let solid = scenes::add_material(&mut scene, Vec3::ONE, 0.0, 1.0);
        scene.materials.push(Material {
            base_color: Vec4::ONE,
            alpha_mode: AlphaMode::Mask { cutoff: 2.0 },
            double_sided: true,
            ..Material::default()
        });
        scenes::add(&mut scene, scenes::floor(1.0, -1.0, solid), scenes::at(0.0, 0.0, 0.0));
        for k in 0..count {
            let place = scenes::at(0.0, 1e-3 * k as f32, 0.0);
            scenes::add(&mut scene, scenes::floor(1.0, 0.0, solid + 1), place);
        }
        World::new(Arc::new(scene))
    }

    /// Light goes through a pane of glass, and a ray mirrored by it.
    #[test]
    fn textures_are_in_what_a_sample_takes() {
        let mut scene = scenes::empty();
        let layers = Layers { transmission: 0.9, ..Layers::default() };
        scene.materials.push(Material {
            double_sided: true,
            layers: Some(Box::new(layers)),
            ..Material::default()
        });
        scenes::add(&mut scene, scenes::floor(1.0, 0.0, 0), scenes::at(0.0, 0.0, 0.0));
        let mut world = World::new(Arc::new(scene));
        let moment = world.moment(0.0);
        let ray = Ray { origin: Vec3A::new(0.1, 1.0, 0.2), direction: Vec3A::NEG_Y };
        let took = |world: &World| {
            let stack = &mut Stack::new();
            let passes = world.passing(&moment, &ray, 2.0, true, stack);
            assert_ne!(passes, Vec3A::ZERO);
            let light = stack.boxes;
            let cone = Cone { width_m: 0.0, spread: 0.0 };
            let seen = world.effort_of(&moment, (ray, cone), &Settings::default(), stack);
            [light, seen[0]]
        };
        let [light, seen] = took(&world);
        world.textures = vec![14];
        assert_eq!(took(&world), [light, seen].map(|boxes| boxes + 14 * HOLE * u64::from(TEXTURE)));
    }

    #[test]
    fn a_ray_passes_so_many_holes_and_no_more() {
        let ray = Ray { origin: Vec3A::new(0.1, 5.0, 0.2), direction: Vec3A::NEG_Y };
        for (count, nearest_passes, light_passes) in
            [(100, true, true), (200, true, false), (300, false, false)]
        {
            let (world, mut stack) = (sheets(count), Stack::new());
            let moment = world.moment(0.0);
            let hit = world.nearest(&moment, &ray, || Chance::Never, &mut stack).expect("a floor");
            assert_eq!(hit.instance == 0, nearest_passes, "{count}: {hit:?}");
            // To just above the floor.
            let passes = world.passing(&moment, &ray, 5.9, true, &mut stack);
            assert_eq!(passes == Vec3A::ONE, light_passes, "{count}: {passes}");
        }
    }
}
