//! Light sources at one moment (KHR_lights_punctual).

use frameless_scene::{LightKind, Scene, State};
use glam::Vec3A;

/// A light where it is now.
#[derive(Clone, Debug)]
pub(crate) struct LightNow {
    kind: LightKind,
    position: Vec3A,
    /// Unit vector against the light's direction.
    backwards: Vec3A,
    pub(crate) intensity: Vec3A,
    range: f32,
}

/// What a light would send to a point if nothing stood in between.
pub(crate) struct Arriving {
    /// Unit vector to the light.
    pub(crate) direction: Vec3A,
    /// Linear RGB irradiance of a surface that faces the light.
    pub(crate) irradiance: Vec3A,
    /// The light's position; `None` if it is infinitely far away.
    pub(crate) position: Option<Vec3A>,
}

/// All lights of a scene, in its order.
pub(crate) fn lights_now(scene: &Scene, state: &State, lights: &mut Vec<LightNow>) {
    lights.clear();
    lights.extend(scene.lights.iter().zip(&state.light_intensity).map(|(light, &intensity)| {
        let world_from_light = &state.world_from_node[light.node as usize];
        LightNow {
            kind: light.kind,
            position: world_from_light.translation,
            backwards: world_from_light.matrix3.z_axis.normalize_or_zero(),
            intensity: intensity.into(),
            range: light.range,
        }
    }));
}

impl LightNow {
    /// I/r² · window · cone, or the irradiance of a directional light.
    ///
    /// window = clamp(1 − (r/range)⁴, 0, 1) and cone = clamp((cos − cos_outer)/(cos_inner − cos_outer), 0, 1)², both as
    /// KHR_lights_punctual recommends.
    #[inline]
    pub(crate) fn at(&self, point: Vec3A) -> Arriving {
        if self.kind == LightKind::Directional {
            let (direction, irradiance) = (self.backwards, self.intensity);
            return Arriving { direction, irradiance, position: None };
        }
        // Nearer than a tenth of a millimetre a point light would be without bound.
        const NEAREST_SQUARED: f32 = 1e-8;
        let towards = self.position - point;
        let r2 = towards.length_squared().max(NEAREST_SQUARED);
        let direction = towards / r2.sqrt();
        let window = if self.range.is_finite() {
            (1.0 - (r2 / (self.range * self.range)).powi(2)).clamp(0.0, 1.0)
        } else {
            1.0
        };
        let irradiance = self.intensity * (window * self.cone(direction) / r2);
        Arriving { direction, irradiance, position: Some(self.position) }
    }

    fn cone(&self, direction: Vec3A) -> f32 {
        let LightKind::Spot { cos_inner, cos_outer } = self.kind else { return 1.0 };
        let cos = direction.dot(self.backwards);
        let width = (cos_inner - cos_outer).max(1e-4);
        ((cos - cos_outer) / width).clamp(0.0, 1.0).powi(2)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn light(kind: LightKind, range: f32) -> LightNow {
        // At (0, 2, 0), shining down.
        let (position, backwards) = (Vec3A::new(0.0, 2.0, 0.0), Vec3A::Y);
        LightNow { kind, position, backwards, intensity: Vec3A::ONE, range }
    }

    #[test]
    fn point_light_falls_with_the_square() {
        let point = light(LightKind::Point, f32::INFINITY);
        assert_eq!(point.at(Vec3A::ZERO).irradiance.x, 0.25);
        assert_eq!(point.at(Vec3A::NEG_Y * 2.0).irradiance.x, 1.0 / 16.0);
        assert!(point.at(point.position).irradiance.is_finite());
    }

    #[test]
    fn range_ends_the_light() {
        let point = light(LightKind::Point, 4.0);
        assert_eq!(point.at(Vec3A::ZERO).irradiance.x, 0.25 * (1.0 - 1.0 / 16.0));
        assert_eq!(point.at(Vec3A::NEG_Y * 2.0).irradiance.x, 0.0);
    }

    #[test]
    fn spot_is_full_inside_and_nothing_outside() {
        let spot = light(LightKind::Spot { cos_inner: 0.9, cos_outer: 0.7 }, f32::INFINITY);
        let share = |cos: f32| {
            let point = spot.position + 2.0 * Vec3A::new((1.0 - cos * cos).sqrt(), -cos, 0.0);
            spot.at(point).irradiance.x * 4.0
        };
        assert!((share(0.95) - 1.0).abs() < 1e-5);
        assert!((share(0.8) - 0.25).abs() < 1e-4, "half way in cosine: (1/2)²");
        assert_eq!(share(0.65), 0.0);
    }
}
