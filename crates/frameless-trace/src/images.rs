//! What plane mirrors show: virtual images.
//!
//! ```text
//! P' = P − 2 ((P − a) · n) n        the image of P in a mirror through a with unit normal n
//! ```
//!
//! What is seen in a plane mirror moves as the image of what is reflected, not as the mirror: a sample that a mirror sent on
//! belongs to the image of the surface that it hit then. Every object has one image in either side of every mirror, with an object
//! number of its own, which is seen only where the mirror is. (Zimmer et al. 2015, "Path-space Motion Estimation and Decomposition
//! for Robust Animation Filtering", follow reflections for the same reason, on surfaces of any shape.)

use std::ops::Range;

use frameless::{Pose, Projection, Surface, Window};
use frameless_scene::{Geometry, Scene};
use glam::{Affine3A, DVec3, Mat3A, Vec3A};

use crate::camera::Camera;
use crate::planes::{Plane, planes};
use crate::top::{Placed, Shape};

/// The plane mirrors of a scene, and the numbers of what is seen in them.
pub(crate) struct Mirrors {
    /// Per geometry and triangle: in which of the geometry's planes it lies. Empty where there are none.
    plane_of: Vec<Vec<Option<u16>>>,
    /// Per instance: the first of its mirrors.
    first_of: Vec<u32>,
    mirrors: Vec<Mirror>,
    /// Real objects.
    objects: u32,
}

/// A mirror in the coordinates of its instance.
#[derive(Clone, Debug)]
struct Mirror {
    instance: u32,
    plane: Plane,
}

/// One side of one mirror.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct MirrorSide(u32);

/// Every object has an image in either side of every mirror, and each is projected at every refresh.
const MOST_IMAGES: u64 = 1 << 14;
/// Far behind everything, for the sky's image.
const FAR: f32 = 1e30;

impl Mirrors {
    /// Finds them. Scenes with more mirrors or objects than images can be kept of have fewer mirrors, or none.
    pub(crate) fn new(scene: &Scene) -> Mirrors {
        let geometries = scene.geometries.iter().map(|geometry| match geometry {
            Geometry::Mesh(mesh) => planes(scene, mesh),
            Geometry::Sphere { .. } => (Vec::new(), Vec::new()),
        });
        let (mut plane_of, planes): (Vec<_>, Vec<_>) = geometries.unzip();
        let objects = scene.instances.len() as u32;
        let (mut first_of, mut mirrors) = (Vec::new(), Vec::new());
        for (instance, placed) in scene.instances.iter().enumerate() {
            first_of.push(mirrors.len() as u32);
            if scene.deformation_of(instance).is_some() {
                // What bends is no plane.
                continue;
            }
            let planes = planes[placed.geometry as usize].iter().cloned();
            mirrors.extend(planes.map(|plane| Mirror { instance: instance as u32, plane }));
        }
        if 2 * mirrors.len() as u64 * (u64::from(objects) + 1) > MOST_IMAGES {
            mirrors.clear();
            plane_of.iter_mut().for_each(Vec::clear);
        }
        Mirrors { plane_of, first_of, mirrors, objects }
    }

    /// The mirror that a triangle of an instance of `geometry` is part of, seen against `direction`.
    #[inline]
    pub(crate) fn seen(
        &self,
        geometry: u32,
        instance: u32,
        primitive: u32,
        placed: &Placed,
        direction: Vec3A,
    ) -> Option<MirrorSide> {
        if matches!(placed.shape, Shape::Deforming(_)) {
            return None;
        }
        let plane = (*self.plane_of[geometry as usize].get(primitive as usize)?)?;
        let mirror = self.first_of[instance as usize] + u32::from(plane);
        let normal = normal_in_world(placed, &self.mirrors[mirror as usize].plane);
        Some(MirrorSide(2 * mirror + u32::from(normal.dot(direction) > 0.0)))
    }

    /// The number of an object's image; also of the sky's.
    #[inline]
    pub(crate) fn image_of(&self, object: u32, side: MirrorSide) -> u32 {
        self.images(side).start + object.min(self.objects)
    }

