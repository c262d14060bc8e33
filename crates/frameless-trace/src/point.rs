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

/// A point before the object's transform. Normals on the ray's side.
struct Local<'a> {
    position: Vec3A,
    anchor: Vec3A,
    shadow_origin: Vec3A,
    /// Unit length, in the world; `None` where it has no direction there.
    unit_normal: Option<Vec3A>,
    /// For shading, of any length; may be zero.
    normal: Vec3A,
    /// See [`OFFSET`], in the world.
    offset_m: f32,
    /// Where textures are looked up; its footprint is not known yet.
    patch: Patch<'a>,
    triangle: Option<Triangle>,
    is_front: bool,
    /// Linear RGBA of the vertices.
    color: Vec4,
    material: u32,
}

/// One side of a triangle, with what all of its points have in common.
pub(crate) struct Facet<'a> {
    instance: u32,
    triangle: Triangle,
    mesh: &'a Mesh,
    vertices: [usize; 3],
    /// By the triangle's winding, whatever side it is seen from; of any length, in the object.
    winding_normal: Vec3A,
    /// Of the vertices, on this side; `None` if the mesh has none.
    normals: Option<[Vec3A; 3]>,
    /// See [`Local`].
    unit_normal: Option<Vec3A>,
    offset_m: f32,
    /// Linear RGBA of the vertices; `None`: white.
    colors: Option<[Vec4; 3]>,
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
        Point::on(world, moment, (ray, hit, cone), &mut None)
    }

    /// The same, for many points one after the other: `facet` is what the last of them was on, and then what this one is.
    #[inline(always)]
    pub(crate) fn on<'a>(
        world: &'a World,
        moment: &Moment,
        (ray, hit, cone): (&Ray, &Hit, Cone),
        facet: &mut Option<Facet<'a>>,
    ) -> Point {
        let placed = moment.placed(hit.instance);
        let mut local = local(world, moment, (ray, hit), facet);
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
        let local = local(world, moment, (ray, hit), &mut None);
        let normal = local.unit_normal.unwrap_or(Vec3A::ZERO);
        let cosine = -normal.dot(ray.direction.normalize_or_zero());
        let Local { patch, color, is_front, .. } = local;
        Placement { patch, color, is_front, cosine }
    }
}

/// The same without its sides: where a mesh's textures are looked up, and the colour of its vertices.
#[inline]
pub(crate) fn looked_at<'a>(moment: &Moment, mesh: &'a Mesh, hit: &Hit) -> (Patch<'a>, Vec4) {
    let vertices = mesh.triangles[hit.primitive as usize].map(|vertex| vertex as usize);
    let weights = weights(hit);
    let patch = Patch::Triangle { mesh, vertices, weights, footprint: 0.0 };
    let colors = match mesh.colors.is_empty() {
        true => return (patch, Vec4::ONE),
        false => match moment.deforming(moment.placed(hit.instance)) {
            None => &mesh.colors,
            Some(deforming) => deforming.now().colors(),
        },
    };
    let [a, b, c] = vertices.map(|vertex| Vec4::max(colors[vertex], Vec4::ZERO));
    (patch, weights[0] * a + weights[1] * b + weights[2] * c)
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
    (ray, hit): (&Ray, &Hit),
    facet: &mut Option<Facet<'a>>,
) -> Local<'a> {
    let placed = moment.placed(hit.instance);
    let local_ray = ray.transformed(&placed.object_from_world);
    if let Some(facet) = facet
        && facet.is_of(hit, &local_ray)
    {
        return facet.at(hit);
    }
    let scene = world.scene();
    let geometry = scene.instances[hit.instance as usize].geometry;
    let mesh = match &scene.geometries[geometry as usize] {
        Geometry::Sphere { material } => return on_sphere(*material, placed, &local_ray, hit.t),
        Geometry::Mesh(mesh) => mesh,
    };
    let new = match moment.deforming(placed) {
        None => Facet::new(mesh, &Rigid(mesh), placed, &local_ray, hit),
        Some(deforming) => {
            let mut new = Facet::new(mesh, deforming.now(), placed, &local_ray, hit);
            new.triangle.deforms = true;
            new
        }
    };
    facet.insert(new).at(hit)
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

fn on_sphere<'a>(material: u32, placed: &Placed, ray: &Ray, t: f32) -> Local<'a> {
    // Back onto the sphere: t is relative to a ray that may come from far away.
    let position = (ray.origin + t * ray.direction).normalize_or_zero();
    let is_front = position.dot(ray.direction) <= 0.0;
    let normal = if is_front { position } else { -position };
    Local {
        position,
        anchor: position,
        shadow_origin: position,
        unit_normal: unit_normal(placed, normal),
        normal,
        offset_m: offset_m(placed, Vec3A::ONE),
        patch: Patch::Sphere { uv: sphere::texture_coordinates(position) },
        triangle: None,
        is_front,
        color: Vec4::ONE,
        material,
    }
}

