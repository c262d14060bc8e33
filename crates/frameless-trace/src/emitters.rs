//! Triangles that shine, as light sources: one of them is drawn, and a point on it.
//!
//! ```text
//! p(triangle) ∝ area in the object · mean luminance          p(ω) = p(triangle) / area in the world · r² / cosθ'
//! ```
//!
//! The shares are made once, with the mean of a texture wherever on it a triangle lies: where instances are scaled they are not the best
//! ones, but always right. What is single-sided shines from its front. Spheres, and what deforms, are met by chance only.

use std::ops::Range;

use frameless_scene::{Geometry, Scene};
use glam::{Affine3A, Vec3, Vec3A};

use crate::build::corners;
use crate::patch::Patch;
use crate::texture::Encoding;
use crate::top::Placed;
use crate::world::World;

/// All shining triangles of a scene.
pub(crate) struct Emitters {
    /// In the order of `before`; those of one instance beside each other.
    triangles: Vec<Emitter>,
    /// Sum of the shares before each triangle, and of all: from 0 to 1.
    before: Vec<f32>,
    /// Per instance: where its triangles begin in `number_of`; `None` if none shines.
    first_of: Vec<Option<u32>>,
    /// Per triangle of such an instance: its number in `triangles`, if it shines.
    number_of: Vec<Option<u32>>,
    /// The instances that shine, with their ranges of `triangles`.
    shining: Vec<(u32, Range<usize>)>,
}

#[derive(Clone, Copy, Debug)]
struct Emitter {
    instance: u32,
    primitive: u32,
    /// In the object.
    corners: [Vec3A; 3],
    share: f32,
    /// Linear RGB; `None` if a texture tells.
    even: Option<Vec3A>,
    double_sided: bool,
}

/// Where they are at one moment, so that nobody who asks one has to take it there.
#[derive(Default)]
pub(crate) struct Lamps {
    /// As in [`Emitters`].
    triangles: Vec<Lamp>,
    /// Of each instance that shines: the transform that these are right for.
    places: Vec<Affine3A>,
}

/// A shining triangle in the world.
#[derive(Clone, Copy, Debug)]
struct Lamp {
    corner: Vec3A,
    /// From there to the two others.
    edges: [Vec3A; 2],
    /// Twice its area long, off its front.
    across: Vec3A,
}

impl Lamps {
    /// For another world.
    pub(crate) fn clear(&mut self) {
        self.triangles.clear();
        self.places.clear();
    }
}

impl Lamp {
    fn new(corners: [Vec3A; 3], world_from_object: &Affine3A) -> Lamp {
        let [a, b, c] = corners.map(|corner| world_from_object.transform_point3a(corner));
        let edges = [b - a, c - a];
        // Mirrored, a triangle is wound the other way.
        let side = world_from_object.matrix3.determinant().signum();
        Lamp { corner: a, edges, across: side * edges[0].cross(edges[1]) }
    }

    /// Of a point on it that is drawn with the probability `share` · dA / A, per solid angle: r² / cosθ' / A = 2 r³ / |to · across|.
    #[inline(always)]
    fn density(&self, share: f32, to: Vec3A) -> f32 {
        let r2 = to.length_squared();
        share * 2.0 * (r2 * r2.sqrt()) / to.dot(self.across).abs()
    }
}

/// Light from a point on a triangle.
#[derive(Clone, Copy, Debug)]
pub(crate) struct FromEmitter {
    /// From where it is asked to the point, in metres.
    pub(crate) to_light: Vec3A,
    /// Linear RGB.
    pub(crate) radiance: Vec3A,
    /// With which the direction is drawn, per solid angle; positive.
    pub(crate) density: f32,
}

