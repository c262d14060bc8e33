//! Normals where the file has none or bad ones.

use glam::Vec3;

use crate::Influences;

use super::attributes::{TargetVertices, Vertices};

/// (b − a) × (c − a), at length one; `None` for a triangle without area.
fn face_normal(positions: &[Vec3], triangle: [u32; 3]) -> Option<Vec3> {
    let [a, b, c] = triangle.map(|corner| positions[corner as usize].as_dvec3());
    (b - a).cross(c - a).try_normalize().map(|normal| normal.as_vec3())
}

/// Gives every triangle three vertices of its own with its face's normal: flat shading, as glTF 2.0 §3.7.2.1 wants it for
/// primitives without normals. Triangles without area get +y, as nobody sees them.
pub(super) fn flatten(vertices: &Vertices, triangles: &mut [[u32; 3]]) -> Vertices {
    let corners: Vec<u32> = triangles.iter().flatten().copied().collect();
    let normals = triangles
        .iter()
        .flat_map(|&triangle| [face_normal(&vertices.positions, triangle).unwrap_or(Vec3::Y); 3]);
    let normals = Some(normals.collect());
    for (i, triangle) in triangles.iter_mut().enumerate() {
        *triangle = [0, 1, 2].map(|corner| 3 * i as u32 + corner);
    }
    let nowhere = |(_, corner): &(usize, &u32)| vertices.nowhere.binary_search(corner).is_ok();
    Vertices {
        positions: pick(&vertices.positions, &corners),
        normals,
        uvs: vertices.uvs.each_ref().map(|uvs| uvs.as_ref().map(|uvs| pick(uvs, &corners))),
        // Those of the file belong to normals that it does not have (glTF 2.0 §3.7.2.1).
        tangents: None,
        colors: vertices.colors.as_ref().map(|colors| pick(colors, &corners)),
        influences: vertices.influences.iter().map(|set| pick_influences(set, &corners)).collect(),
        targets: vertices.targets.iter().map(|target| pick_target(target, &corners)).collect(),
        nowhere: corners.iter().enumerate().filter(nowhere).map(|(i, _)| i as u32).collect(),
    }
}

fn pick<T: Copy>(values: &[T], corners: &[u32]) -> Vec<T> {
    corners.iter().map(|&corner| values[corner as usize]).collect()
}

fn pick_influences(set: &Influences, corners: &[u32]) -> Influences {
    Influences { joints: pick(&set.joints, corners), weights: pick(&set.weights, corners) }
}

/// Without normals: those of the base are ours.
fn pick_target(target: &TargetVertices, corners: &[u32]) -> TargetVertices {
    TargetVertices {
        positions: target.positions.as_ref().map(|positions| pick(positions, corners)),
        normals: None,
        colors: target.colors.as_ref().map(|colors| pick(colors, corners)),
    }
}

/// Brings all normals to length one. Those without a direction become the mean of the faces around them, or +y where
/// there is none. Returns how many were replaced.
pub(super) fn repair(normals: &mut [Vec3], positions: &[Vec3], triangles: &[[u32; 3]]) -> usize {
    let bad: Vec<bool> = normals.iter_mut().map(|normal| !normalize(normal)).collect();
    let bad_count = bad.iter().filter(|&&bad| bad).count();
    if bad_count == 0 {
        return 0;
    }
    for &triangle in triangles {
        let bad_corners = triangle.into_iter().filter(|&corner| bad[corner as usize]);
        if let Some(face) = face_normal(positions, triangle) {
            bad_corners.for_each(|corner| normals[corner as usize] += face);
        }
    }
    for (normal, _) in normals.iter_mut().zip(&bad).filter(|(_, bad)| **bad) {
        *normal = normal.try_normalize().unwrap_or(Vec3::Y);
    }
    bad_count
}

/// Brings `normal` to length one if it has a direction, else to zero.
fn normalize(normal: &mut Vec3) -> bool {
    // Twice as precise, so that neither the largest nor the smallest squares are lost.
    let unit = normal.as_dvec3().try_normalize().map(|unit| unit.as_vec3());
    *normal = unit.unwrap_or(Vec3::ZERO);
    unit.is_some()
}

#[cfg(test)]
mod tests {
    use super::*;

    const CORNER: [Vec3; 4] = [Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z];

    #[test]
    fn bad_normals_become_those_of_the_faces_around() {
        let mut normals = [Vec3::NAN, Vec3::X * 1e30, Vec3::ZERO, Vec3::INFINITY];
        let replaced = repair(&mut normals, &CORNER, &[[0, 1, 2], [0, 2, 0]]);
        assert_eq!(replaced, 3);
        assert_eq!(normals, [Vec3::Z, Vec3::X, Vec3::Z, Vec3::Y]);
    }

    #[test]
    fn flat_triangles_share_no_vertex() {
        let vertices =
            Vertices { positions: CORNER.to_vec(), nowhere: vec![3], ..Vertices::default() };
        let mut triangles = [[0, 1, 2], [0, 2, 3]];
        let flat = flatten(&vertices, &mut triangles);
        assert_eq!(triangles, [[0, 1, 2], [3, 4, 5]]);
        assert_eq!(flat.positions[5], Vec3::Z);
        assert_eq!(flat.normals.unwrap(), [[Vec3::Z; 3], [Vec3::X; 3]].concat());
        assert_eq!(flat.nowhere, [5]);
    }
}
