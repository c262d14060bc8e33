//! What extensions add to a material: KHR_materials_ior, _specular, _transmission, _volume, _clearcoat and _sheen.

use glam::Vec3;

use crate::{Layers, Material, Volume};

use super::document::Document;
use super::error::Fault;
use super::json::Json;
use super::material::{refer_scaled, unit_interval};
use super::texture::Textures;

/// Fills in what the material's extensions say; `owner` is how messages call it.
pub(super) fn load_layers(
    json: &Json<'_>,
    material: &mut Material,
    owner: &str,
    document: &mut Document<'_>,
    textures: &mut Textures<'_>,
) -> Result<(), Fault> {
    let mut reader = Reader { owner, document, textures };
    let mut layers = Layers::default();
    if let Some(ior) = json.extension("KHR_materials_ior")? {
        layers.ior = reader.ior(&ior)?;
    }
    if let Some(specular) = json.extension("KHR_materials_specular")? {
        material.specular = reader.unit(&specular, "specularFactor", 1.0)?;
        layers.specular_color = reader.color(&specular, "specularColorFactor", Vec3::ONE)?;
        layers.specular_texture = reader.texture(&specular, "specularTexture")?;
        layers.specular_color_texture = reader.texture(&specular, "specularColorTexture")?;
    }
    if let Some(transmission) = json.extension("KHR_materials_transmission")? {
        layers.transmission = reader.unit(&transmission, "transmissionFactor", 0.0)?;
        layers.transmission_texture = reader.texture(&transmission, "transmissionTexture")?;
    }
    if let Some(volume) = json.extension("KHR_materials_volume")? {
        layers.volume = reader.volume(&volume)?;
    }
    if let Some(coat) = json.extension("KHR_materials_clearcoat")? {
        reader.clearcoat(&coat, &mut layers)?;
    }
    if let Some(sheen) = json.extension("KHR_materials_sheen")? {
        let color = reader.color(&sheen, "sheenColorFactor", Vec3::ZERO)?;
        layers.sheen_color = color.min(Vec3::ONE);
        layers.sheen_roughness = reader.unit(&sheen, "sheenRoughnessFactor", 0.0)?;
        layers.sheen_color_texture = reader.texture(&sheen, "sheenColorTexture")?;
        layers.sheen_roughness_texture = reader.texture(&sheen, "sheenRoughnessTexture")?;
    }
    if layers != Layers::default() {
        material.layers = Some(Box::new(layers));
    }
    Ok(())
}

/// Reads members of one material's extensions.
struct Reader<'a, 'd, 't, 'f> {
    owner: &'a str,
    document: &'a mut Document<'d>,
    textures: &'t mut Textures<'f>,
}

impl Reader<'_, '_, '_, '_> {
    /// A factor in [0, 1].
    fn unit(&mut self, holder: &Json<'_>, key: &str, default: f32) -> Result<f32, Fault> {
        let factor = holder.number_or(key, default)?;
        Ok(unit_interval(factor, self.owner, &mut self.document.warnings))
    }

    /// A colour whose channels are at least 0.
    fn color(&mut self, holder: &Json<'_>, key: &str, default: Vec3) -> Result<Vec3, Fault> {
        let color = Vec3::from_array(holder.numbers_or(key, default.to_array())?);
        if color.min_element() < 0.0 {
            let what = "negative colours of materials were taken as 0";
            self.document.warnings.about(what, self.owner);
        }
        Ok(color.max(Vec3::ZERO))
    }

    fn texture(
        &mut self,
        holder: &Json<'_>,
        key: &str,
    ) -> Result<Option<crate::TextureRef>, Fault> {
        self.textures.refer(holder, key, self.owner, self.document)
    }

    /// 0 stands for infinity; other numbers below 1 are not in nature.
    fn ior(&mut self, holder: &Json<'_>) -> Result<f32, Fault> {
        let ior = holder.number_or("ior", Layers::USUAL_IOR)?;
        if ior == 0.0 {
            return Ok(f32::INFINITY);
        }
        if ior < 1.0 {
            let what = "refractive indices below 1 were taken as 1";
            self.document.warnings.about(what, self.owner);
        }
        Ok(ior.max(1.0))
    }

    /// A thickness is for renderers that do not trace rays; here it only tells whether there is a volume at all.
    fn volume(&mut self, holder: &Json<'_>) -> Result<Option<Volume>, Fault> {
        let thickness = holder.number_or("thicknessFactor", 0.0)?;
        self.textures.check_member(holder, "thicknessTexture")?;
        let color = self.color(holder, "attenuationColor", Vec3::ONE)?;
        let distance = holder.number_or("attenuationDistance", f32::INFINITY)?;
        if distance <= 0.0 {
            let what = "attenuation distances that are not positive attenuate nothing";
            self.document.warnings.about(what, self.owner);
        }
        Ok((thickness > 0.0).then(|| Volume::attenuating(color, distance)))
    }

    fn clearcoat(&mut self, holder: &Json<'_>, layers: &mut Layers) -> Result<(), Fault> {
        layers.clearcoat = self.unit(holder, "clearcoatFactor", 0.0)?;
        layers.clearcoat_roughness = self.unit(holder, "clearcoatRoughnessFactor", 0.0)?;
        layers.clearcoat_texture = self.texture(holder, "clearcoatTexture")?;
        layers.clearcoat_roughness_texture = self.texture(holder, "clearcoatRoughnessTexture")?;
        let scaled = ["clearcoatNormalTexture", "scale"];
        layers.clearcoat_normal_texture =
            refer_scaled(holder, scaled, self.owner, self.document, self.textures)?;
        Ok(())
    }
}
