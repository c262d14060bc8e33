//! Skins: which nodes carry the vertices of meshes, and where from (glTF 2.0 §3.7.3).

use glam::{Affine3A, Mat4};

use crate::Skin;

use super::document::Document;
use super::error::Fault;
use super::json::Json;
use super::node::Hierarchy;

/// All skins of the file; `None` where a joint is not in the scene, so that nothing can be said of where it is.
pub(super) fn load_skins(
    document: &mut Document<'_>,
    hierarchy: &Hierarchy,
) -> Result<Vec<Option<Skin>>, Fault> {
    let skins = document.root.list("skins")?;
    skins.iter().map(|json| load_skin(json, document, hierarchy)).collect()
}

fn load_skin(
    json: &Json<'_>,
    document: &mut Document<'_>,
    hierarchy: &Hierarchy,
) -> Result<Option<Skin>, Fault> {
    let nodes = hierarchy.index_of.len();
    let mut joints = Vec::new();
    let list = json.required("joints")?;
    for joint in list.elements()? {
        joints.push(hierarchy.index_of[joint.index(nodes, "nodes")?]);
    }
    if joints.is_empty() {
        return Err(list.fault("at least one joint"));
    }
    if let Some(skeleton) = json.field("skeleton")? {
        skeleton.index(nodes, "nodes")?;
    }
    let inverse_bind = load_inverse_bind(json, joints.len(), document)?;
    let joints: Option<Vec<u32>> = joints.into_iter().collect();
    Ok(joints.map(|joints| Skin { name: json.name().to_owned(), joints, inverse_bind }))
}

/// One matrix per joint; without any in the file, nothing is undone.
fn load_inverse_bind(
    json: &Json<'_>,
    joints: usize,
    document: &mut Document<'_>,
) -> Result<Vec<Affine3A>, Fault> {
    let Some(reference) = json.field("inverseBindMatrices")? else {
        document.budget.allocate(json.pointer(), joints, size_of::<Affine3A>())?;
        return Ok(vec![Affine3A::IDENTITY; joints]);
    };
    let accessor = &document.accessors[reference.index(document.accessors.len(), "accessors")?];
    accessor.check_kind(&["MAT4"], &reference)?;
    if accessor.count < joints {
        let wanted = format!("a matrix for each of the {joints} joints");
        return Err(Fault::at(reference.pointer(), wanted, accessor.count));
    }
    let matrices = accessor.numbers::<16>(&mut document.budget)?;
    let mut infinite = false;
    let affine = matrices[..joints].iter().map(|numbers| {
        // The bottom row is (0, 0, 0, 1), as the specification wants it.
        let matrix = Affine3A::from_mat4(Mat4::from_cols_array(numbers));
        infinite |= !matrix.is_finite();
        if matrix.is_finite() { matrix } else { Affine3A::IDENTITY }
    });
    let affine = affine.collect();
    if infinite {
        let what = "infinite or NaN bind matrices were left out";
        document.warnings.about(what, json.called("skin"));
    }
    Ok(affine)
}
