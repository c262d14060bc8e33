//! The point that a ray hit: where it is, which way it faces, what it is made of.

use frameless::Surface;
use frameless_scene::{Deformed, Geometry, Mesh};
use glam::{Vec3A, Vec4};

use crate::matter::Matter;
use crate::moment::Moment;
use crate::patch::Patch;
use crate::ray::{Hit, Ray};
use crate::sphere;
use crate::tangent::{self, Triangle};
use crate::texture::Cone;
use crate::top::Placed;
use crate::world::World;

/// A point on a surface, seen from one side: both normals are on the side of the ray.
#[derive(Clone, Debug)]
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
    /// Whether the front is seen.
    pub(crate) is_front: bool,
    /// Hit point in the object's coordinates.
    pub(crate) local_position: Vec3A,
    /// What finds the point again, see [`frameless::Surface::position`]: barycentric weights if the object deforms, else
    /// `local_position`.
    pub(crate) anchor: Vec3A,
    /// Shading normal in the object's coordinates, of any length.
    pub(crate) local_normal: Vec3A,
    /// What the material says here.
    pub(crate) matter: Matter,
    /// Index into the scene's materials.
    pub(crate) material: u32,
}

/// A point before the object's transform. Normals on the ray's side, of any length; may be zero.
struct Local<'a> {
    position: Vec3A,
    anchor: Vec3A,
    shadow_origin: Vec3A,
    geometric_normal: Vec3A,
    normal: Vec3A,
    /// No coordinate that went into `position` is larger; rounding errors are in proportion to it.
    extent: Vec3A,
    /// Where textures are looked up; its footprint is not known yet.
    patch: Patch<'a>,
    triangle: Option<Triangle>,
    is_front: bool,
    /// Linear RGBA of the vertices.
    color: Vec4,
    material: u32,
}

impl Point {
    /// Where rays begin that go through the surface: as far on its other side as [`Point::outside`] is on this.
    #[inline(always)]
    pub(crate) fn inside(&self) -> Vec3A {
        2.0 * self.position - self.outside
    }

    /// What a sample says of the point; `per_albedo`: the direct light that a white surface would send back.
    pub(crate) fn surface(&self, hit: &Hit, albedo: Vec3A, per_albedo: Vec3A, lit: u32) -> Surface {
        Surface {
            object: hit.instance,
            primitive: hit.primitive,
            position: self.anchor.to_array(),
            normal: self.local_normal.try_normalize().unwrap_or(Vec3A::Y).to_array(),
            albedo: albedo.to_array(),
            direct: (albedo * per_albedo).to_array(),
            lit,
        }
    }

    /// Where `ray` has met something. `cone`: how wide it is where it begins.
    #[inline(always)]
    pub(crate) fn new(world: &World, moment: &Moment, ray: &Ray, hit: &Hit, cone: Cone) -> Point {
        let placed = moment.placed(hit.instance);
        let mut local = local(world, moment, placed, ray, hit);
        let number = local.material as usize;
        let material = &world.scene().materials[number];
        if world.is_plain[number] {
            let matter = Matter::plain(world, material, &local.patch, local.color);
            return into_world(ray, placed, &local, matter);
        }
        Point::elaborate(world, placed, (ray, hit, cone), &mut local)
    }

    /// The same for all materials, out of the way of those that are plain.
    #[inline(never)]
    fn elaborate(
        world: &World,
        placed: &Placed,
        (ray, hit, cone): (&Ray, &Hit, Cone),
        local: &mut Local<'_>,
    ) -> Point {
        let material = &world.scene().materials[local.material as usize];
        let way_m = hit.t * ray.direction.length();
        local.take_footprint(placed, cone.after(way_m).width_m, ray.direction);
        let matter = Matter::new(world, material, &local.patch, local.color);
        let mut point = into_world(ray, placed, local, matter);
        let coat = material.layers.as_ref().and_then(|layers| layers.clearcoat_normal_texture);
        let coat_normal = coat.map_or(point.normal, |map| bend(world, map, placed, local, &point));
        if let Some(layers) = &mut point.matter.layers {
            layers.coat_normal = coat_normal;
        }
        if let Some(map) = material.normal_texture {
            let normal = bend(world, map, placed, local, &point);
            let of_object = placed.world_from_object.matrix3.transpose() * normal;
            point.normal = normal;
            point.local_normal = of_object.try_normalize().unwrap_or(point.local_normal);
        }
        point
    }
}

/// What a hit needs to be known of to tell whether it is one: less than a [`Point`].
pub(crate) struct Placement<'a> {
    pub(crate) patch: Patch<'a>,
    /// Linear RGBA of the vertices.
    pub(crate) color: Vec4,
    pub(crate) is_front: bool,
    /// Of the angle to the triangle's normal.
    pub(crate) cosine: f32,
}

