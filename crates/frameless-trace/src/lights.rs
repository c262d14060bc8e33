//! Light sources at one moment (KHR_lights_punctual).

use frameless::Light;
use frameless_scene::{LightKind, Scene, State};

/// All lights of a scene, in its order.
pub(crate) fn lights_now(scene: &Scene, state: &State, lights: &mut Vec<Light>) {
    lights.clear();
    lights.extend(scene.lights.iter().zip(&state.light_intensity).map(|(light, &intensity)| {
        let world_from_light = &state.world_from_node[light.node as usize];
        let position = match light.kind {
            LightKind::Directional => None,
            _ => Some(world_from_light.translation.to_array()),
        };
        let cone = match light.kind {
            LightKind::Spot { cos_inner, cos_outer } => Some([cos_inner, cos_outer]),
            _ => None,
        };
        Light {
            position,
            backwards: world_from_light.matrix3.z_axis.normalize_or_zero().to_array(),
            intensity: intensity.to_array(),
            range: light.range,
            cone,
        }
    }));
}
