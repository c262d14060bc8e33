//! The file's lights: KHR_lights_punctual.

use std::f32::consts::{FRAC_PI_2, FRAC_PI_4};
use std::fmt::Display;

use glam::Vec3;

use crate::{Light, LightKind};

use super::error::Fault;
use super::json::Json;
use super::limits::{Limits, within};
use super::node::Hierarchy;
use super::warnings::Warnings;

const EXTENSION: &str = "KHR_lights_punctual";

/// The lights at nodes of the scene, in the order of those nodes.
pub(super) fn load_lights(
    root: &Json<'_>,
    hierarchy: &Hierarchy,
    limits: &Limits,
    warnings: &mut Warnings,
) -> Result<Vec<Light>, Fault> {
    let definitions = match root.extension(EXTENSION)? {
        Some(extension) => extension.list("lights")?,
        None => Vec::new(),
    };
    let parsed = definitions.iter().map(|light| parse_light(light, warnings));
    let definitions = parsed.collect::<Result<Vec<_>, _>>()?;
    let mut lights = Vec::new();
    for (file_index, node) in root.list("nodes")?.iter().enumerate() {
        let Some(extension) = node.extension(EXTENSION)? else { continue };
        let light = extension.required("light")?.index(definitions.len(), "lights")?;
        if let Some(index) = hierarchy.index_of[file_index] {
            within(lights.len() as u64 + 1, limits.lights, "lights", extension.pointer())?;
            lights.push(Light { node: index, ..definitions[light] });
        }
    }
    Ok(lights)
}

/// A light at node 0.
fn parse_light(json: &Json<'_>, warnings: &mut Warnings) -> Result<Light, Fault> {
    let color = Vec3::from_array(json.numbers_or("color", [1.0; 3])?);
    let intensity = json.number_or("intensity", 1.0)?;
    let wrong = |field: &str, wanted: &str, came: &dyn Display| {
        Err(Fault::at(&format!("{}/{field}", json.pointer()), wanted, came))
    };
    if color.min_element() < 0.0 {
        return wrong("color", "parts that are not negative", &color);
    }
    if intensity < 0.0 || !(color * intensity).is_finite() {
        let wanted = "a number that is not negative, and finite times the colour";
        return wrong("intensity", wanted, &intensity);
    }
    let range = json.number_or("range", f32::INFINITY)?;
    if range <= 0.0 {
        return wrong("range", "a length above 0", &range);
    }
    let kind = json.required("type")?;
    let kind = match kind.text()? {
        "point" => LightKind::Point,
        "directional" => LightKind::Directional,
        "spot" => parse_cone(json, warnings)?,
        _ => return Err(kind.fault("point, spot or directional")),
    };
    Ok(Light { node: 0, kind, intensity: color * intensity, range })
}

/// What the specification forbids but can be drawn is: as wide as may be, with a border as sharp as may be.
fn parse_cone(json: &Json<'_>, warnings: &mut Warnings) -> Result<LightKind, Fault> {
    let Some(spot) = json.field("spot")? else { return Ok(cone(0.0, FRAC_PI_4)) };
    let inner = spot.number_or("innerConeAngle", 0.0)?;
    let outer = spot.number_or("outerConeAngle", FRAC_PI_4)?;
    if inner < 0.0 || outer <= 0.0 {
        let came = format!("{inner} and {outer}");
        return Err(Fault::at(spot.pointer(), "cone angles with 0 <= inner < outer <= π/2", came));
    }
    // Exporters write π/2 with too few digits.
    const SLACK_RAD: f32 = 1e-4;
    if outer > FRAC_PI_2 + SLACK_RAD {
        let what = "spot lights with an outer cone angle above π/2 shine forwards only";
        warnings.about(what, json.called("light"));
    }
    if inner >= outer {
        let what = "spot lights whose inner cone angle is not less than the outer one have sharp borders there";
        warnings.about(what, json.called("light"));
    }
    Ok(cone(inner.min(outer), outer))
}

fn cone(inner: f32, outer: f32) -> LightKind {
    /// Narrowest border, as a difference of cosines: the fall-off divides by it.
    const NARROWEST: f32 = 1e-4;
    let cos_outer = outer.min(FRAC_PI_2).cos().clamp(0.0, 1.0 - NARROWEST);
    LightKind::Spot { cos_inner: inner.cos().max(cos_outer + NARROWEST), cos_outer }
}