impl<'a> Placement<'a> {
    pub(crate) fn new(world: &'a World, moment: &Moment, ray: &Ray, hit: &Hit) -> Placement<'a> {
        let placed = moment.placed(hit.instance);
        let local = local(world, moment, placed, ray, hit);
        let normal = placed.object_from_world.matrix3.transpose() * local.geometric_normal;
        let cosine = -normal.normalize_or_zero().dot(ray.direction.normalize_or_zero());
        let Local { patch, color, is_front, .. } = local;
        Placement { patch, color, is_front, cosine }
    }
}

/// A point's normal, bent by a map.
fn bend(
    world: &World,
    map: (frameless_scene::TextureRef, f32),
    placed: &Placed,
    local: &Local<'_>,
    point: &Point,
) -> Vec3A {
    let Some(triangle) = &local.triangle else { return point.normal };
    let bent = tangent::bent(world, map, (&local.patch, triangle), placed, point.normal);
    tangent::above(bent, point.geometric_normal)
}

#[inline(always)]
fn local<'a>(
    world: &'a World,
    moment: &Moment,
    placed: &Placed,
    ray: &Ray,
    hit: &Hit,
) -> Local<'a> {
    let scene = world.scene();
    let geometry = scene.instances[hit.instance as usize].geometry;
    let local_ray = ray.transformed(&placed.object_from_world);
    match &scene.geometries[geometry as usize] {
        Geometry::Mesh(mesh) => match moment.deforming(placed) {
            None => on_mesh(mesh, &Rigid(mesh), &local_ray, hit),
            Some(deforming) => {
                let mut local = on_mesh(mesh, deforming.now(), &local_ray, hit);
                local.anchor = weights(hit).into();
                if let Some(triangle) = &mut local.triangle {
                    triangle.deforms = true;
                }
                local
            }
        },
        Geometry::Sphere { material } => on_sphere(*material, &local_ray, hit.t),
    }
}

impl Local<'_> {
    /// `width_m`: of the cone where it hits; `direction`: of the ray in the world.
    fn take_footprint(&mut self, placed: &Placed, width_m: f32, direction: Vec3A) {
        let (Some(triangle), Patch::Triangle { footprint, .. }) = (&self.triangle, &mut self.patch)
        else {
            return;
        };
        let [a, b, c] = triangle.corners;
        let matrix = &placed.world_from_object.matrix3;
        let twice_area = (*matrix * (b - a)).cross(*matrix * (c - a));
        // |n·d| A for a direction of length one.
        let facing = twice_area.dot(direction.normalize_or_zero());
        *footprint = width_m * width_m / facing.abs();
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

fn on_sphere<'a>(material: u32, ray: &Ray, t: f32) -> Local<'a> {
    // Back onto the sphere: t is relative to a ray that may come from far away.
    let position = (ray.origin + t * ray.direction).normalize_or_zero();
    let is_front = position.dot(ray.direction) <= 0.0;
    let normal = if is_front { position } else { -position };
    Local {
        position,
        anchor: position,
        shadow_origin: position,
        geometric_normal: normal,
        normal,
        extent: Vec3A::ONE,
        patch: Patch::Sphere { uv: sphere::texture_coordinates(position) },
        triangle: None,
        is_front,
        color: Vec4::ONE,
        material,
    }
}

#[inline(always)]
fn on_mesh<'a>(mesh: &'a Mesh, now: &impl Vertices, ray: &Ray, hit: &Hit) -> Local<'a> {
    let index = hit.primitive as usize;
    let material = mesh.triangle_materials[index];
    let vertices = mesh.triangles[index].map(|vertex| vertex as usize);
    let corners = vertices.map(|vertex| now.position(vertex));
    let [a, b, c] = corners;
    let weights = weights(hit);
    let position = blend(weights, corners);
    let winding_normal = (b - a).cross(c - a);
    let is_front = winding_normal.dot(ray.direction) <= 0.0;
    let geometric_normal = if is_front { winding_normal } else { -winding_normal };
    let (normal, shadow_origin) = match vertices.map(|vertex| now.normal(vertex)) {
        [Some(a), Some(b), Some(c)] => {
            let normals = [a, b, c].map(|normal| facing(normal, geometric_normal));
            (blend(weights, normals), on_smooth_surface(position, weights, corners, normals))
        }
        _ => (geometric_normal, position),
    };
    Local {
        position,
        anchor: position,
        shadow_origin,
        geometric_normal,
        normal,
        extent: a.abs().max(b.abs()).max(c.abs()),
        patch: Patch::Triangle { mesh, vertices, weights, footprint: 0.0 },
        triangle: Some(Triangle { index, corners, is_front, deforms: false }),
        is_front,
        color: vertex_color(now, vertices, weights),
        material,
    }
}

/// Linear RGBA; white of a mesh without colours.
#[inline(always)]
fn vertex_color(now: &impl Vertices, vertices: [usize; 3], weights: [f32; 3]) -> Vec4 {
    let colors = now.colors();
    if colors.is_empty() {
        return Vec4::ONE;
    }
    let [a, b, c] = vertices.map(|vertex| Vec4::max(colors[vertex], Vec4::ZERO));
    weights[0] * a + weights[1] * b + weights[2] * c
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

#[inline(always)]
fn into_world(ray: &Ray, placed: &Placed, local: &Local<'_>, matter: Matter) -> Point {
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
        is_front: local.is_front,
        local_position: local.position,
        anchor: local.anchor,
        local_normal,
        matter,
        material: local.material,
    }
}
