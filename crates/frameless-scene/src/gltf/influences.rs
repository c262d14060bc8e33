//! Which joints carry a vertex, and how much: brought to weights that sum to one.

use crate::{Influences, Mesh};

use super::document::Document;
use super::json::Json;
use super::mesh::extend;

/// Appends the sets of more vertices, of which the first is vertex number `first` of `all`; sets that one side lacks have no
/// weight there.
pub(super) fn append_influences(
    sets: &mut Vec<Influences>,
    more: Vec<Influences>,
    first: usize,
    all: usize,
) {
    if sets.len() < more.len() {
        sets.resize_with(more.len(), Influences::default);
    }
    let mut more = more.into_iter();
    for set in sets {
        let (joints, weights) = more.next().map(|m| (m.joints, m.weights)).unzip();
        extend(&mut set.joints, joints, [0; 4], first, all);
        extend(&mut set.weights, weights, [0.0; 4], first, all);
    }
}

/// Brings every vertex's weights to a sum of one, over all sets (glTF 2.0 §3.7.3.3 wants them so). Negative weights and those
/// that are no numbers count as 0; a vertex without any weight follows its first joint. A joint without weight is joint 0.
pub(super) fn settle_influences(mesh: &mut Mesh, json: &Json<'_>, document: &mut Document<'_>) {
    let sets = &mut mesh.influences;
    let (mut strange, mut weightless) = (false, false);
    for vertex in 0..sets.first().map_or(0, |set| set.weights.len()) {
        let mut sum = 0.0;
        for weight in sets.iter_mut().flat_map(|set| &mut set.weights[vertex]) {
            if !(*weight >= 0.0 && weight.is_finite()) {
                (*weight, strange) = (0.0, true);
            }
            sum += f64::from(*weight);
        }
        if sum > 0.0 {
            let scale = |weight: &mut f32| *weight = (f64::from(*weight) / sum) as f32;
            sets.iter_mut().flat_map(|set| &mut set.weights[vertex]).for_each(scale);
        } else {
            (sets[0].weights[vertex][0], weightless) = (1.0, true);
        }
        for set in sets.iter_mut() {
            for (joint, weight) in set.joints[vertex].iter_mut().zip(set.weights[vertex]) {
                if weight == 0.0 {
                    *joint = 0;
                }
            }
        }
    }
    // Of a set that counts nowhere, nobody needs to know.
    let counts = |set: &Influences| set.weights.as_flattened().iter().any(|&weight| weight > 0.0);
    sets.retain(counts);
    if strange {
        let what = "joint weights that are negative, infinite or NaN count as 0";
        document.warnings.about(what, json.called("mesh"));
    }
    if weightless {
        let what = "vertices without a joint weight follow their first joint";
        document.warnings.about(what, json.called("mesh"));
    }
}