    /// The images in one side of a mirror: of the objects, then of the sky.
    fn images(&self, MirrorSide(side): MirrorSide) -> Range<u32> {
        let each = self.objects + 1;
        let start = self.objects + side * each;
        start..start + each
    }

    /// All sides of all mirrors, in the order of their images' numbers.
    fn sides(&self) -> impl Iterator<Item = MirrorSide> {
        (0..2 * self.mirrors.len() as u32).map(MirrorSide)
    }

    /// Appends the images to what has been filled in for the objects themselves.
    pub(crate) fn pose(&self, placed: &[Placed], camera: &Camera, pose: &mut Pose) {
        pose.windows.clear();
        let deformed = pose.deformed.clone();
        for side in self.sides() {
            let mirror = &self.mirrors[side.0 as usize / 2];
            let place = &placed[mirror.instance as usize];
            let reflection = reflection(place, &mirror.plane)
                .filter(|&(point, normal, _)| camera.is_before(point, normal) == (side.0 % 2 == 0));
            let images = self.images(side);
            let Some((point, normal, image)) = reflection else {
                // Seen from its other side, the mirror shows none of these.
                pose.picture_from_object.resize(images.end as usize, Projection::default());
                continue;
            };
            let objects =
                placed.iter().map(|o| camera.picture_from(&(image * o.world_from_object)));
            pose.picture_from_object.extend(objects);
            pose.picture_from_object.push(sky(camera, image.matrix3));
            if !deformed.is_empty() {
                pose.deformed.resize(images.start as usize, None);
                pose.deformed.extend_from_slice(&deformed);
            }
            pose.windows.push(Window {
                objects: images,
                edges: edges(camera, &place.world_from_object, &mirror.plane.outline),
                depth: camera.depth_of_plane(point, normal),
            });
        }
    }

    /// Appends to a list with an entry per object the same for every image of it, and `sky` for the sky's.
    pub(crate) fn repeat<T: Clone>(&self, of_objects: &mut Vec<T>, sky: T) {
        let objects = of_objects.len();
        for _ in self.sides() {
            of_objects.extend_from_within(..objects);
            of_objects.push(sky.clone());
        }
    }
}

/// A point of the mirror, its normal, and the map from what is reflected to its image; `None` if the instance is flattened.
fn reflection(placed: &Placed, plane: &Plane) -> Option<(Vec3A, Vec3A, Affine3A)> {
    let normal = normal_in_world(placed, plane).try_normalize()?;
    let point = placed.world_from_object.transform_point3a(plane.point);
    // Columns of I − 2 n nᵀ.
    let column = |axis: Vec3A| axis - 2.0 * normal.dot(axis) * normal;
    let matrix3 = Mat3A::from_cols(column(Vec3A::X), column(Vec3A::Y), column(Vec3A::Z));
    Some((point, normal, Affine3A { matrix3, translation: 2.0 * point.dot(normal) * normal }))
}

/// Of any length; on the side of the outline's counter-clockwise face.
#[inline]
fn normal_in_world(placed: &Placed, plane: &Plane) -> Vec3A {
    placed.object_from_world.matrix3.transpose() * plane.normal
}

/// Directions of reflected rays, as far behind everything as numbers go.
fn sky(camera: &Camera, image: Mat3A) -> Projection {
    let Some(Projection(mut rows)) = camera.picture_from_directions(image) else {
        return Projection::default();
    };
    rows[2] = [0.0, 0.0, 0.0, FAR];
    Projection(rows)
}

/// The planes through the eye and the outline's edges, as lines in the picture: also where a corner lies behind the eye.
fn edges(camera: &Camera, world_from_object: &Affine3A, outline: &[Vec3A]) -> Vec<[f32; 3]> {
    let Projection([column, row, _, w]) = camera.picture_from(world_from_object);
    let corners: Vec<DVec3> = outline
        .iter()
        .map(|corner| {
            let at = |r: [f32; 4]| {
                f64::from(r[0] * corner.x + r[1] * corner.y + (r[2] * corner.z + r[3]))
            };
            DVec3::new(at(column), at(row), at(w))
        })
        .collect();
    let middle = corners.iter().sum::<DVec3>();
    let next = corners.iter().cycle().skip(1);
    let edges = corners.iter().zip(next).filter_map(|(a, b)| {
        let line = a.cross(*b);
        let length = line.truncate().length();
        let inwards = if line.dot(middle) < 0.0 { -line } else { line };
        (length > 0.0).then(|| (inwards / length).as_vec3().to_array())
    });
    edges.collect()
}

