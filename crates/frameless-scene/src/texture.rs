//! Textures: pictures, and how they are looked up.

use glam::{Affine2, DVec4, Vec2, Vec4};

/// Which texture, with which of the mesh's texture coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TextureRef {
    /// Index into [`crate::Scene::textures`].
    pub texture: u32,
    /// Index into [`crate::Mesh::uvs`].
    pub uv_set: u32,
    /// Where in the picture a vertex' coordinates lead (KHR_texture_transform); finite.
    pub picture_from_uv: Affine2,
}

impl TextureRef {
    /// A texture as it is, by the first set of coordinates.
    pub fn plain(texture: u32) -> TextureRef {
        TextureRef { texture, uv_set: 0, picture_from_uv: Affine2::IDENTITY }
    }

    /// The map of KHR_texture_transform: scale, then rotation (counter-clockwise where v points up), then offset.
    pub fn transform(offset: Vec2, rotation_rad: f32, scale: Vec2) -> Affine2 {
        // v points down: in (u, v) the same turn has the other sign.
        Affine2::from_scale_angle_translation(scale, -rotation_rad, offset)
    }
}

/// An image and the way it is looked up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Texture {
    /// Index into [`crate::Scene::images`].
    pub image: u32,
    /// Outside [0, 1) horizontally and vertically.
    pub wrap: [Wrap; 2],
    /// Between texels, where a pixel sees no more than one of them.
    pub filter: Filter,
    /// Where a pixel sees many texels.
    pub minify: Minify,
}

/// What lies outside [0, 1).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Wrap {
    /// The image again.
    #[default]
    Repeat,
    /// The image mirrored, then again.
    MirroredRepeat,
    /// The border texel.
    ClampToEdge,
}

/// What lies between texel centres.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Filter {
    /// The nearest texel.
    Nearest,
    /// The four texels around, by distance.
    #[default]
    Linear,
}

/// How a picture is looked up that is smaller on the screen than it is: glTF's minification filters.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Minify {
    /// Between texels.
    pub filter: Filter,
    /// Between smaller and smaller copies of the picture; `None`: there are none, it is looked up as it is.
    pub levels: Option<Filter>,
}

impl Minify {
    /// Smooth in all ways, which is what viewers do unless a file says otherwise.
    pub const TRILINEAR: Minify = Minify { filter: Filter::Linear, levels: Some(Filter::Linear) };
}

/// A decoded picture: row-major from the top, 8 bits per channel. Colours are sRGB-encoded with linear alpha; what is no colour
/// is stored as it is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Image {
    /// Texels per row; at least 1.
    pub width: u32,
    /// Rows; at least 1.
    pub height: u32,
    /// `width · height` texels.
    pub rgba: Vec<[u8; 4]>,
}

impl Image {
    /// The mean of all texels, as light: linear RGBA of sRGB-encoded colours.
    pub fn mean_light(&self) -> Vec4 {
        let linear: [f64; 256] = std::array::from_fn(|code| linear_from_srgb(code as f64 / 255.0));
        let texels = self.rgba.iter().map(|&[r, g, b, a]| {
            let [r, g, b] = [r, g, b].map(|code| linear[usize::from(code)]);
            DVec4::new(r, g, b, f64::from(a) / 255.0)
        });
        (texels.sum::<DVec4>() / self.rgba.len() as f64).as_vec4()
    }
}

/// The sRGB transfer function (IEC 61966-2-1), in and out in [0, 1].
pub fn linear_from_srgb(value: f64) -> f64 {
    if value <= 0.040_45 { value / 12.92 } else { ((value + 0.055) / 1.055).powf(2.4) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mean_of_colours_is_taken_in_linear_light() {
        let image = Image { width: 2, height: 1, rgba: vec![[0, 0, 0, 255], [255, 128, 255, 255]] };
        let mean = image.mean_light();
        assert!(mean.abs_diff_eq(Vec4::new(0.5, 0.107_93, 0.5, 1.0), 1e-4), "{mean}");
    }

    /// The worked example of KHR_texture_transform: a rotation of 90° takes (0, 1) to (1, 0) · scale + offset.
    #[test]
    fn scale_comes_before_rotation_before_offset() {
        let quarter = std::f32::consts::FRAC_PI_2;
        let map = TextureRef::transform(Vec2::new(0.25, 0.5), quarter, Vec2::new(2.0, 4.0));
        let near = |a: Vec2, b: Vec2| assert!(a.abs_diff_eq(b, 1e-6), "{a} {b}");
        near(map.transform_point2(Vec2::ZERO), Vec2::new(0.25, 0.5));
        near(map.transform_point2(Vec2::new(0.0, 1.0)), Vec2::new(4.25, 0.5));
        near(map.transform_point2(Vec2::new(1.0, 0.0)), Vec2::new(0.25, -1.5));
    }
}
