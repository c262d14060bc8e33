//! Materials: the metallic-roughness model (glTF 2.0 §3.9).

use glam::{DVec4, Vec3, Vec4};

use crate::Material;

use super::document::Document;
use super::error::Fault;
use super::json::Json;
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
        name: json.name(),
        metallic: 1.0,
        roughness: 1.0,
        double_sided: json.flag("doubleSided")?,
        emissive: load_emissive(json, &owner, document, textures)?,
        ..Material::default()
    };
    if let Some(pbr) = json.field("pbrMetallicRoughness")? {
        load_metallic_roughness(&pbr, &mut material, &owner, document, textures)?;
    }
    if json.extension("KHR_materials_unlit")?.is_some() {
        document.warnings.about("unlit materials are drawn lit and matte", &*owner);
        (material.metallic, material.roughness, material.specular) = (0.0, 1.0, 0.0);
    }
    warn_of_alpha(json, &owner, document)?;
    for (key, what) in [
        ("normalTexture", "normal textures are not drawn"),
        ("occlusionTexture", "occlusion textures are not drawn"),
    ] {
        if let Some(info) = json.field(key)? {
            textures.check(&info)?;
            document.warnings.about(what, &*owner);
        }
    }
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
    let metallic = unit_interval(pbr.number_or("metallicFactor", 1.0)?, owner, warnings);
    let roughness = unit_interval(pbr.number_or("roughnessFactor", 1.0)?, owner, warnings);
    if let Some(info) = pbr.field("baseColorTexture")? {
        material.base_color_texture = textures.refer(&info, owner, document)?;
    }
    // Roughness is in the green channel, metalness in the blue one (glTF 2.0 §3.9.2).
    let mean = match pbr.field("metallicRoughnessTexture")? {
        None => DVec4::ONE,
        Some(info) => {
            let what = "metallic-roughness textures are replaced by their mean";
            document.warnings.about(what, owner);
            textures.mean(&info, false, document)?.unwrap_or(DVec4::ONE)
        }
    };
    material.metallic = metallic * mean.z as f32;
    material.roughness = roughness * mean.y as f32;
    Ok(())
}

/// Factor · strength · mean of the texture. Without the mean, surfaces of which a small part glows would glow as a whole.
fn load_emissive(
    json: &Json<'_>,
    owner: &str,
    document: &mut Document<'_>,
    textures: &mut Textures<'_>,
) -> Result<Vec3, Fault> {
    let factor = json.numbers_or("emissiveFactor", [0.0; 3])?;
    let factor = factor.map(|x| unit_interval(x, owner, &mut document.warnings));
    let mut emissive = Vec3::from_array(factor);
    if let Some(extension) = json.extension("KHR_materials_emissive_strength")? {
        emissive *= emissive_strength(&extension, owner, document)?;
    }
    if let Some(info) = json.field("emissiveTexture")? {
        textures.check(&info)?;
        if emissive != Vec3::ZERO {
            document.warnings.about("emissive textures are replaced by their mean", owner);
            let mean = textures.mean(&info, true, document)?.unwrap_or(DVec4::ZERO);
            emissive *= mean.truncate().as_vec3();
        }
    }
    Ok(emissive)
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

fn warn_of_alpha(json: &Json<'_>, owner: &str, document: &mut Document<'_>) -> Result<(), Fault> {
    let Some(mode) = json.field("alphaMode")? else { return Ok(()) };
    let warnings = &mut document.warnings;
    match mode.text()? {
        "OPAQUE" => {}
        "BLEND" => warnings.about("alpha mode BLEND is drawn opaque", owner),
        "MASK" => warnings.about("alpha mode MASK is drawn opaque", owner),
        _ => return Err(mode.fault("OPAQUE, MASK or BLEND")),
    }
    Ok(())
}

/// `factor`, or the nearest that is in [0, 1].
fn unit_interval(factor: f32, owner: &str, warnings: &mut Warnings) -> f32 {
    if !(0.0..=1.0).contains(&factor) {
        warnings.about("material factors outside [0, 1] were moved there", owner);
    }
    factor.clamp(0.0, 1.0)
}
