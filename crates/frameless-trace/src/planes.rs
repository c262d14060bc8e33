//! Which triangles of a mesh are plane mirrors.
//!
//! Only what reflects and nothing else is one here: a sample can belong to one surface only.

use frameless_scene::{Mesh, Scene};
use glam::{Vec2, Vec3, Vec3A};

use crate::build::corners;
use crate::direct::is_pure_mirror;

/// A flat, convex part of a mesh.
#[derive(Clone, Debug)]
pub(crate) struct Plane {
    pub(crate) point: Vec3A,
    /// Unit length.
    pub(crate) normal: Vec3A,
    /// Convex; counter-clockwise seen from the side of the normal.
    pub(crate) outline: Vec<Vec3A>,
}

/// Meshes with more mirroring planes are curved.
const MOST_PLANES: usize = 16;
/// Every sample in a mirror is tested against every edge.
const MOST_EDGES: usize = 32;

/// In which plane every triangle lies, and the planes; both empty if it has none, or is curved.
pub(crate) fn planes(scene: &Scene, mesh: &Mesh) -> (Vec<Option<u16>>, Vec<Plane>) {
    let is_mirror =
        |material: u32| scene.materials.get(material as usize).is_some_and(is_pure_mirror);
    if !mesh.triangle_materials.used().any(is_mirror) {
        return Default::default();
    }
    let mut found: Vec<Found> = Vec::new();
    let mut plane_of = vec![None; mesh.triangles.len()];
    for (primitive, plane_of) in plane_of.iter_mut().enumerate() {
        if !is_mirror(mesh.triangle_materials[primitive]) || !is_flat(mesh, primitive) {
            continue;
        }
        let corners = corners(mesh, primitive as u32);
        let twice_area = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
        let Some(normal) = twice_area.try_normalize() else { continue };
        let same = found.iter().position(|plane| plane.holds(normal, &corners));
        let index = same.unwrap_or(found.len());
        if index == MOST_PLANES {
            return Default::default();
        }
        if same.is_none() {
            found.push(Found { normal, corners: Vec::new(), area: 0.0 });
        }
        found[index].corners.extend(corners);
        found[index].area += 0.5 * twice_area.length();
        *plane_of = Some(index as u16);
    }
    let planes: Vec<Option<Plane>> = found.iter().map(Found::plane).collect();
    if planes.iter().any(Option::is_none) {
        return Default::default();
    }
    (plane_of, planes.into_iter().flatten().collect())
}

/// Whether the triangle is shaded as flat as it is.
fn is_flat(mesh: &Mesh, primitive: usize) -> bool {
    const COS: f32 = 1.0 - 1e-5;
    let Some(normals) = (!mesh.normals.is_empty()).then_some(&mesh.normals) else { return true };
    let [a, b, c] = corners(mesh, primitive as u32);
    let flat = (b - a).cross(c - a).normalize_or_zero();
    mesh.triangles[primitive].iter().all(|&v| normals[v as usize].dot(flat).abs() > COS)
}

/// Triangles of one plane.
struct Found {
    normal: Vec3,
    corners: Vec<Vec3>,
    area: f32,
}

impl Found {
    fn holds(&self, normal: Vec3, corners: &[Vec3; 3]) -> bool {
        const COS: f32 = 1.0 - 1e-6;
        // Of the plane's own size.
        const OFF: f32 = 1e-5;
        let origin = self.corners[0];
        normal.dot(self.normal) > COS
            && corners.iter().all(|&corner| {
                let to = corner - origin;
                to.dot(self.normal).abs() <= OFF * (to.length() + self.area.sqrt())
            })
    }

    /// `None` if it is not convex, or nearly round.
    fn plane(&self) -> Option<Plane> {
        let (u, v) = self.normal.any_orthonormal_pair();
        let origin = self.corners[0];
        let flat = |corner: &Vec3| Vec2::new((corner - origin).dot(u), (corner - origin).dot(v));
        let hull = convex_hull(self.corners.iter().map(flat).collect());
        let is_convex = area(&hull) <= 1.001 * self.area;
        (hull.len() >= 3 && hull.len() <= MOST_EDGES && is_convex).then(|| Plane {
            point: origin.into(),
            normal: self.normal.into(),
            outline: hull.iter().map(|at| (origin + at.x * u + at.y * v).into()).collect(),
        })
    }
}

/// Counter-clockwise, without points on its edges (Andrew 1979, "Another efficient algorithm for convex hulls in two dimensions").
fn convex_hull(mut points: Vec<Vec2>) -> Vec<Vec2> {
    points.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    points.dedup();
    if points.len() < 3 {
        return points;
    }
    let half = |points: &mut dyn Iterator<Item = Vec2>| {
        let mut chain: Vec<Vec2> = Vec::new();
        for point in points {
            while let [.., a, b] = chain[..]
                && (b - a).perp_dot(point - b) <= 1e-6 * (b - a).length() * (point - b).length()
            {
                chain.pop();
            }
            chain.push(point);
        }
        chain.pop();
        chain
    };
    let mut hull = half(&mut points.iter().copied());
    hull.extend(half(&mut points.iter().rev().copied()));
    hull
}

