//! Materials: how surfaces reflect light and let it through.

use glam::{Vec3, Vec4};

use crate::texture::TextureRef;

/// A metallic-roughness surface (glTF 2.0 §3.9). Factors are multiplied by textures where there are any; all numbers finite.
#[derive(Clone, Debug)]
pub struct Material {
    /// As in the file; may be empty.
    pub name: String,
    /// Linear RGBA.
    pub base_color: Vec4,
    /// sRGB-encoded.
    pub base_color_texture: Option<TextureRef>,
    /// 0: dielectric, 1: metal.
    pub metallic: f32,
    /// 0: mirror, 1: matte.
    pub roughness: f32,
    /// Roughness in green, metalness in blue.
    pub metallic_roughness_texture: Option<TextureRef>,
    /// How strongly a dielectric reflects, from 0 (not at all) to 1 (as its refractive index says); the factor of KHR_materials_specular.
    /// Metals do not know it.
    pub specular: f32,
    /// Directions of the normal in the tangent frame, and a factor for their x and y.
    pub normal_texture: Option<(TextureRef, f32)>,
    /// Which part of ambient light arrives (red), and how much that counts, from 0 to 1.
    pub occlusion_texture: Option<(TextureRef, f32)>,
    /// Linear RGB radiance given off.
    pub emissive: Vec3,
    /// sRGB-encoded.
    pub emissive_texture: Option<TextureRef>,
    /// What alpha means.
    pub alpha_mode: AlphaMode,
    /// Whether the camera sees back faces.
    pub double_sided: bool,
    /// Whether the base colour is shown as it is, whatever the light (KHR_materials_unlit).
    pub unlit: bool,
    /// What else extensions say of the surface.
    pub layers: Option<Box<Layers>>,
}

/// What alpha means: of texture, factor and vertex colour multiplied.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum AlphaMode {
    /// Nothing.
    #[default]
    Opaque,
    /// Below the cutoff there is no surface.
    Mask {
        /// Finite.
        cutoff: f32,
    },
    /// The part of what arrives from behind that does not pass.
    Blend,
}

/// Properties that only extensions give. The default changes nothing.
#[derive(Clone, Debug, PartialEq)]
pub struct Layers {
    /// Refractive index (KHR_materials_ior), at least 1; infinite: reflects everything, as IOR 0 in a file says.
    pub ior: f32,
    /// Factor of [`Material::specular`] (alpha).
    pub specular_texture: Option<TextureRef>,
    /// Colour of a dielectric's reflection at normal incidence; linear RGB, may be above 1 (KHR_materials_specular).
    pub specular_color: Vec3,
    /// sRGB-encoded.
    pub specular_color_texture: Option<TextureRef>,
    /// Part of the light that is not reflected which passes instead of being scattered (KHR_materials_transmission), in [0, 1].
    pub transmission: f32,
    /// Factor (red).
    pub transmission_texture: Option<TextureRef>,
    /// What the surface encloses (KHR_materials_volume); `None`: nothing, it is a thin wall and does not refract.
    pub volume: Option<Volume>,
    /// A clear coat's share of the surface (KHR_materials_clearcoat), in [0, 1].
    pub clearcoat: f32,
    /// Factor (red).
    pub clearcoat_texture: Option<TextureRef>,
    /// 0: smooth, 1: rough.
    pub clearcoat_roughness: f32,
    /// Factor (green).
    pub clearcoat_roughness_texture: Option<TextureRef>,
    /// As [`Material::normal_texture`], for the coat alone.
    pub clearcoat_normal_texture: Option<(TextureRef, f32)>,
    /// Light that fibres scatter back at grazing angles (KHR_materials_sheen), linear RGB in [0, 1].
    pub sheen_color: Vec3,
    /// sRGB-encoded.
    pub sheen_color_texture: Option<TextureRef>,
    /// 0: along the edge only, 1: everywhere.
    pub sheen_roughness: f32,
    /// Factor (alpha).
    pub sheen_roughness_texture: Option<TextureRef>,
}

/// What is inside a closed surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Volume {
    /// Part of the light that passes 1 m, as σ in e^(−σ·metres), linear RGB per metre; at least 0 and finite.
    pub absorption_per_m: Vec3,
}

impl Volume {
    /// So that white light has `color` (linear RGB) after `distance_m`: σ = −ln(color) / distance. An infinite distance, or one that is
    /// not positive, absorbs nothing.
    pub fn attenuating(color: Vec3, distance_m: f32) -> Volume {
        /// What absorbs everything within this much of the distance is black.
        const DARKEST: f32 = 1e-6;
        if !(distance_m > 0.0 && distance_m.is_finite()) {
            return Volume { absorption_per_m: Vec3::ZERO };
        }
        let sigma = |c: f32| (-c.clamp(DARKEST, 1.0).ln() / distance_m).min(f32::MAX);
        Volume { absorption_per_m: Vec3::from_array(color.to_array().map(sigma)) }
    }
}