impl Emitters {
    /// Finds them.
    pub(crate) fn new(scene: &Scene) -> Emitters {
        let means: Vec<Vec3> = scene.materials.iter().map(|m| scene.mean_radiance(m)).collect();
        let (mut triangles, mut weights) = (Vec::new(), Vec::new());
        let (mut first_of, mut number_of) = (Vec::new(), Vec::new());
        for (instance, placed) in scene.instances.iter().enumerate() {
            first_of.push(None);
            let Geometry::Mesh(mesh) = &scene.geometries[placed.geometry as usize] else {
                continue;
            };
            if scene.deformation_of(instance).is_some() {
                continue;
            }
            let of = |material: u32| means.get(material as usize).copied().unwrap_or(Vec3::ZERO);
            if mesh.triangle_materials.used().all(|material| of(material) == Vec3::ZERO) {
                continue;
            }
            let radiance = |primitive: usize| {
                mesh.triangle_materials.get(primitive).map_or(Vec3::ZERO, |&material| of(material))
            };
            first_of[instance] = Some(number_of.len() as u32);
            for primitive in 0..mesh.triangles.len() {
                let (radiance, [a, b, c]) = (radiance(primitive), corners(mesh, primitive as u32));
                let weight = luminance(radiance) * (b - a).cross(c - a).length();
                let shines = weight > 0.0 && weight.is_finite();
                number_of.push(shines.then_some(triangles.len() as u32));
                if shines {
                    let material = &scene.materials[mesh.triangle_materials[primitive] as usize];
                    triangles.push(Emitter {
                        instance: instance as u32,
                        primitive: primitive as u32,
                        corners: [a, b, c].map(Vec3A::from),
                        share: 0.0,
                        double_sided: material.double_sided,
                        even: material.emissive_texture.is_none().then(|| material.emissive.into()),
                    });
                    weights.push(f64::from(weight));
                }
            }
        }
        let total: f64 = weights.iter().sum();
        let (mut sum, mut before) = (0.0, vec![0.0]);
        for (triangle, weight) in triangles.iter_mut().zip(weights) {
            sum += weight;
            before.push((sum / total) as f32);
            triangle.share = (weight / total) as f32;
        }
        let mut shining: Vec<(u32, Range<usize>)> = Vec::new();
        for (number, triangle) in triangles.iter().enumerate() {
            match shining.last_mut() {
                Some((instance, range)) if *instance == triangle.instance => range.end += 1,
                _ => shining.push((triangle.instance, number..number + 1)),
            }
        }
        Emitters { triangles, before, first_of, number_of, shining }
    }

    /// Whether nothing shines.
    pub(crate) fn is_empty(&self) -> bool {
        self.triangles.is_empty()
    }

    /// Takes the lamps to where their instances are; those that have not moved are left alone.
    pub(crate) fn place(&self, placed: &[Placed], lamps: &mut Lamps) {
        lamps.triangles.resize(self.triangles.len(), Lamp::new([Vec3A::NAN; 3], &Affine3A::NAN));
        lamps.places.resize(self.shining.len(), Affine3A::NAN);
        for ((instance, range), place) in self.shining.iter().zip(&mut lamps.places) {
            let now = &placed[*instance as usize].world_from_object;
            if place == now {
                continue;
            }
            *place = *now;
            let triangles = self.triangles[range.clone()].iter();
            for (triangle, lamp) in triangles.zip(&mut lamps.triangles[range.clone()]) {
                *lamp = Lamp::new(triangle.corners, now);
            }
        }
    }

    /// Light from a random point, if it faces `from` at all.
    #[inline]
    pub(crate) fn sample(
        &self,
        world: &World,
        lamps: &Lamps,
        from: Vec3A,
        [u, v]: [f32; 2],
    ) -> Option<FromEmitter> {
        let index = self.before[1..].partition_point(|&up_to| up_to <= u);
        let Emitter { instance, primitive, share, even, double_sided, .. } =
            self.triangles.get(index)?;
        let lamp = &lamps.triangles[index];
        // What is left of the number that has chosen is as even as it was.
        let u = ((u - self.before[index]) / share).clamp(0.0, 1.0);
        let root = u.sqrt();
        let weights = [1.0 - root, root * (1.0 - v), root * v];
        let [edge_b, edge_c] = lamp.edges;
        let to_light = lamp.corner + weights[1] * edge_b + weights[2] * edge_c - from;
        if to_light.dot(lamp.across) > 0.0 && !double_sided {
            return None;
        }
        let density = lamp.density(*share, to_light);
        let radiance = even.unwrap_or_else(|| radiance(world, *instance, *primitive, weights));
        let light = FromEmitter { to_light, radiance, density };
        (density > 0.0 && density.is_finite()).then_some(light)
    }

    /// With which [`Emitters::sample`] would have found a point that a ray has met, per solid angle.
    #[inline]
    pub(crate) fn density_of(
        &self,
        lamps: &Lamps,
        [instance, primitive]: [u32; 2],
        to_light: Vec3A,
    ) -> f32 {
        if self.triangles.is_empty() {
            return 0.0;
        }
        let Some(first) = self.first_of[instance as usize] else { return 0.0 };
        let Some(number) = self.number_of[(first + primitive) as usize] else { return 0.0 };
        let share = self.triangles[number as usize].share;
        lamps.triangles[number as usize].density(share, to_light)
    }
}

