//! Extensions: which are understood, and what is said about the others.

use std::collections::BTreeSet;

use super::error::{Fault, Place, Problem, quoted};
use super::json::Json;
use super::value::Value;
use super::warnings::Warnings;

/// Extensions that are read. What of them is not drawn is warned about where it occurs.
const SUPPORTED: [&str; 14] = [
    "EXT_mesh_gpu_instancing",
    super::compressed::NAME,
    "EXT_texture_webp",
    "KHR_lights_punctual",
    "KHR_materials_clearcoat",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_sheen",
    "KHR_materials_specular",
    "KHR_materials_transmission",
    "KHR_materials_unlit",
    "KHR_materials_volume",
    "KHR_mesh_quantization",
    "KHR_texture_transform",
];

/// Refuses a file that cannot be understood without an extension which is not supported; warns of those without which it can.
pub(super) fn check_extensions(
    root: &Json<'_>,
    value: &Value<'_>,
    warnings: &mut Warnings,
) -> Result<(), Fault> {
    for required in root.list("extensionsRequired")? {
        let name = required.text()?;
        if !SUPPORTED.contains(&name) {
            let place = Place::Pointer(required.pointer().to_owned());
            let problem = Problem::RequiredExtension(quoted(name));
            return Err(Fault { place, problem });
        }
    }
    let mut names = BTreeSet::new();
    for used in root.list("extensionsUsed")? {
        names.insert(used.text()?);
    }
    collect_names(value, &mut names);
    for name in names.into_iter().filter(|name| !SUPPORTED.contains(name)) {
        warnings.add(format!("the extension {} is ignored", quoted(name)));
    }
    Ok(())
}

/// The keys of all `extensions` objects but those in `extras`; undeclared ones are ignored just like declared ones. Walks
/// without recursion.
fn collect_names<'a>(value: &'a Value<'a>, names: &mut BTreeSet<&'a str>) {
    let mut open = vec![value];
    while let Some(value) = open.pop() {
        match value {
            Value::Array(elements) => open.extend(elements),
            Value::Object(members) => {
                if let Some(Value::Object(extensions)) = value.get("extensions") {
                    names.extend(extensions.iter().map(|(name, _)| name.as_ref()));
                }
                let others = members.iter().filter(|(key, _)| key != "extras");
                open.extend(others.map(|(_, member)| member));
            }
            _ => {}
        }
    }
}