/// The image of a surface, through a mirror that lets the part `throughput` of the light pass.
pub(crate) fn image(surface: Surface, object: u32, throughput: Vec3A) -> Surface {
    let seen = |rgb: [f32; 3]| (Vec3A::from(rgb) * throughput).to_array();
    Surface { object, albedo: seen(surface.albedo), direct: seen(surface.direct), ..surface }
}

#[cfg(test)]
mod tests {
    use frameless_scene::{Material, Mesh, Transform, TriangleMaterials};
    use glam::Vec3;

    use super::*;
    use crate::test_scenes as scenes;

    /// One instance of a mesh with that outline as a fan, of that material.
    fn fan(outline: &[[f32; 2]], material: Material) -> Scene {
        let mesh = Mesh {
            positions: outline.iter().map(|&[x, y]| Vec3::new(x, y, 0.0)).collect(),
            triangles: (2..outline.len() as u32).map(|i| [0, i - 1, i]).collect(),
            triangle_materials: TriangleMaterials::all(0, outline.len() - 2),
            ..Mesh::default()
        };
        let mut scene = scenes::empty();
        scene.materials.push(material);
        scenes::add(&mut scene, Geometry::Mesh(mesh), Transform::IDENTITY);
        scene
    }

    fn mirror() -> Material {
        Material { metallic: 1.0, roughness: 0.0, ..Material::default() }
    }

    const SQUARE: [[f32; 2]; 4] = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];

    #[test]
    fn a_square_of_two_triangles_is_one_mirror_with_four_edges() {
        let mirrors = Mirrors::new(&fan(&SQUARE, mirror()));
        assert_eq!(mirrors.plane_of, [[Some(0), Some(0)]]);
        assert_eq!(mirrors.mirrors[0].plane.outline.len(), 4);
        // The instance itself; then it and the sky on one side, and on the other.
        let images = [0, Surface::SKY].map(|object| {
            [MirrorSide(0), MirrorSide(1)].map(|side| mirrors.image_of(object, side))
        });
        assert_eq!(images, [[1, 3], [2, 4]]);
    }

    #[test]
    fn what_also_shines_is_rough_or_is_not_convex_is_no_mirror() {
        let glowing = Material { emissive: Vec3::ONE, ..mirror() };
        let brushed = Material { roughness: 0.2, ..mirror() };
        let notched = [[0.0, 0.0], [1.0, 0.0], [1.0, 0.5], [0.5, 0.5], [0.5, 1.0], [0.0, 1.0]];
        for scene in [fan(&SQUARE, glowing), fan(&SQUARE, brushed), fan(&notched, mirror())] {
            assert!(Mirrors::new(&scene).mirrors.is_empty());
        }
    }

    #[test]
    fn curved_meshes_and_too_many_objects_have_no_mirrors() {
        let mut bent = fan(&SQUARE, mirror());
        let Geometry::Mesh(mesh) = &mut bent.geometries[0] else { unreachable!() };
        mesh.normals = vec![Vec3::new(0.0, 0.1, 1.0).normalize(); 4];
        assert!(Mirrors::new(&bent).mirrors.is_empty());
        let mut crowd = fan(&SQUARE, mirror());
        crowd.instances = vec![crowd.instances[0]; 89];
        // 2 sides · 89 mirrors · 90 images are 16,020; with two more there are too many.
        assert_eq!(Mirrors::new(&crowd).mirrors.len(), 89);
        crowd.instances.extend([crowd.instances[0]; 2]);
        assert!(Mirrors::new(&crowd).mirrors.is_empty());
    }
}