impl<'a> Facet<'a> {
    #[inline(always)]
    fn new(
        mesh: &'a Mesh,
        now: &impl Vertices,
        placed: &Placed,
        ray: &Ray,
        hit: &Hit,
    ) -> Facet<'a> {
        let index = hit.primitive as usize;
        let vertices = mesh.triangles[index].map(|vertex| vertex as usize);
        let corners = vertices.map(|vertex| now.position(vertex));
        let [a, b, c] = corners;
        let winding_normal = (b - a).cross(c - a);
        let is_front = winding_normal.dot(ray.direction) <= 0.0;
        let geometric_normal = if is_front { winding_normal } else { -winding_normal };
        let normals = match vertices.map(|vertex| now.normal(vertex)) {
            [Some(a), Some(b), Some(c)] => {
                Some([a, b, c].map(|normal| facing(normal, geometric_normal)))
            }
            _ => None,
        };
        let colors = now.colors();
        let color = |vertex: usize| Vec4::max(colors[vertex], Vec4::ZERO);
        Facet {
            instance: hit.instance,
            triangle: Triangle { index, corners, is_front, deforms: false },
            mesh,
            vertices,
            winding_normal,
            normals,
            unit_normal: unit_normal(placed, geometric_normal),
            offset_m: offset_m(placed, a.abs().max(b.abs()).max(c.abs())),
            colors: (!colors.is_empty()).then(|| vertices.map(color)),
            material: mesh.triangle_materials[index],
        }
    }

    /// Whether a ray, in the object's coordinates, has hit this triangle from this side.
    #[inline(always)]
    fn is_of(&self, hit: &Hit, ray: &Ray) -> bool {
        let Triangle { index, is_front, .. } = self.triangle;
        (self.instance, index) == (hit.instance, hit.primitive as usize)
            && is_front == (self.winding_normal.dot(ray.direction) <= 0.0)
    }

    /// One of its points.
    #[inline(always)]
    fn at(&self, hit: &Hit) -> Local<'a> {
        let Triangle { corners, is_front, deforms, .. } = self.triangle;
        let weights = weights(hit);
        let position = blend(weights, corners);
        let (normal, shadow_origin) = match self.normals {
            Some(normals) => {
                (blend(weights, normals), on_smooth_surface(position, weights, corners, normals))
            }
            None if is_front => (self.winding_normal, position),
            None => (-self.winding_normal, position),
        };
        let color = self
            .colors
            .map_or(Vec4::ONE, |[a, b, c]| weights[0] * a + weights[1] * b + weights[2] * c);
        let (mesh, vertices) = (self.mesh, self.vertices);
        Local {
            position,
            anchor: if deforms { weights.into() } else { position },
            shadow_origin,
            unit_normal: self.unit_normal,
            normal,
            offset_m: self.offset_m,
            patch: Patch::Triangle { mesh, vertices, weights, footprint: 0.0 },
            triangle: Some(self.triangle),
            is_front,
            color,
            material: self.material,
        }
    }
}

#[inline(always)]
fn blend(weights: [f32; 3], values: [Vec3A; 3]) -> Vec3A {
    weights[0] * values[0] + weights[1] * values[1] + weights[2] * values[2]
}

/// A normal of the object's in the world, where normals transform with the inverse's transpose.
#[inline(always)]
fn unit_normal(placed: &Placed, normal: Vec3A) -> Option<Vec3A> {
    (placed.object_from_world.matrix3.transpose() * normal).try_normalize()
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

/// `extent`: no coordinate that goes into a position is larger; rounding errors are in proportion to it.
#[inline(always)]
fn offset_m(placed: &Placed, extent: Vec3A) -> f32 {
    let m = &placed.world_from_object;
    let extent = m.matrix3.abs() * extent + m.translation.abs();
    OFFSET * extent.max_element()
}

#[inline(always)]
fn into_world(ray: &Ray, placed: &Placed, local: &Local<'_>, matter: Matter) -> Point {
    let m = &placed.world_from_object;
    let towards_viewer = -ray.direction;
    let geometric_normal = local.unit_normal.unwrap_or_else(|| towards_viewer.normalize_or_zero());
    let mut normal = unit_normal(placed, local.normal).unwrap_or(geometric_normal);
    let mut local_normal = local.normal;
    if normal.dot(geometric_normal) < 0.0 {
        normal = -normal;
        local_normal = -local_normal;
    }
    let outwards = geometric_normal * local.offset_m;
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
