//! Where on a surface textures are looked up.

use frameless_scene::{Mesh, TextureRef};
use glam::{Vec2, Vec3A, Vec4};

use crate::texture::{Encoding, Lookup, depends_on_distance};
use crate::world::World;

/// A point of a triangle, or of the sphere, with what texture coordinates need to be known there.
#[derive(Clone, Copy)]
pub(crate) enum Patch<'a> {
    Triangle {
        mesh: &'a Mesh,
        vertices: [usize; 3],
        weights: [f32; 3],
        /// W² / (|n·d| A), see [`crate::texture::Cone`], with twice the triangle's area as A. 0: a point.
        footprint: f32,
    },
    /// The sphere's own coordinates; looked up at a point, however far away.
    Sphere { uv: [f32; 2] },
}

impl Patch<'_> {
    /// Texture coordinates in a picture; (0, 0) where the mesh has none.
    #[inline]
    pub(crate) fn uv(&self, reference: &TextureRef) -> [f32; 2] {
        let uv = match *self {
            Patch::Sphere { uv } => uv.into(),
            Patch::Triangle { weights, .. } => match self.corners(reference) {
                Some([a, b, c]) => weights[0] * a + weights[1] * b + weights[2] * c,
                None => Vec2::ZERO,
            },
        };
        reference.picture_from_uv.transform_point2(uv).to_array()
    }

    /// Of the triangle, as the mesh has them.
    #[inline]
    fn corners(&self, reference: &TextureRef) -> Option<[Vec2; 3]> {
        let Patch::Triangle { mesh, vertices, .. } = self else { return None };
        let uvs = &mesh.uvs[reference.uv_set as usize];
        (!uvs.is_empty()).then(|| vertices.map(|vertex| uvs[vertex]))
    }

    /// RGBA of a texture here.
    #[inline]
    pub(crate) fn look_up(
        &self,
        world: &World,
        reference: &TextureRef,
        encoding: Encoding,
    ) -> Vec4 {
        let (lookup, level) = self.lookup(world, reference, encoding);
        lookup.at(self.uv(reference), level)
    }

    /// The alpha of a texture here.
    #[inline]
    pub(crate) fn look_up_alpha(&self, world: &World, reference: &TextureRef) -> f32 {
        let (lookup, level) = self.lookup(world, reference, Encoding::Color);
        lookup.alpha_at(self.uv(reference), level)
    }

    #[inline(always)]
    fn lookup<'w>(
        &self,
        world: &'w World,
        reference: &TextureRef,
        encoding: Encoding,
    ) -> (Lookup<'w>, f32) {
        let scene = world.scene();
        let texture = &scene.textures[reference.texture as usize];
        let image = &scene.images[texture.image as usize];
        let level = match depends_on_distance(texture) {
            true => self.level(reference, image.width as f32 * image.height as f32),
            false => 0.0,
        };
        (Lookup { texture, image, copies: &world.copies, encoding }, level)
    }

    /// λ; anything where a triangle has no area.
    fn level(&self, reference: &TextureRef, texels: f32) -> f32 {
        let Patch::Triangle { footprint, .. } = *self else { return 0.0 };
        if footprint == 0.0 {
            return 0.0;
        }
        let Some([a, b, c]) = self.corners(reference) else { return 0.0 };
        let area = (b - a).perp_dot(c - a) * reference.picture_from_uv.matrix2.determinant();
        0.5 * (texels * area.abs() * footprint).log2()
    }

    /// The triangle's own directions of a picture's x and of its y upwards, in the coordinates of its `corners`; of any length. `None`
    /// where the picture is flattened.
    pub(crate) fn axes(&self, corners: [Vec3A; 3], reference: &TextureRef) -> Option<[Vec3A; 2]> {
        let uvs = self.corners(reference)?;
        let [a, b, c] = uvs.map(|uv| reference.picture_from_uv.transform_point2(uv));
        let (to_b, to_c) = (b - a, c - a);
        let area = to_b.perp_dot(to_c);
        let [edge_b, edge_c] = [corners[1] - corners[0], corners[2] - corners[0]];
        // Of ∂p/∂u and ∂p/∂v only the directions count.
        let side = if area < 0.0 { -1.0 } else { 1.0 };
        let along_u = side * (edge_b * to_c.y - edge_c * to_b.y);
        let along_v = side * (edge_c * to_b.x - edge_b * to_c.x);
        (area != 0.0 && area.is_finite()).then_some([along_u, -along_v])
    }
}
