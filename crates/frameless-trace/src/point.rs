//! The point that a ray hit: where it is, which way it faces, what it is made of.

use frameless::Surface;
use frameless_scene::{Deformed, Geometry, Material, Mesh};
use glam::{Vec2, Vec3A, Vec4};

use crate::moment::Moment;
use crate::ray::{Hit, Ray};
use crate::sphere;
use crate::texture;
use crate::top::Placed;
use crate::world::World;

/// A point on a surface, seen from one side: both normals are on the side of the ray.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Point {
    /// World coordinates.
    pub(crate) position: Vec3A,
    /// Where the mirrored ray begins: on the ray's side, outside the surface by a little more than rounding errors.
    pub(crate) outside: Vec3A,
    /// Where shadow rays begin: as `outside`, but off the smooth surface that the shading normals describe.
    pub(crate) shadow_origin: Vec3A,
    /// Unit normal of the triangle, world coordinates.
    pub(crate) geometric_normal: Vec3A,
    /// Unit normal for shading, world coordinates; within 90° of the geometric one.
    pub(crate) normal: Vec3A,
    /// Hit point in the object's coordinates.
    pub(crate) local_position: Vec3A,
    /// What finds the point again, see [`frameless::Surface::position`]: barycentric weights if the object deforms, else
    /// `local_position`.
    pub(crate) anchor: Vec3A,
    /// Unit shading normal in the object's coordinates.
    pub(crate) local_normal: Vec3A,
    /// Texture coordinates, where the material has a texture.
    pub(crate) uv: [f32; 2],
    /// Linear RGB base colour: factor · texture · vertex colour.
    pub(crate) base: Vec3A,
    /// Index into the scene's materials.
    pub(crate) material: u32,
}

/// A point before the object's transform. Normals on the ray's side, of any length; may be zero.
struct Local {
    position: Vec3A,
    anchor: Vec3A,
    shadow_origin: Vec3A,
    geometric_normal: Vec3A,
    normal: Vec3A,
    /// No coordinate that went into `position` is larger; rounding errors are in proportion to it.
    extent: Vec3A,
    uv: [f32; 2],
    color: Vec3A,
    material: u32,
}

impl Point {
    /// What a sample says of the point; `per_albedo`: the direct light that a white surface would send back.
    pub(crate) fn surface(&self, hit: &Hit, albedo: Vec3A, per_albedo: Vec3A, lit: u32) -> Surface {
        Surface {
            object: hit.instance,
            primitive: hit.primitive,
            position: self.anchor.to_array(),
            normal: self.local_normal.to_array(),
            albedo: albedo.to_array(),
            direct: (albedo * per_albedo).to_array(),
            lit,
        }
    }

    #[inline]
    pub(crate) fn new(world: &World, moment: &Moment, ray: &Ray, hit: &Hit) -> Point {
        let scene = world.scene();
        let geometry = scene.instances[hit.instance as usize].geometry;
        let placed = moment.placed(hit.instance);
        let local_ray = ray.transformed(&placed.object_from_world);
        let local = match &scene.geometries[geometry as usize] {
            Geometry::Mesh(mesh) => {
                let materials = &scene.materials;
                match moment.deforming(placed) {
                    None => on_mesh(mesh, &Rigid(mesh), materials, &local_ray, hit),
                    Some(deforming) => {
                        let local = on_mesh(mesh, deforming.now(), materials, &local_ray, hit);
                        Local { anchor: weights(hit).into(), ..local }
                    }
                }
            }
            Geometry::Sphere { material } => on_sphere(*material, &local_ray, hit.t),
        };
        let material = &scene.materials[local.material as usize];
        let base =
            Vec3A::from_vec4(material.base_color) * local.color * texel(world, material, local.uv);
        into_world(ray, placed, &local, base)
    }
}

/// What of a mesh may deform.
trait Vertices {
    fn position(&self, vertex: usize) -> Vec3A;
    /// `None` if the mesh has no normals.
    fn normal(&self, vertex: usize) -> Option<Vec3A>;
    fn colors(&self) -> &[Vec4];
}

struct Rigid<'a>(&'a Mesh);

impl Vertices for Rigid<'_> {
    #[inline(always)]
    fn position(&self, vertex: usize) -> Vec3A {
        self.0.positions[vertex].into()
    }

    #[inline(always)]
    fn normal(&self, vertex: usize) -> Option<Vec3A> {
        self.0.normals.get(vertex).map(|&normal| normal.into())
    }

    #[inline(always)]
    fn colors(&self) -> &[Vec4] {
        &self.0.colors
    }
}

impl Vertices for Deformed {
    #[inline(always)]
    fn position(&self, vertex: usize) -> Vec3A {
        self.positions()[vertex]
    }

    #[inline(always)]
    fn normal(&self, vertex: usize) -> Option<Vec3A> {
        self.normals().get(vertex).copied()
    }

    #[inline(always)]
    fn colors(&self) -> &[Vec4] {
        self.colors()
    }
}

/// Of the triangle's three vertices.
#[inline(always)]
fn weights(hit: &Hit) -> [f32; 3] {
    let [v, w] = hit.barycentric;
    [1.0 - v - w, v, w]
}

fn texel(world: &World, material: &Material, uv: [f32; 2]) -> Vec3A {
    let Some(reference) = material.base_color_texture else { return Vec3A::ONE };
    let scene = world.scene();
    let texture = &scene.textures[reference.texture as usize];
    let image = &scene.images[texture.image as usize];
    texture::look_up(texture, image, &world.linear_from_srgb, uv)
}

