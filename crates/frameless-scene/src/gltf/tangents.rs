//! Where the x and y axes of normal maps point, at every corner of every triangle.
//!
//! From the file's TANGENT, else as in Mikkelsen's algorithm ("Simulation of Wrinkled Surfaces Revisited", 2008; "MikkTSpace"), by which
//! most normal maps are baked and which glTF 2.0 §3.7.2.1 asks for:
//!
//! ```text
//! t_f = ∂p/∂u of triangle f, of length one
//! t   = Σ_f angle_f · (t_f − (t_f·n) n) / |…|        over the triangles at a vertex whose pictures are mirrored alike
//! ```
//!
//! Differs from the paper: triangles belong together if position, normal and texture coordinates of the corner are the same; whether they
//! also share an edge is not asked. Unknown where texture coordinates have no direction: whoever shades takes the triangle's own.

use std::collections::HashMap;

use glam::{Vec2, Vec3, Vec4};

use crate::{Mesh, TextureRef};

/// Of corners that nothing is known of.
pub(super) const UNKNOWN: Vec4 = Vec4::W;

/// The file's own tangents, one per vertex, at the corners of the triangles.
pub(super) fn from_file(tangents: &[Vec4], triangles: &[[u32; 3]]) -> Vec<Vec4> {
    triangles.iter().flatten().map(|&corner| settled(tangents[corner as usize])).collect()
}

/// Unit length, or unknown; the sign of w.
fn settled(tangent: Vec4) -> Vec4 {
    let w = if tangent.w < 0.0 { -1.0 } else { 1.0 };
    let direction = tangent.truncate().as_dvec3().try_normalize().map(|unit| unit.as_vec3());
    direction.unwrap_or(Vec3::ZERO).extend(w)
}

/// By the coordinates with which `map` is looked up. `triangles` name vertices of `mesh`, which has normals; without coordinates all is
/// unknown.
pub(super) fn generate(mesh: &Mesh, triangles: &[[u32; 3]], map: &TextureRef) -> Vec<Vec4> {
    if mesh.uvs[map.uv_set as usize].is_empty() {
        return vec![UNKNOWN; 3 * triangles.len()];
    }
    let mut sums: HashMap<Key, Vec3> = HashMap::new();
    for &triangle in triangles {
        let face = Face::new(mesh, triangle, map);
        let Some((along, w)) = face.axis() else { continue };
        for corner in 0..3 {
            let sum = sums.entry(face.key(corner, w)).or_default();
            *sum += face.angle(corner) * across(along, face.normals[corner]);
        }
    }
    let at = |face: &Face, corner: usize, w: f32| {
        let sum = sums.get(&face.key(corner, w)).copied().unwrap_or(Vec3::ZERO);
        sum.normalize_or_zero().extend(w)
    };
    let tangents = triangles.iter().flat_map(|&triangle| {
        let face = Face::new(mesh, triangle, map);
        match face.axis() {
            Some((_, w)) => [0, 1, 2].map(|corner| at(&face, corner, w)),
            None => [UNKNOWN; 3],
        }
    });
    tangents.collect()
}

/// The part of a direction that is square to a normal, at length one.
fn across(direction: Vec3, normal: Vec3) -> Vec3 {
    (direction - direction.dot(normal) * normal).normalize_or_zero()
}

/// What makes corners one: the bits of position, normal and texture coordinates, and which way round the picture lies.
type Key = ([u32; 8], bool);

struct Face {
    positions: [Vec3; 3],
    normals: [Vec3; 3],
    uvs: [Vec2; 3],
}

impl Face {
    fn new(mesh: &Mesh, triangle: [u32; 3], map: &TextureRef) -> Face {
        let vertices = triangle.map(|vertex| vertex as usize);
        let uv = |vertex: usize| mesh.uvs[map.uv_set as usize][vertex];
        Face {
            positions: vertices.map(|vertex| mesh.positions[vertex]),
            normals: vertices.map(|vertex| mesh.normals[vertex]),
            uvs: vertices.map(|vertex| map.picture_from_uv.transform_point2(uv(vertex))),
        }
    }

    /// ∂p/∂u at length one, and the sign with which normal × tangent points up in the picture.
    fn axis(&self) -> Option<(Vec3, f32)> {
        let [a, b, c] = self.positions.map(|p| p.as_dvec3());
        let [d, e, f] = self.uvs.map(|uv| uv.as_dvec2());
        let (to_b, to_c) = (e - d, f - d);
        let area = to_b.perp_dot(to_c);
        let along = ((b - a) * to_c.y - (c - a) * to_b.y) * area.signum();
        let along = along.try_normalize()?;
        // v points down in a picture: one that is not mirrored has its corners clockwise in (u, v).
        let w = if area < 0.0 { 1.0 } else { -1.0 };
        (area != 0.0 && area.is_finite()).then(|| (along.as_vec3(), w))
    }

    /// Between the edges at a corner, in radians.
    fn angle(&self, corner: usize) -> f32 {
        let [here, next, last] = [0, 1, 2].map(|k| self.positions[(corner + k) % 3]);
        let normal = self.normals[corner];
        let (one, other) = (across(next - here, normal), across(last - here, normal));
        one.dot(other).clamp(-1.0, 1.0).acos()
    }

