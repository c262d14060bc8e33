//! Triangles that shine, as light sources: one of them is drawn, and a point on it.
//!
//! ```text
//! p(triangle) ∝ area in the object · mean luminance          p(ω) = p(triangle) / area in the world · r² / cosθ'
//! ```
//!
//! The shares are made once, with the mean of a texture wherever on it a triangle lies: where instances are scaled they are not the best
//! ones, but always right. What is single-sided shines from its front. Spheres, and what deforms, are met by chance only.

use frameless_scene::{Geometry, Scene};
use glam::{Vec3, Vec3A};

use crate::build::corners;
use crate::moment::Moment;
use crate::patch::Patch;
use crate::texture::Encoding;
use crate::world::World;

/// All shining triangles of a scene.
pub(crate) struct Emitters {
    /// In the order of `up_to`.
    triangles: Vec<Emitter>,
    /// Sum of the shares up to and with each triangle; the last is 1.
    up_to: Vec<f32>,
    /// Per instance: where its triangles begin in `share_of`; `None` if none shines.
    first_of: Vec<Option<u32>>,
    /// Per triangle of such an instance.
    share_of: Vec<f32>,
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
        let (mut first_of, mut share_of) = (Vec::new(), Vec::new());
        for (instance, placed) in scene.instances.iter().enumerate() {
            first_of.push(None);
            let Geometry::Mesh(mesh) = &scene.geometries[placed.geometry as usize] else {
                continue;
            };
            if scene.deformation_of(instance).is_some() {
                continue;
            }
            let radiance = |primitive: usize| {
                let material = mesh.triangle_materials.get(primitive);
                material.and_then(|&m| means.get(m as usize)).copied().unwrap_or(Vec3::ZERO)
            };
            if (0..mesh.triangles.len()).all(|primitive| radiance(primitive) == Vec3::ZERO) {
                continue;
            }
            first_of[instance] = Some(share_of.len() as u32);
            for primitive in 0..mesh.triangles.len() {
                let (radiance, [a, b, c]) = (radiance(primitive), corners(mesh, primitive as u32));
                let weight = luminance(radiance) * (b - a).cross(c - a).length();
                share_of.push(weight);
                if weight > 0.0 && weight.is_finite() {
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
        let mut sum = 0.0;
        let up_to = weights.iter().map(|weight| {
            sum += weight;
            (sum / total) as f32
        });
        let up_to = up_to.collect();
        share_of.iter_mut().for_each(|share| {
            *share = if share.is_finite() {
                (f64::from(*share) / total.max(f64::MIN_POSITIVE)) as f32
            } else {
                0.0
            };
        });
        for Emitter { instance, primitive, share, .. } in &mut triangles {
            let first = first_of[*instance as usize].unwrap_or_default();
            *share = share_of[(first + *primitive) as usize];
        }
        Emitters { triangles, up_to, first_of, share_of }
    }

    /// Whether nothing shines.
    pub(crate) fn is_empty(&self) -> bool {
        self.triangles.is_empty()
    }

    /// Light from a random point, if it faces `from` at all.
    pub(crate) fn sample(
        &self,
        world: &World,
        moment: &Moment,
        from: Vec3A,
        [pick, u, v]: [f32; 3],
    ) -> Option<FromEmitter> {
        let index = self.up_to.partition_point(|&up_to| up_to <= pick);
        let &Emitter { instance, primitive, corners, share, even, double_sided } =
            self.triangles.get(index)?;
        let world_from_object = &moment.placed(instance).world_from_object;
        let [a, b, c] = corners.map(|corner| world_from_object.transform_point3a(corner));
        let root = u.sqrt();
        let weights = [1.0 - root, root * (1.0 - v), root * v];
        let to_light = a + weights[1] * (b - a) + weights[2] * (c - a) - from;
        // Mirrored, a triangle is wound the other way.
        let facing = -to_light.dot((b - a).cross(c - a)) * world_from_object.matrix3.determinant();
        if facing < 0.0 && !double_sided {
            return None;
        }
        let density = density(share, [a, b, c], to_light);
        let radiance = even.unwrap_or_else(|| radiance(world, instance, primitive, weights));
        let light = FromEmitter { to_light, radiance, density };
        (density > 0.0 && density.is_finite()).then_some(light)
    }

    /// With which [`Emitters::sample`] would have found a point that a ray has met, per solid angle.
    pub(crate) fn density_of(
        &self,
        world: &World,
        moment: &Moment,
        [instance, primitive]: [u32; 2],
        to_light: Vec3A,
    ) -> f32 {
        if self.triangles.is_empty() {
            return 0.0;
        }
        let Some(first) = self.first_of[instance as usize] else { return 0.0 };
        let share = self.share_of[(first + primitive) as usize];
        in_world(world, moment, instance, primitive)
            .map_or(0.0, |corners| density(share, corners, to_light))
    }
}

/// Of a triangle that is drawn with the probability `share`.
fn density(share: f32, [a, b, c]: [Vec3A; 3], to: Vec3A) -> f32 {
    let twice_area = (b - a).cross(c - a);
    // r² / cosθ' / area = 2 r³ / |to · (b − a)×(c − a)|
    let r = to.length();
    share * 2.0 * r * r * r / to.dot(twice_area).abs()
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

/// A triangle's corners now, if its instance is a mesh; as it was modelled, should the mesh deform: such are not asked.
fn in_world(world: &World, moment: &Moment, instance: u32, primitive: u32) -> Option<[Vec3A; 3]> {
    let scene = world.scene();
    let geometry = scene.instances[instance as usize].geometry;
    let Geometry::Mesh(mesh) = &scene.geometries[geometry as usize] else { return None };
    let placed = moment.placed(instance);
    Some(corners(mesh, primitive).map(|at| placed.world_from_object.transform_point3a(at.into())))
}

/// Of linear sRGB (Rec. 709).
fn luminance(rgb: Vec3) -> f32 {
    rgb.dot(Vec3::new(0.2126, 0.7152, 0.0722))
}
