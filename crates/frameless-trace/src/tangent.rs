//! Normals bent by normal maps (glTF 2.0 §3.9.3, Blinn 1978).
//!
//! ```text
//! n = ( x T + y B + z N ) / |…|        (x, y, z) = (2 texel − 1) · (scale, scale, 1)
//! B = w · N × T, mirrored where the object is
//! ```
//!
//! T, B and N belong to the front; of a back face the whole of n is turned round.

use frameless_scene::TextureRef;
use glam::Vec3A;

use crate::patch::Patch;
use crate::texture::Encoding;
use crate::top::Placed;
use crate::world::World;

/// The triangle that a point is on, in its object's coordinates.
#[derive(Clone, Copy)]
pub(crate) struct Triangle {
    pub(crate) index: usize,
    pub(crate) corners: [Vec3A; 3],
    /// Whether it is seen from its front.
    pub(crate) is_front: bool,
    pub(crate) deforms: bool,
}

/// `normal` (world coordinates, unit length, towards the viewer) bent by a map; itself where the map has no axes.
pub(crate) fn bent(
    world: &World,
    (reference, scale): (TextureRef, f32),
    (patch, triangle): (&Patch<'_>, &Triangle),
    placed: &Placed,
    normal: Vec3A,
) -> Vec3A {
    let Some((tangent, w)) = axes(&reference, patch, triangle, placed, normal) else {
        return normal;
    };
    let texel = Vec3A::from_vec4(patch.look_up(world, &reference, Encoding::Number));
    let [x, y, z] = (2.0 * texel - 1.0).to_array();
    let side = if triangle.is_front { 1.0 } else { -1.0 };
    let bitangent = w * normal.cross(tangent);
    let bent = side * scale * x * tangent + scale * y * bitangent + z * normal;
    bent.try_normalize().unwrap_or(normal)
}

/// T in the world, of unit length and square to the normal; and w, with the object's mirroring in it.
fn axes(
    reference: &TextureRef,
    patch: &Patch<'_>,
    triangle: &Triangle,
    placed: &Placed,
    normal: Vec3A,
) -> Option<(Vec3A, f32)> {
    let matrix = &placed.world_from_object.matrix3;
    let mirrored = matrix.determinant().signum();
    let across = |direction: Vec3A| {
        let direction = matrix.mul_vec3a(direction);
        (direction - direction.dot(normal) * normal).try_normalize()
    };
    if let Some((tangent, w)) = of_corners(patch, triangle) {
        return Some((across(tangent)?, w * mirrored));
    }
    let [along, up] = patch.axes(triangle.corners, reference)?;
    let [a, b, c] = triangle.corners;
    let w = (b - a).cross(c - a).cross(along).dot(up).signum();
    Some((across(along)?, w * mirrored))
}

/// The mesh's own tangents, if it has any here.
fn of_corners(patch: &Patch<'_>, triangle: &Triangle) -> Option<(Vec3A, f32)> {
    let Patch::Triangle { mesh, weights, .. } = patch else { return None };
    if mesh.tangents.is_empty() || triangle.deforms {
        return None;
    }
    let first = 3 * triangle.index;
    let [a, b, c] = [0, 1, 2].map(|corner| mesh.tangents[first + corner]);
    let tangent = weights[0] * a + weights[1] * b + weights[2] * c;
    let tangent = Vec3A::from_vec4(tangent);
    (tangent != Vec3A::ZERO).then_some((tangent, a.w))
}

/// `normal` on the side of the surface itself, by at least so much that it may be seen from there.
pub(crate) fn above(normal: Vec3A, geometric_normal: Vec3A) -> Vec3A {
    /// Sine of the angle to the surface: half a degree.
    const LEAST: f32 = 0.01;
    let height = normal.dot(geometric_normal);
    if height >= LEAST {
        return normal;
    }
    (normal + (LEAST - height) * geometric_normal).try_normalize().unwrap_or(geometric_normal)
}