/// What a point of a mesh's triangle gives off.
fn radiance(world: &World, instance: u32, primitive: u32, weights: [f32; 3]) -> Vec3A {
    let scene = world.scene();
    let geometry = scene.instances[instance as usize].geometry;
    let Geometry::Mesh(mesh) = &scene.geometries[geometry as usize] else { return Vec3A::ZERO };
    let material = &scene.materials[mesh.triangle_materials[primitive as usize] as usize];
    let Some(reference) = &material.emissive_texture else { return material.emissive.into() };
    let vertices = mesh.triangles[primitive as usize].map(|vertex| vertex as usize);
    let patch = Patch::Triangle { mesh, vertices, weights, footprint: 0.0 };
    let texel = patch.look_up(world, reference, Encoding::Color);
    Vec3A::from(material.emissive) * Vec3A::from_vec4(texel)
}

/// Of linear sRGB (Rec. 709).
fn luminance(rgb: Vec3) -> f32 {
    rgb.dot(Vec3::new(0.2126, 0.7152, 0.0722))
}

#[cfg(test)]
mod tests {
    use std::f32::consts::{PI, TAU};
    use std::sync::Arc;

    use frameless_scene::{Material, Transform};
    use glam::Quat;

    use super::*;
    use crate::holes::Chance;
    use crate::moment::Moment;
    use crate::ray::Ray;
    use crate::test_scenes as scenes;
    use crate::traverse::Stack;

    fn glowing(scene: &mut Scene, emissive: Vec3, double_sided: bool) -> u32 {
        scene.materials.push(Material { emissive, double_sided, ..Material::default() });
        scene.materials.len() as u32 - 1
    }

    /// A square of side 1, 1.5 above the origin, facing down.
    fn square_lamp(double_sided: bool) -> Scene {
        let mut scene = scenes::empty();
        let glow = glowing(&mut scene, Vec3::splat(2.0), double_sided);
        let down = Transform { rotation: Quat::from_rotation_x(PI), ..scenes::at(0.0, 1.5, 0.0) };
        scenes::add(&mut scene, scenes::floor(0.5, 0.0, glow), down);
        scene
    }

    fn numbers(per_side: u32) -> impl Iterator<Item = [f32; 2]> {
        let at = move |i: u32| (i as f32 + 0.5) / per_side as f32;
        (0..per_side * per_side).map(move |i| [at(i % per_side), at(i / per_side)])
    }

    /// Mean of `value` of what is drawn, with 0 where nothing is.
    fn mean(world: &World, moment: &Moment, value: impl Fn(&FromEmitter) -> f32) -> f32 {
        let draw = |u| world.emitters.sample(world, &moment.lamps, Vec3A::ZERO, u);
        numbers(256).filter_map(draw).map(|light| value(&light)).sum::<f32>() / 65_536.0
    }

    /// Solid angle of a rectangle of sides 2a and 2b, seen from its middle at distance d: 4 asin(a b / √((a² + d²)(b² + d²))).
    #[test]
    fn a_square_has_its_solid_angle_and_its_irradiance() {
        let world = World::new(Arc::new(square_lamp(false)));
        let moment = world.moment(0.0);
        let (a, d) = (0.5f32, 1.5f32);
        let solid_angle = 4.0 * (a * a / (a * a + d * d)).asin();
        let found = mean(&world, &moment, |light| 1.0 / light.density);
        assert!((found - solid_angle).abs() < 1e-3 * solid_angle, "{found}, not {solid_angle}");
        // Lambert 1760, of a parallel square of radiance 2: 2 · 4 c atan(c), c = a / √(a² + d²).
        let c = a / (a * a + d * d).sqrt();
        let irradiance = 2.0 * 4.0 * c * c.atan();
        let found = mean(&world, &moment, |light| {
            light.radiance.x * light.to_light.normalize().y / light.density
        });
        assert!((found - irradiance).abs() < 1e-3 * irradiance, "{found}, not {irradiance}");
    }