fn area(polygon: &[Vec2]) -> f32 {
    let next = polygon.iter().cycle().skip(1);
    0.5 * polygon.iter().zip(next).map(|(a, b)| a.perp_dot(*b)).sum::<f32>()
}

#[cfg(test)]
mod tests {
    use frameless_scene::{Geometry, Material, TriangleMaterials};

    use super::*;
    use crate::test_scenes as scenes;

    fn scene() -> Scene {
        let mirror = Material { metallic: 1.0, roughness: 0.0, ..Material::default() };
        Scene { materials: vec![mirror, Material::default()], ..Scene::default() }
    }

    fn mesh(positions: &[[f32; 3]], triangles: Vec<[u32; 3]>) -> Mesh {
        let positions = positions.iter().copied().map(Vec3::from).collect();
        match scenes::mesh(positions, triangles, 0) {
            Geometry::Mesh(mesh) => mesh,
            Geometry::Sphere { .. } => unreachable!("it is made of triangles"),
        }
    }

    /// From (0, 0, 0) to (1, 2, 3): corner number xyz in bits.
    fn block() -> Mesh {
        let corner = |k: usize| [(k >> 2) as f32, 2.0 * (k >> 1 & 1) as f32, 3.0 * (k & 1) as f32];
        let sides =
            [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]];
        let halves = sides.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
        mesh(&std::array::from_fn::<_, 8, _>(corner), halves)
    }

    #[test]
    fn a_block_has_six_mirrors_of_four_edges() {
        let (plane_of, planes) = planes(&scene(), &block());
        let pairs: Vec<Option<u16>> = (0..12).map(|triangle| Some(triangle / 2)).collect();
        assert_eq!((plane_of, planes.len()), (pairs, 6));
        let outwards = [Vec3A::NEG_X, Vec3A::X, Vec3A::NEG_Y, Vec3A::Y, Vec3A::NEG_Z, Vec3A::Z];
        for (plane, outwards) in planes.iter().zip(outwards) {
            assert!(plane.normal.abs_diff_eq(outwards, 1e-6), "{plane:?}");
            assert_eq!(plane.outline.len(), 4);
            let middle = plane.outline.iter().sum::<Vec3A>() / 4.0;
            for (k, &corner) in plane.outline.iter().enumerate() {
                assert!((corner - plane.point).dot(plane.normal).abs() < 1e-5, "off its plane");
                let edge = plane.outline[(k + 1) % 4] - corner;
                assert!(edge.cross(middle - corner).dot(plane.normal) > 0.0, "clockwise");
            }
        }
    }

    #[test]
    fn only_triangles_that_mirror_and_nothing_else_count() {
        let mut block = block();
        let others = block.triangle_materials.iter().skip(1);
        block.triangle_materials = std::iter::once(1).chain(others).collect();
        // Half a side is a triangle, which is convex as well.
        let (plane_of, found) = planes(&scene(), &block);
        assert_eq!((plane_of[0], found.len()), (None, 6));
        assert_eq!(found[0].outline.len(), 3);
        block.triangle_materials = TriangleMaterials::all(1, block.triangles.len());
        assert!(planes(&scene(), &block).1.is_empty());
    }

    #[test]
    fn what_is_not_convex_is_no_mirror() {
        let corners = [[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [1.0, 1.0], [1.0, 2.0], [0.0, 2.0]];
        let corners = corners.map(|[x, y]| [x, y, 0.0]);
        let bent = mesh(&corners, vec![[0, 1, 3], [1, 2, 3], [0, 3, 5], [3, 4, 5]]);
        assert!(planes(&scene(), &bent).1.is_empty());
        let straight = mesh(&corners, vec![[0, 1, 3], [1, 2, 3]]);
        assert_eq!(planes(&scene(), &straight).1.len(), 1);
    }

    #[test]
    fn what_is_curved_or_shaded_as_if_it_were_is_no_mirror() {
        let Geometry::Mesh(ball) = scenes::triangle_sphere(6, 8, 0) else { unreachable!() };
        assert!(planes(&scene(), &ball).1.is_empty());
        let mut block = block();
        block.normals = block.positions.iter().map(|p| (p - Vec3::ONE).normalize()).collect();
        assert!(planes(&scene(), &block).1.is_empty());
    }

    #[test]
    fn parallel_planes_are_two_mirrors() {
        let [near, far] = [0.0, 1e-3].map(|z| [[0.0, 0.0, z], [1.0, 0.0, z], [0.0, 1.0, z]]);
        let panes = mesh(&[near, far].concat(), vec![[0, 1, 2], [3, 4, 5]]);
        assert_eq!(planes(&scene(), &panes).0, [Some(0), Some(1)]);
    }

    #[test]
    fn hulls_have_no_points_on_their_edges() {
        let points = [[0.0, 0.0], [1.0, 0.0], [0.5, 0.0], [1.0, 1.0], [0.0, 1.0], [0.4, 0.6]];
        let hull = convex_hull(points.map(Vec2::from).to_vec());
        assert_eq!(hull, [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(Vec2::from));
        assert_eq!(area(&hull), 1.0);
        assert!(convex_hull(vec![Vec2::ONE; 5]).len() < 3);
    }
}
