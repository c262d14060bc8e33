//! Vertices that morph targets or joints bring to where no ray finds them, at time 0.

use crate::{Deformed, Scene, State};

use super::node::{Hierarchy, node_called};
use super::warnings::Warnings;

/// Each instance that deforms once. What gets lost later is told by whoever draws it.
pub(super) fn warn_of_lost_vertices(
    scene: &Scene,
    state: &State,
    hierarchy: &Hierarchy,
    warnings: &mut Warnings,
) {
    let mut deformed = Deformed::default();
    for (number, deformation) in scene.deformations.iter().enumerate() {
        scene.deform(number, state, &mut deformed);
        let lost = deformed.lost();
        if lost > 0 {
            let what =
                "vertices that morph targets or joints bring infinitely far away are not drawn";
            let node = scene.instances[deformation.instance as usize].node as usize;
            let (of, called) = (deformed.positions().len(), node_called(hierarchy, node));
            warnings.about(what, format!("{called} ({lost} of {of})"));
        }
    }
}
