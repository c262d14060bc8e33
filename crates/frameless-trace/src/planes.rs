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
    if !mesh.triangle_materials.iter().any(|&material| is_mirror(material)) {
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
    use super::*;

    #[test]
    fn hulls_have_no_points_on_their_edges() {
        let points = [[0.0, 0.0], [1.0, 0.0], [0.5, 0.0], [1.0, 1.0], [0.0, 1.0], [0.4, 0.6]];
        let hull = convex_hull(points.map(Vec2::from).to_vec());
        assert_eq!(hull, [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(Vec2::from));
        assert_eq!(area(&hull), 1.0);
        assert!(convex_hull(vec![Vec2::ONE; 5]).len() < 3);
    }
}
