//! What a material says at one point: factors, textures and vertex colours multiplied.

use frameless_scene::{AlphaMode, Layers, Material, Scene};
use glam::{Vec3A, Vec4};

use crate::patch::Patch;
use crate::texture::{Encoding, depends_on_distance};
use crate::world::World;

/// A material's values at a point.
#[derive(Clone, Debug)]
pub(crate) struct Matter {
    /// Linear RGB: factor · texture · vertex colour.
    pub(crate) base: Vec3A,
    /// Part of what arrives from behind that does not pass; 1 unless the material blends.
    pub(crate) alpha: f32,
    /// 0: dielectric, 1: metal.
    pub(crate) metallic: f32,
    /// 0: mirror, 1: matte.
    pub(crate) roughness: f32,
    /// How strongly a dielectric reflects, see [`Material::specular`].
    pub(crate) specular: f32,
    /// Part of ambient light that arrives.
    pub(crate) occlusion: f32,
    /// Linear RGB radiance given off.
    pub(crate) emissive: Vec3A,
    /// Of materials that extensions say more of: so that all others are small.
    pub(crate) layers: Option<Box<LayersHere>>,
}

/// [`Layers`] at a point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LayersHere {
    pub(crate) ior: f32,
    /// Linear RGB.
    pub(crate) specular_color: Vec3A,
    pub(crate) transmission: f32,
    /// Whether light that passes is refracted; else the surface is a thin wall.
    pub(crate) refracts: bool,
    pub(crate) coat: f32,
    pub(crate) coat_roughness: f32,
    /// As [`crate::point::Point::normal`], which it is unless the coat has a normal map of its own, or the surface has one.
    pub(crate) coat_normal: Vec3A,
    /// Linear RGB.
    pub(crate) sheen: Vec3A,
    pub(crate) sheen_roughness: f32,
}

impl Matter {
    /// Nothing is reflected.
    #[cfg(test)]
    pub(crate) const BLACK: Matter = Matter {
        base: Vec3A::ZERO,
        alpha: 1.0,
        metallic: 0.0,
        roughness: 1.0,
        specular: 0.0,
        occlusion: 1.0,
        emissive: Vec3A::ZERO,
        layers: None,
    };

    /// Whether light is scattered evenly, and nothing else is done with it.
    #[inline(always)]
    pub(crate) fn is_matte(&self) -> bool {
        self.specular <= 0.0 && self.metallic <= 0.0 && self.layers.is_none()
    }

    /// Of a material that [is plain](is_plain). `color`: of the vertices, linear RGBA.
    #[inline(always)]
    pub(crate) fn plain(
        world: &World,
        material: &Material,
        patch: &Patch<'_>,
        color: Vec4,
    ) -> Matter {
        let base = base(world, material, patch, color);
        Matter {
            base: Vec3A::from_vec4(base),
            alpha: 1.0,
            metallic: material.metallic,
            roughness: material.roughness,
            specular: material.specular,
            occlusion: 1.0,
            emissive: material.emissive.into(),
            layers: None,
        }
    }

    /// Of any material.
    pub(crate) fn new(
        world: &World,
        material: &Material,
        patch: &Patch<'_>,
        color: Vec4,
    ) -> Matter {
        let mut matter = Matter::plain(world, material, patch, color);
        if material.alpha_mode == AlphaMode::Blend {
            matter.alpha = base(world, material, patch, color).w;
        }
        let number = |reference| patch.look_up(world, &reference, Encoding::Number);
        if let Some(reference) = material.metallic_roughness_texture {
            let texel = number(reference);
            matter.roughness *= texel.y;
            matter.metallic *= texel.z;
        }
        if let Some((reference, strength)) = material.occlusion_texture {
            matter.occlusion = 1.0 + strength * (number(reference).x - 1.0);
        }
        if let Some(reference) = material.emissive_texture {
            let texel = patch.look_up(world, &reference, Encoding::Color);
            matter.emissive *= Vec3A::from_vec4(texel);
        }
        if let Some(layers) = &material.layers {
            matter.specular *= layers.specular_texture.map_or(1.0, |texture| number(texture).w);
            matter.layers = Some(Box::new(LayersHere::new(world, layers, patch)));
        }
        matter
    }
}

/// Whether a material is opaque and has no textures but that of its base colour, of which it does not matter how much a pixel sees.
pub(crate) fn is_plain(scene: &Scene, material: &Material) -> bool {
    material.alpha_mode != AlphaMode::Blend
        && material.layers.is_none()
        && material.textures().all(|(reference, _)| {
            Some(reference) == material.base_color_texture
                && !depends_on_distance(&scene.textures[reference.texture as usize])
        })
}

/// The last number of [`base`].
#[inline]
fn alpha(world: &World, material: &Material, patch: &Patch<'_>, color: Vec4) -> f32 {
    let factor = material.base_color.w * color.w;
    match &material.base_color_texture {
        None => factor,
        Some(reference) => factor * patch.look_up_alpha(world, reference),
    }
}

/// Linear RGBA of the base colour.
#[inline]
fn base(world: &World, material: &Material, patch: &Patch<'_>, color: Vec4) -> Vec4 {
    let factor = material.base_color * color;
    match &material.base_color_texture {
        None => factor,
        Some(reference) => factor * patch.look_up(world, reference, Encoding::Color),
    }
}

impl LayersHere {
    fn new(world: &World, layers: &Layers, patch: &Patch<'_>) -> LayersHere {
        let texel = |reference, encoding| patch.look_up(world, &reference, encoding);
        let color = |factor: glam::Vec3, reference: Option<_>| {
            let texel = reference.map(|reference| texel(reference, Encoding::Color));
            Vec3A::from(factor) * texel.map_or(Vec3A::ONE, Vec3A::from_vec4)
        };
        let channel = |factor: f32, reference: Option<_>, channel: usize| {
            factor * reference.map_or(1.0, |reference| texel(reference, Encoding::Number)[channel])
        };
        LayersHere {
            ior: layers.ior,
            specular_color: color(layers.specular_color, layers.specular_color_texture),
            transmission: channel(layers.transmission, layers.transmission_texture, 0),
            refracts: layers.volume.is_some(),
            coat: channel(layers.clearcoat, layers.clearcoat_texture, 0),
            coat_roughness: channel(
                layers.clearcoat_roughness,
                layers.clearcoat_roughness_texture,
                1,
            ),
            // Known when the point is.
            coat_normal: Vec3A::Z,
            sheen: color(layers.sheen_color, layers.sheen_color_texture),
            sheen_roughness: channel(layers.sheen_roughness, layers.sheen_roughness_texture, 3),
        }
    }
}

/// How much of a surface is there at a point, of a material that is not opaque: its alpha where it blends; where it is masked, all or
/// nothing.
pub(crate) fn coverage(world: &World, material: &Material, patch: &Patch<'_>, color: Vec4) -> f32 {
    match material.alpha_mode {
        AlphaMode::Opaque => 1.0,
        AlphaMode::Blend => alpha(world, material, patch, color),
        AlphaMode::Mask { cutoff } => {
            if alpha(world, material, patch, color) < cutoff {
                0.0
            } else {
                1.0
            }
        }
    }
}
