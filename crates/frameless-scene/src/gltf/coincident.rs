//! Triangles over the same three vertices, again and again: whoever sees one of them has seen them all, but every ray would pay for each.

use std::collections::HashMap;

use crate::Mesh;

/// Vertices of models have six triangles, those at poles hundreds at most: only where more meet is it asked whether they are the same.
const MANY: u32 = 1000;

/// Leaves out what is there already: the same corners in the same sense, of the same material. Of materials that light passes, `veils` stay.
/// Returns how many were left out.
pub(super) fn leave_out_coincident(mesh: &mut Mesh, veils: impl Fn(u32) -> usize) -> usize {
    let meeting = meeting_at(mesh);
    if meeting.iter().all(|&count| count <= MANY) {
        return 0;
    }
    let mut known: HashMap<([u32; 3], u32), usize> = HashMap::new();
    let mut is_kept = |(triangle, material): (&[u32; 3], u32)| {
        if triangle.iter().any(|&corner| meeting[corner as usize] <= MANY) {
            return true;
        }
        let count = known.entry((least_first(*triangle), material)).or_default();
        *count += 1;
        *count <= veils(material)
    };
    let all = mesh.triangles.iter().zip(mesh.triangle_materials.iter());
    let kept: Vec<bool> = all.map(&mut is_kept).collect();
    let before = mesh.triangles.len();
    keep(mesh, &kept);
    before - mesh.triangles.len()
}

/// Per vertex, of how many triangles it is a corner.
fn meeting_at(mesh: &Mesh) -> Vec<u32> {
    let mut meeting = vec![0u32; mesh.positions.len()];
    mesh.triangles.as_flattened().iter().for_each(|&corner| meeting[corner as usize] += 1);
    meeting
}

/// The same triangle, turned.
fn least_first([a, b, c]: [u32; 3]) -> [u32; 3] {
    match a.min(b).min(c) {
        least if least == a => [a, b, c],
        least if least == b => [b, c, a],
        _ => [c, a, b],
    }
}

fn keep(mesh: &mut Mesh, kept: &[bool]) {
    let materials = mesh.triangle_materials.iter().zip(kept);
    let materials = materials.filter(|(_, kept)| **kept).map(|(material, _)| material).collect();
    mesh.triangle_materials = materials;
    let mut is_kept = kept.iter();
    mesh.triangles.retain(|_| *is_kept.next().expect("one for each"));
    // Three each, or none at all.
    let mut corner = 0..;
    mesh.tangents.retain(|_| corner.next().is_some_and(|corner: usize| kept[corner / 3]));
}

#[cfg(test)]
mod tests {
    use glam::{Vec3, Vec4};

    use super::*;

    #[test]
    fn the_same_corners_in_the_same_sense_are_one_triangle() {
        let often = 2 * MANY as usize;
        let mut triangles = [[0, 1, 2], [1, 2, 0]].repeat(often);
        triangles.extend([[0, 2, 1], [0, 1, 3], [0, 1, 3]]);
        let of = |k: usize| if k < often { 0 } else { 1 };
        let mesh = Mesh {
            positions: vec![Vec3::ZERO; 4],
            triangle_materials: (0..triangles.len()).map(of).collect(),
            tangents: (0..3 * triangles.len()).map(|k| Vec4::splat(k as f32)).collect(),
            triangles,
            ..Mesh::default()
        };
        let mut one_each = mesh.clone();
        let left_out = leave_out_coincident(&mut one_each, |_| 1);
        // The last two meet at a vertex that has no others.
        assert_eq!(one_each.triangles, [[0, 1, 2], [0, 1, 2], [0, 2, 1], [0, 1, 3], [0, 1, 3]]);
        assert!(one_each.triangle_materials.iter().eq([0, 1, 1, 1, 1]));
        assert_eq!(left_out, mesh.triangles.len() - 5);
        assert_eq!(one_each.tangents[3].x, 3.0 * often as f32);
        let mut some = mesh;
        leave_out_coincident(&mut some, |material| if material == 1 { 16 } else { 1 });
        assert_eq!(some.triangles.len(), 1 + 16 + 3);
    }
}