impl Default for Material {
    /// glTF's default material: white, metallic 1, roughness 1 per the specification; ours is a matte
    /// white dielectric since that is what viewers show for primitives without a material.
    fn default() -> Self {
        Material {
            name: String::new(),
            base_color: Vec4::ONE,
            base_color_texture: None,
            metallic: 0.0,
            roughness: 1.0,
            metallic_roughness_texture: None,
            specular: 1.0,
            normal_texture: None,
            occlusion_texture: None,
            emissive: Vec3::ZERO,
            emissive_texture: None,
            alpha_mode: AlphaMode::Opaque,
            double_sided: false,
            unlit: false,
            layers: None,
        }
    }
}

impl Default for Layers {
    fn default() -> Self {
        Layers {
            ior: Layers::USUAL_IOR,
            specular_texture: None,
            specular_color: Vec3::ONE,
            specular_color_texture: None,
            transmission: 0.0,
            transmission_texture: None,
            volume: None,
            clearcoat: 0.0,
            clearcoat_texture: None,
            clearcoat_roughness: 0.0,
            clearcoat_roughness_texture: None,
            clearcoat_normal_texture: None,
            sheen_color: Vec3::ZERO,
            sheen_color_texture: None,
            sheen_roughness: 0.0,
            sheen_roughness_texture: None,
        }
    }
}

impl Layers {
    /// Of glass and of most plastics: what glTF takes where nothing is said.
    pub const USUAL_IOR: f32 = 1.5;
}

impl Material {
    /// All textures that it refers to, and whether their RGB is sRGB-encoded colour.
    pub fn textures(&self) -> impl Iterator<Item = (TextureRef, bool)> {
        let first = |pair: Option<(TextureRef, f32)>| pair.map(|(texture, _)| texture);
        let none = Layers::default();
        let layers = self.layers.as_deref().unwrap_or(&none);
        let colors = [
            self.base_color_texture,
            self.emissive_texture,
            layers.specular_color_texture,
            layers.sheen_color_texture,
        ];
        let data = [
            self.metallic_roughness_texture,
            first(self.normal_texture),
            first(self.occlusion_texture),
            layers.specular_texture,
            layers.transmission_texture,
            layers.clearcoat_texture,
            layers.clearcoat_roughness_texture,
            first(layers.clearcoat_normal_texture),
            layers.sheen_roughness_texture,
        ];
        let colors = colors.into_iter().flatten().map(|texture| (texture, true));
        colors.chain(data.into_iter().flatten().map(|texture| (texture, false)))
    }

    /// Whether its numbers are as promised; the error names what is not.
    pub(crate) fn check(&self) -> Result<(), String> {
        let unit = |x: f32| (0.0..=1.0).contains(&x);
        let wanted = |holds: bool, what: &str| match holds {
            true => Ok(()),
            false => Err(format!("wanted {what}")),
        };
        let finite = self.base_color.is_finite() && self.emissive.is_finite();
        let factors = unit(self.metallic) && unit(self.roughness) && unit(self.specular);
        wanted(finite && factors, "finite colours, factors in [0, 1]")?;
        let scales = [self.normal_texture, self.occlusion_texture];
        let cutoff = match self.alpha_mode {
            AlphaMode::Mask { cutoff } => cutoff.is_finite(),
            AlphaMode::Opaque | AlphaMode::Blend => true,
        };
        let scaled = scales.iter().flatten().all(|(_, scale)| scale.is_finite());
        wanted(scaled && cutoff, "finite texture scales and cutoff")?;
        let Some(layers) = &self.layers else { return Ok(()) };
        let colors = [layers.specular_color, layers.sheen_color];
        let colors = colors.iter().all(|c| c.is_finite() && c.min_element() >= 0.0);
        wanted(colors && layers.sheen_color.max_element() <= 1.0, "specular and sheen colours")?;
        let factors = [
            layers.transmission,
            layers.clearcoat,
            layers.clearcoat_roughness,
            layers.sheen_roughness,
        ];
        let sigma = layers.volume.map_or(Vec3::ZERO, |volume| volume.absorption_per_m);
        let volume = sigma.is_finite() && sigma.min_element() >= 0.0 && layers.ior >= 1.0;
        let coat = layers.clearcoat_normal_texture.is_none_or(|(_, scale)| scale.is_finite());
        wanted(factors.into_iter().all(unit) && volume && coat, "layers within their ranges")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn attenuation_has_its_colour_at_its_distance() {
        let color = Vec3::new(0.25, 0.5, 1.0);
        let sigma = Volume::attenuating(color, 2.0).absorption_per_m;
        let after = |metres: f32| Vec3::from_array((-sigma * metres).to_array().map(f32::exp));
        assert!(after(2.0).abs_diff_eq(color, 1e-6));
        assert!(after(4.0).abs_diff_eq(color * color, 1e-6));
    }

    #[test]
    fn absurd_attenuation_is_finite() {
        for distance in [0.0, -1.0, f32::NAN, f32::INFINITY, 1e-38, 1e38] {
            for color in [Vec3::ZERO, Vec3::ONE, Vec3::NEG_ONE, Vec3::splat(7.0)] {
                let volume = Volume::attenuating(color, distance);
                let sigma = volume.absorption_per_m;
                assert!(sigma.is_finite() && sigma.min_element() >= 0.0, "{color} {distance}");
            }
        }
    }
}