    fn key(&self, corner: usize, w: f32) -> Key {
        let [x, y, z] = self.positions[corner].to_array();
        let [i, j, k] = self.normals[corner].to_array();
        let [u, v] = self.uvs[corner].to_array();
        // −0 is 0.
        ([x, y, z, i, j, k, u, v].map(|number| (number + 0.0).to_bits()), w > 0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{Affine2, Vec2};

    /// A square that faces +z, whose picture stands upright: u along +x, v along −y.
    fn square(uvs: [Vec2; 4]) -> Mesh {
        let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
        let mut mesh = Mesh {
            positions: corners.map(|[x, y]| Vec3::new(x, y, 0.0)).to_vec(),
            normals: vec![Vec3::Z; 4],
            ..Mesh::default()
        };
        mesh.uvs[0] = uvs.to_vec();
        mesh
    }

    const UPRIGHT: [Vec2; 4] =
        [Vec2::new(0.0, 1.0), Vec2::new(1.0, 1.0), Vec2::new(1.0, 0.0), Vec2::new(0.0, 0.0)];
    const TRIANGLES: [[u32; 3]; 2] = [[0, 1, 2], [0, 2, 3]];

    #[test]
    fn an_upright_picture_has_its_x_along_x_and_its_y_up() {
        let tangents = generate(&square(UPRIGHT), &TRIANGLES, &TextureRef::plain(0));
        assert!(tangents.iter().all(|t| t.abs_diff_eq(Vec4::new(1.0, 0.0, 0.0, 1.0), 1e-6)));
        let mirrored = UPRIGHT.map(|uv| Vec2::new(1.0 - uv.x, uv.y));
        let tangents = generate(&square(mirrored), &TRIANGLES, &TextureRef::plain(0));
        assert!(tangents.iter().all(|t| t.abs_diff_eq(Vec4::new(-1.0, 0.0, 0.0, -1.0), 1e-6)));
    }

    #[test]
    fn a_turned_picture_turns_its_axes() {
        let quarter = TextureRef::transform(Vec2::ZERO, std::f32::consts::FRAC_PI_2, Vec2::ONE);
        let map = TextureRef { picture_from_uv: quarter, ..TextureRef::plain(0) };
        let tangents = generate(&square(UPRIGHT), &TRIANGLES, &map);
        // The picture's u is what was v.
        assert!(
            tangents.iter().all(|t| t.abs_diff_eq(Vec4::new(0.0, -1.0, 0.0, 1.0), 1e-6)),
            "{tangents:?}"
        );
        let flat = TextureRef { picture_from_uv: Affine2::ZERO, ..map };
        assert!(generate(&square(UPRIGHT), &TRIANGLES, &flat).iter().all(|t| t.is_finite()));
    }

    #[test]
    fn tangents_without_direction_are_unknown() {
        let bad = [Vec4::NAN, Vec4::ZERO, Vec4::new(f32::INFINITY, 0.0, 0.0, -1.0)];
        let settled = from_file(&bad, &[[0, 1, 2]]);
        assert_eq!(settled, [UNKNOWN, UNKNOWN, Vec4::new(0.0, 0.0, 0.0, -1.0)]);
        let long = from_file(&[Vec4::new(0.0, 3.0, 0.0, -0.5); 3], &[[0, 1, 2]]);
        assert_eq!(long[0], Vec4::new(0.0, 1.0, 0.0, -1.0));
    }

    /// Two walls of a room: at the corner's normal both have a part in the tangent.
    #[test]
    fn triangles_at_a_vertex_share_its_tangent() {
        let positions = [[-1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 1.0, 1.0], [1.0, 0.0, 0.0]];
        let normal = Vec3::new(0.0, 0.0, 1.0);
        let mut mesh = Mesh {
            positions: positions.map(Vec3::from).to_vec(),
            normals: vec![normal; 4],
            ..Mesh::default()
        };
        mesh.uvs[0] = [[0.0, 1.0], [0.5, 1.0], [0.5, 0.0], [1.0, 1.0]].map(Vec2::from).to_vec();
        let tangents = generate(&mesh, &[[0, 1, 2], [1, 3, 2]], &TextureRef::plain(0));
        assert_eq!(tangents[1], tangents[3], "the same vertex");
        assert!(tangents[1].abs_diff_eq(Vec4::new(1.0, 0.0, 0.0, 1.0), 1e-6), "{}", tangents[1]);
    }

    /// All in one place: the search for equal corners must not take forever.
    #[test]
    fn coinciding_triangles_take_no_time() {
        let triangles = vec![[0, 1, 2]; 100_000];
        let begin = std::time::Instant::now();
        let tangents = generate(&square([Vec2::ZERO; 4]), &triangles, &TextureRef::plain(0));
        assert!(tangents.iter().all(|t| t.is_finite()));
        let one_point =
            Mesh { positions: vec![Vec3::ZERO; 4], normals: vec![Vec3::Z; 4], ..square(UPRIGHT) };
        assert!(
            generate(&one_point, &triangles, &TextureRef::plain(0)).iter().all(|t| t.is_finite())
        );
        assert!(
            generate(&square(UPRIGHT), &triangles, &TextureRef::plain(0))
                .iter()
                .all(|t| t.is_finite())
        );
        assert!(begin.elapsed().as_secs() < 10, "{:?}", begin.elapsed());
    }
}
