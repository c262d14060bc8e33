//! What of the punctual lights reaches a point.

use std::f32::consts::FRAC_1_PI;

use glam::Vec3A;

use crate::direct::Probe;
use crate::integrator::Settings;
use crate::moment::Moment;
use crate::point::Point;
use crate::ray::Ray;
use crate::traverse::Stack;
use crate::world::World;

/// The answer of all lights.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Asked {
    /// Σ E cosθ V / π.
    pub(crate) all: Vec3A,
    /// Of those lights that nothing stands before.
    pub(crate) unhindered: Vec3A,
    /// Which these are, see [`frameless::Surface::lit`]; the first 32.
    pub(crate) lit: u32,
}

/// Light that reaches a point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Arriving {
    /// Unit length, world coordinates.
    pub(crate) to_light: Vec3A,
    /// Of a surface that faces the light.
    pub(crate) irradiance: Vec3A,
    /// To the shading normal; positive.
    cos: f32,
}

impl Arriving {
    /// What a matte surface sends back of it, per albedo.
    #[inline(always)]
    fn per_albedo(&self) -> Vec3A {
        self.irradiance * (self.cos * FRAC_1_PI)
    }
}

impl World {
    /// Hands what reaches the point to `take`, and sums it up.
    #[inline(always)]
    pub(crate) fn ask_lights(
        &self,
        moment: &Moment,
        point: &Point,
        settings: &Settings,
        stack: &mut Stack,
        probe: &mut impl Probe,
        mut take: impl FnMut(Arriving),
    ) -> Asked {
        let mut asked = Asked { lit: u32::MAX, ..Asked::default() };
        for (index, light) in moment.lights.iter().enumerate() {
            let arriving = light.at(point.position.to_array());
            let to_light = Vec3A::from(arriving.direction);
            let irradiance = Vec3A::from(arriving.irradiance);
            let cos = point.normal.dot(to_light);
            let is_off = irradiance == Vec3A::ZERO;
            if cos <= 0.0 || (is_off && !settings.surfaces) {
                probe.note(|| format!("  light {index}: faces away or gives nothing"));
                continue;
            }
            let (direction, t_max) = match light.position {
                Some(position) => (Vec3A::from(position) - point.shadow_origin, 1.0),
                None => (to_light, f32::INFINITY),
            };
            let shadow_ray = Ray { origin: point.shadow_origin, direction };
            let passes = self.passing(moment, &shadow_ray, t_max, true, stack);
            let arriving = Arriving { to_light, irradiance: passes * irradiance, cos };
            probe.note(|| {
                let contribution = arriving.per_albedo();
                format!("  light {index}: {passes:.3} of it passes: {contribution:.5} per albedo (cos {cos:.4})")
            });
            if passes != Vec3A::ZERO {
                asked.all += arriving.per_albedo();
                take(arriving);
            }
            if passes == Vec3A::ONE {
                asked.unhindered += arriving.per_albedo();
            } else if index < 32 {
                asked.lit &= !(1 << index);
            }
        }
        asked
    }
}
