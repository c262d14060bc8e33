//! Materials: the metallic-roughness model (glTF 2.0 §3.9).

use glam::{Vec3, Vec4};

use crate::{AlphaMode, Material, TextureRef};

use super::document::Document;
use super::error::Fault;
use super::json::Json;
use super::layers::load_layers;
use super::texture::Textures;
use super::warnings::Warnings;

/// All materials of the file, in its order.
pub(super) fn load_materials(
    document: &mut Document<'_>,
    textures: &mut Textures<'_>,
) -> Result<Vec<Material>, Fault> {
    let materials = document.root.list("materials")?;
    materials.iter().map(|json| load_material(json, document, textures)).collect()
}

fn load_material(
    json: &Json<'_>,
    document: &mut Document<'_>,
    textures: &mut Textures<'_>,
) -> Result<Material, Fault> {
    let owner = json.called("material");
    let mut material = Material {
        name: json.name().to_owned(),
        metallic: 1.0,
        double_sided: json.flag("doubleSided")?,
        alpha_mode: load_alpha_mode(json)?,
        unlit: json.extension("KHR_materials_unlit")?.is_some(),
        ..Material::default()
    };
    if let Some(pbr) = json.field("pbrMetallicRoughness")? {
        load_metallic_roughness(&pbr, &mut material, &owner, document, textures)?;
    }
    load_emissive(json, &mut material, &owner, document, textures)?;
    let scaled = ["normalTexture", "scale"];
    material.normal_texture = refer_scaled(json, scaled, &owner, document, textures)?;
    let scaled = ["occlusionTexture", "strength"];
    let occlusion = refer_scaled(json, scaled, &owner, document, textures)?;
    material.occlusion_texture = occlusion.map(|(texture, strength)| {
        (texture, unit_interval(strength, &owner, &mut document.warnings))
    });
    load_layers(json, &mut material, &owner, document, textures)?;
    Ok(material)
}

fn load_metallic_roughness(
    pbr: &Json<'_>,
    material: &mut Material,
    owner: &str,
    document: &mut Document<'_>,
    textures: &mut Textures<'_>,
) -> Result<(), Fault> {
    let warnings = &mut document.warnings;
    let color = pbr.numbers_or("baseColorFactor", [1.0; 4])?;
    material.base_color = Vec4::from_array(color.map(|x| unit_interval(x, owner, warnings)));
    material.metallic = unit_interval(pbr.number_or("metallicFactor", 1.0)?, owner, warnings);
    material.roughness = unit_interval(pbr.number_or("roughnessFactor", 1.0)?, owner, warnings);
    material.base_color_texture = textures.refer(pbr, "baseColorTexture", owner, document)?;
    material.metallic_roughness_texture =
        textures.refer(pbr, "metallicRoughnessTexture", owner, document)?;
    Ok(())
}

/// A texture, and the number that stands beside its index (1 if it does not).
pub(super) fn refer_scaled(
    holder: &Json<'_>,
    [key, scale]: [&str; 2],
    owner: &str,
    document: &mut Document<'_>,
    textures: &mut Textures<'_>,
) -> Result<Option<(TextureRef, f32)>, Fault> {
    let Some(info) = holder.field(key)? else { return Ok(None) };
    let scale = info.number_or(scale, 1.0)?;
    let texture = textures.refer(holder, key, owner, document)?;
    Ok(texture.map(|texture| (texture, scale)))
}

/// A texture of what does not shine is left out.
fn load_emissive(
    json: &Json<'_>,
    material: &mut Material,
    owner: &str,
    document: &mut Document<'_>,
    textures: &mut Textures<'_>,
) -> Result<(), Fault> {
    let factor = json.numbers_or("emissiveFactor", [0.0; 3])?;
    let factor = factor.map(|x| unit_interval(x, owner, &mut document.warnings));
    material.emissive = Vec3::from_array(factor);
    if let Some(extension) = json.extension("KHR_materials_emissive_strength")? {
        material.emissive *= emissive_strength(&extension, owner, document)?;
    }
    if material.emissive == Vec3::ZERO {
        return textures.check_member(json, "emissiveTexture");
    }
    material.emissive_texture = textures.refer(json, "emissiveTexture", owner, document)?;
    Ok(())
}

fn emissive_strength(
    extension: &Json<'_>,
    owner: &str,
    document: &mut Document<'_>,
) -> Result<f32, Fault> {
    let strength = extension.number_or("emissiveStrength", 1.0)?;
    if strength < 0.0 {
        document.warnings.about("a negative emissive strength was taken as 0", owner);
    }
    Ok(strength.max(0.0))
}

fn load_alpha_mode(json: &Json<'_>) -> Result<AlphaMode, Fault> {
    // JSON knows no NaN, and what is no 32-bit number is refused.
    let cutoff = json.number_or("alphaCutoff", 0.5)?;
    let Some(mode) = json.field("alphaMode")? else { return Ok(AlphaMode::Opaque) };
    match mode.text()? {
        "OPAQUE" => Ok(AlphaMode::Opaque),
        "MASK" => Ok(AlphaMode::Mask { cutoff }),
        "BLEND" => Ok(AlphaMode::Blend),
        _ => Err(mode.fault("OPAQUE, MASK or BLEND")),
    }
}

/// `factor`, or the nearest that is in [0, 1].
pub(super) fn unit_interval(factor: f32, owner: &str, warnings: &mut Warnings) -> f32 {
    if !(0.0..=1.0).contains(&factor) {
        warnings.about("material factors outside [0, 1] were moved there", owner);
    }
    factor.clamp(0.0, 1.0)
}
