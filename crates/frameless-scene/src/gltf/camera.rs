//! The file's cameras.

use std::f32::consts::PI;

use crate::{Camera, FARTHEST_M, Projection};

use super::error::Fault;
use super::json::Json;
use super::limits::Budget;
use super::node::Hierarchy;

/// The cameras at nodes of the scene, in the order of those nodes.
pub(super) fn load_cameras(
    root: &Json<'_>,
    hierarchy: &Hierarchy,
    budget: &mut Budget,
) -> Result<Vec<Camera>, Fault> {
    let definitions = root.list("cameras")?;
    let projections = definitions.iter().map(parse_projection).collect::<Result<Vec<_>, _>>()?;
    let mut cameras = Vec::new();
    for (file_index, node) in root.list("nodes")?.iter().enumerate() {
        let Some(reference) = node.field("camera")? else { continue };
        let camera = reference.index(definitions.len(), "cameras")?;
        let Some(index) = hierarchy.index_of[file_index] else { continue };
        let name = Some(definitions[camera].name()).filter(|name| !name.is_empty());
        let name = name.unwrap_or_else(|| node.name());
        // Many nodes may have one camera, with one long name.
        budget.allocate(node.pointer(), size_of::<Camera>() + name.len(), 1)?;
        let name = name.to_owned();
        cameras.push(Camera { name, node: index, projection: projections[camera] });
    }
    Ok(cameras)
}

fn parse_projection(json: &Json<'_>) -> Result<Projection, Fault> {
    let kind = json.required("type")?;
    match kind.text()? {
        "perspective" => {
            let yfov = json.required("perspective")?.required("yfov")?;
            let yfov_rad = yfov.number()?;
            if yfov_rad > 0.0 && yfov_rad < PI {
                return Ok(Projection::Perspective { yfov_rad });
            }
            Err(yfov.fault("an angle between 0 and π"))
        }
        "orthographic" => {
            let ymag = json.required("orthographic")?.required("ymag")?;
            // Negative ones mirror the picture; the specification advises against them.
            let magnitude = ymag.number()?.abs();
            if magnitude > 0.0 && magnitude <= FARTHEST_M {
                return Ok(Projection::Orthographic { ymag: magnitude });
            }
            Err(ymag.fault(format!("a height above 0 and up to {FARTHEST_M:e} m")))
        }
        _ => Err(kind.fault("perspective or orthographic")),
    }
}