    /// Over all directions, of whatever a ray meets there: several lamps of different brightness, one of them mirrored and squeezed.
    #[test]
    fn densities_of_what_rays_meet_add_up_to_one_and_are_those_of_the_samples() {
        let mut scene = square_lamp(true);
        let bright = glowing(&mut scene, Vec3::new(9.0, 1.0, 0.0), true);
        let wall = Transform {
            translation: Vec3::new(2.0, 0.0, -0.5),
            rotation: Quat::from_rotation_z(1.2),
            scale: Vec3::new(-1.0, 1.0, 0.4),
        };
        scenes::add(&mut scene, scenes::floor(1.0, 0.0, bright), wall);
        let world = World::new(Arc::new(scene));
        let (moment, mut stack) = (world.moment(0.0), Stack::new());
        let mut density_towards = |direction: Vec3A| {
            let ray = Ray { origin: Vec3A::ZERO, direction };
            let hit = world.nearest(&moment, &ray, || Chance::Never, &mut stack)?;
            let place = [hit.instance, hit.primitive];
            Some(world.emitters.density_of(&moment.lamps, place, hit.t * direction))
        };
        const SIDE: u32 = 1500;
        let sum: f64 = numbers(SIDE)
            .filter_map(|[u, v]| {
                let (y, (sin, cos)) = (2.0 * u - 1.0, (TAU * v).sin_cos());
                let r = (1.0 - y * y).sqrt();
                density_towards(Vec3A::new(r * cos, y, r * sin)).map(f64::from)
            })
            .sum();
        let integral = sum * 4.0 * std::f64::consts::PI / f64::from(SIDE * SIDE);
        assert!((integral - 1.0).abs() < 5e-3, "{integral}");
        let mut compared = 0;
        for light in
            numbers(40).filter_map(|u| world.emitters.sample(&world, &moment.lamps, Vec3A::ZERO, u))
        {
            // Nothing of the wall is behind the lamp, or before it.
            let met = density_towards(light.to_light.normalize()).expect("it is there");
            assert!((met - light.density).abs() < 1e-3 * met, "{met} {light:?}");
            compared += 1;
        }
        assert_eq!(compared, 1600);
    }

    #[test]
    fn lamps_are_drawn_by_area_and_brightness() {
        let mut scene = square_lamp(true);
        // Four times the area, half as bright, two thirds of the light.
        let dim = glowing(&mut scene, Vec3::splat(1.0), true);
        scenes::add(&mut scene, scenes::floor(1.0, -3.0, dim), Transform::IDENTITY);
        let world = World::new(Arc::new(scene));
        let moment = world.moment(0.0);
        let below = mean(&world, &moment, |light| f32::from(u8::from(light.to_light.y < 0.0)));
        assert!((below - 2.0 / 3.0).abs() < 1e-2, "{below}");
    }

    #[test]
    fn what_is_single_sided_shines_from_its_front_also_mirrored() {
        let seen_from_origin = |double_sided, scale: Vec3| {
            let mut scene = square_lamp(double_sided);
            let node = scene.instances[0].node as usize;
            scene.nodes[node].rest.scale = scale;
            let world = World::new(Arc::new(scene));
            let moment = world.moment(0.0);
            mean(&world, &moment, |_| 1.0)
        };
        assert_eq!(seen_from_origin(false, Vec3::ONE), 1.0);
        // glTF 2.0 §3.7.4: a mirrored instance's triangles have their fronts on the other side of their winding.
        assert_eq!(seen_from_origin(false, Vec3::new(-1.0, 1.0, 1.0)), 1.0);
        assert_eq!(seen_from_origin(false, Vec3::new(1.0, -1.0, 1.0)), 0.0);
        assert_eq!(seen_from_origin(true, Vec3::new(1.0, -1.0, 1.0)), 1.0);
    }

    #[test]
    fn lamps_move_with_their_instances() {
        let mut scene = square_lamp(true);
        let other = glowing(&mut scene, Vec3::splat(1e-6), true);
        scenes::add(&mut scene, scenes::floor(1.0, -3.0, other), Transform::IDENTITY);
        let world = World::new(Arc::new(scene));
        let mut moment = world.moment(0.0);
        let height = |moment: &Moment| mean(&world, moment, |light| light.to_light.y);
        assert!((height(&moment) - 1.5).abs() < 1e-3);
        let node = world.scene().instances[0].node as usize;
        let lift = |state: &mut frameless_scene::State| {
            state.world_from_node[node].translation.y += 1.0;
        };
        world.update_moment_with(0.0, &mut moment, lift);
        assert!((height(&moment) - 2.5).abs() < 1e-3, "{}", height(&moment));
        // A moment may be used for another world.
        let dark = World::new(Arc::new(scenes::empty()));
        dark.update_moment(0.0, &mut moment);
        world.update_moment(0.0, &mut moment);
        assert!((height(&moment) - 1.5).abs() < 1e-3);
    }
}