fn on_sphere(material: u32, ray: &Ray, t: f32) -> Local {
    // Back onto the sphere: t is relative to a ray that may come from far away.
    let position = (ray.origin + t * ray.direction).normalize_or_zero();
    let normal = if position.dot(ray.direction) > 0.0 { -position } else { position };
    Local {
        position,
        anchor: position,
        shadow_origin: position,
        geometric_normal: normal,
        normal,
        extent: Vec3A::ONE,
        uv: sphere::texture_coordinates(position),
        color: Vec3A::ONE,
        material,
    }
}

#[inline]
fn on_mesh(
    mesh: &Mesh,
    now: &impl Vertices,
    materials: &[Material],
    ray: &Ray,
    hit: &Hit,
) -> Local {
    let material = mesh.triangle_materials[hit.primitive as usize];
    let vertices = mesh.triangles[hit.primitive as usize].map(|vertex| vertex as usize);
    let corners = vertices.map(|vertex| now.position(vertex));
    let [a, b, c] = corners;
    let weights = weights(hit);
    let position = blend(weights, corners);
    let winding_normal = (b - a).cross(c - a);
    let geometric_normal = facing(winding_normal, -ray.direction);
    let (normal, shadow_origin) = match vertices.map(|vertex| now.normal(vertex)) {
        [Some(a), Some(b), Some(c)] => {
            let normals = [a, b, c].map(|normal| facing(normal, geometric_normal));
            (blend(weights, normals), on_smooth_surface(position, weights, corners, normals))
        }
        _ => (geometric_normal, position),
    };
    let uv = match materials[material as usize].base_color_texture {
        Some(reference) if !mesh.uvs[reference.uv_set as usize].is_empty() => {
            let uvs = &mesh.uvs[reference.uv_set as usize];
            let [a, b, c] = vertices.map(|vertex| uvs[vertex]);
            (weights[0] * a + weights[1] * b + weights[2] * c).to_array()
        }
        _ => Vec2::ZERO.to_array(),
    };
    let color = if now.colors().is_empty() {
        Vec3A::ONE
    } else {
        blend(
            weights,
            vertices.map(|vertex| Vec3A::from_vec4(Vec4::max(now.colors()[vertex], Vec4::ZERO))),
        )
    };
    let extent = a.abs().max(b.abs()).max(c.abs());
    Local {
        position,
        anchor: position,
        shadow_origin,
        geometric_normal,
        normal,
        extent,
        uv,
        color,
        material,
    }
}

#[inline(always)]
fn blend(weights: [f32; 3], values: [Vec3A; 3]) -> Vec3A {
    weights[0] * values[0] + weights[1] * values[1] + weights[2] * values[2]
}

/// `normal` or its opposite, whichever is on the side of `direction`.
#[inline(always)]
fn facing(normal: Vec3A, direction: Vec3A) -> Vec3A {
    if normal.dot(direction) < 0.0 { -normal } else { normal }
}

/// The point moved out to the smooth surface: p' = Σ wᵢ (p − min(0, (p − vᵢ)·nᵢ) nᵢ), so that a coarse mesh does not
/// shadow itself where its shading normals already face the light (Hanika 2021, "Hacking the Shadow Terminator", Ray
/// Tracing Gems II, ch. 4).
#[inline]
fn on_smooth_surface(
    p: Vec3A,
    weights: [f32; 3],
    corners: [Vec3A; 3],
    normals: [Vec3A; 3],
) -> Vec3A {
    let mut moved = p;
    for k in 0..3 {
        let below = (p - corners[k]).dot(normals[k]).min(0.0);
        moved -= weights[k] * below * normals[k];
    }
    moved
}

/// Rounding of a position is bounded by a small multiple of ε times the numbers that went into it (Wächter & Binder
/// 2019, "A Fast and Robust Method for Avoiding Self-Intersection", Ray Tracing Gems, ch. 6).
///
/// Differs from the paper: the bound follows the instance's transform, |M| · extent + |translation|, instead of the world
/// position's exponent, so that it also holds for an object that its transform brings close to the origin. 64 covers
/// interpolation, the way to the world and the way back with an inverted matrix; at 10 m it is 0.08 mm.
const OFFSET: f32 = 64.0 * f32::EPSILON;

#[inline]
fn into_world(ray: &Ray, placed: &Placed, local: &Local, base: Vec3A) -> Point {
    let m = &placed.world_from_object;
    // Normals transform with the inverse's transpose.
    let normal_from_local = placed.object_from_world.matrix3.transpose();
    let towards_viewer = -ray.direction;
    let geometric_normal = (normal_from_local * local.geometric_normal)
        .try_normalize()
        .unwrap_or_else(|| towards_viewer.normalize_or_zero());
    let mut normal = (normal_from_local * local.normal).try_normalize().unwrap_or(geometric_normal);
    let mut local_normal = local.normal;
    if normal.dot(geometric_normal) < 0.0 {
        normal = -normal;
        local_normal = -local_normal;
    }
    let extent = m.matrix3.abs() * local.extent + m.translation.abs();
    let outwards = geometric_normal * (OFFSET * extent.max_element());
    let position = m.transform_point3a(local.position);
    Point {
        position,
        outside: position + outwards,
        shadow_origin: m.transform_point3a(local.shadow_origin) + outwards,
        geometric_normal,
        normal,
        local_position: local.position,
        anchor: local.anchor,
        local_normal: local_normal.try_normalize().unwrap_or(Vec3A::Y),
        uv: local.uv,
        base,
        material: local.material,
    }
}
