//! The integrator `direct`: light sources seen directly, and in mirrors. Deterministic (Whitted 1980).
//!
//! L = emissive + (1 − m)·base·(ambient + Σ_lights E cosθ V / π) + m·base·L(reflected)
//!
//! with E the light's irradiance, V its visibility (a hard shadow) and m the mirror weight, see [`mirror_weight`]. Both sides
//! of every surface are drawn, the normal turned towards the viewer: a back face that is culled would let light through
//! walls. Until there is a full BRDF, rough metals are matte in their base colour instead of black.

use std::f32::consts::FRAC_1_PI;

use frameless::Surface;
use frameless_scene::Material;
use glam::{Vec3, Vec3A};

use crate::first::FirstSurface;
use crate::integrator::Settings;
use crate::moment::Moment;
use crate::point::Point;
use crate::ray::Ray;
use crate::traverse::Stack;
use crate::world::World;

/// Is told what happens to a ray; see [`crate::explain`].
pub(crate) trait Probe {
    fn note(&mut self, line: impl FnOnce() -> String);
}

/// Does not listen.
pub(crate) struct NoProbe;

impl Probe for NoProbe {
    #[inline(always)]
    fn note(&mut self, _line: impl FnOnce() -> String) {}
}

impl World {
    /// What comes back along a ray.
    pub(crate) fn radiance(
        &self,
        moment: &Moment,
        mut ray: Ray,
        settings: &Settings,
        stack: &mut Stack,
        probe: &mut impl Probe,
    ) -> ([f32; 3], Surface) {
        let mut radiance = Vec3A::ZERO;
        let mut throughput = Vec3A::ONE;
        let mut first = FirstSurface::default();
        for depth in 0..=settings.max_depth {
            probe
                .note(|| format!("ray {depth}: from {:.5} along {:.5}", ray.origin, ray.direction));
            let Some(hit) = moment.targets(self).closest(&ray, stack) else {
                let sky = self.sky(ray.direction);
                let gives = throughput * sky;
                probe.note(|| {
                    format!(
                        "  nothing hit: sky {sky:.5}, throughput {throughput:.5}: adds {gives:.6}"
                    )
                });
                radiance += gives;
                first.see(self, || sky_surface(&ray), throughput);
                break;
            };
            probe.note(|| format!("  {hit:?}"));
            let point = Point::new(self, moment, &ray, &hit);
            let material = &self.scene().materials[point.material as usize];
            let mirror = if depth < settings.max_depth { mirror_weight(material) } else { 0.0 };
            probe.note(|| describe(&point, material, mirror));
            let albedo = (1.0 - mirror) * point.base;
            let (irradiance, lit) = self.direct_light(moment, &point, settings, stack, probe);
            let emissive = Vec3A::from(material.emissive);
            let ambient = Vec3A::from(self.scene().ambient);
            let gives = throughput * (emissive + albedo * (ambient + irradiance));
            probe.note(|| format!("  ambient {ambient:.5} per albedo; emits {emissive:.5}"));
            probe.note(|| {
                format!("  albedo {albedo:.5}, throughput {throughput:.5}: adds {gives:.6}")
            });
            radiance += gives;
            first.see(self, || point.surface(&hit, albedo, irradiance, lit), throughput);
            if depth == 0 && settings.surfaces {
                first.look_into_mirror(self, moment, &hit, ray.direction);
            }
            throughput *= mirror * point.base;
            if throughput == Vec3A::ZERO {
                break;
            }
            ray = Ray { origin: point.outside, direction: reflect(ray.direction, &point) };
        }
        (finite(radiance), first.surface(&ray))
    }

    /// Σ E cosθ V / π over the lights, and which of them reach the point.
    fn direct_light(
        &self,
        moment: &Moment,
        point: &Point,
        settings: &Settings,
        stack: &mut Stack,
        probe: &mut impl Probe,
    ) -> (Vec3A, u32) {
        let mut sum = Vec3A::ZERO;
        let take = |arriving: Arriving| sum += arriving.per_albedo();
        let lit = self.ask_lights(moment, point, settings, stack, probe, take);
        (sum, lit)
    }

    /// Hands what reaches the point to `take`, and says of which lights (see [`Surface::lit`]; the first 32).
    #[inline(always)]
    pub(crate) fn ask_lights(
        &self,
        moment: &Moment,
        point: &Point,
        settings: &Settings,
        stack: &mut Stack,
        probe: &mut impl Probe,
        mut take: impl FnMut(Arriving),
    ) -> u32 {
        let mut lit = u32::MAX;
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
            let is_shadowed = moment.targets(self).occluded(&shadow_ray, t_max, stack);
            let arriving = Arriving { to_light, irradiance, cos };
            probe.note(|| {
                let state = if is_shadowed { "in shadow, would give" } else { "visible, gives" };
                let contribution = arriving.per_albedo();
                format!("  light {index}: {state} {contribution:.5} per albedo (cos {cos:.4})")
            });
            if !is_shadowed {
                take(arriving);
            } else if index < 32 {
                lit &= !(1 << index);
            }
        }
        lit
    }

    /// Mixed between straight down and straight up by the direction's height.
    pub(crate) fn sky(&self, direction: Vec3A) -> Vec3A {
        let [down, up] = self.scene().sky.map(Vec3A::from);
        let height = direction.normalize_or_zero().y;
        down.lerp(up, 0.5 + 0.5 * height)
    }
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
    pub(crate) fn per_albedo(&self) -> Vec3A {
        self.irradiance * (self.cos * FRAC_1_PI)
    }
}

pub(crate) fn sky_surface(ray: &Ray) -> Surface {
    Surface {
        object: Surface::SKY,
        primitive: 0,
        position: ray.direction.to_array(),
        normal: (-ray.direction).to_array(),
        albedo: [0.0; 3],
        direct: [0.0; 3],
        lit: u32::MAX,
    }
}

/// How much of a surface is a mirror: metallic · (1 − smoothstep(roughness from 0.1 to 0.5)). Up to 0.1 a highlight is
/// narrower than a degree or two and a mirror tells it well; from 0.5 on a matte surface is the nearer picture.
fn mirror_weight(material: &Material) -> f32 {
    let x = ((material.roughness - 0.1) / (0.5 - 0.1)).clamp(0.0, 1.0);
    material.metallic * (1.0 - x * x * (3.0 - 2.0 * x))
}

/// r = d − 2(d·n)n; where that would go into the surface, about the triangle's own normal.
fn reflect(direction: Vec3A, point: &Point) -> Vec3A {
    let about = |normal: Vec3A| direction - 2.0 * direction.dot(normal) * normal;
    let reflected = about(point.normal);
    if reflected.dot(point.geometric_normal) > 0.0 {
        reflected
    } else {
        about(point.geometric_normal)
    }
}

/// Radiance as promised: what is not a number becomes black, what is beyond all numbers the largest.
pub(crate) fn finite(radiance: Vec3A) -> [f32; 3] {
    radiance.to_array().map(|c| if c.is_nan() { 0.0 } else { c.clamp(0.0, f32::MAX) })
}

/// Whether the material reflects and does nothing else.
pub(crate) fn is_pure_mirror(material: &Material) -> bool {
    mirror_weight(material) == 1.0 && material.emissive == Vec3::ZERO
}

fn describe(point: &Point, material: &Material, mirror: f32) -> String {
    format!(
        "  at {:.5} (in the object {:.5}), normal {:.5}\n  material {} \"{}\", uv {:.4?}, base colour {:.5}, mirror weight {mirror:.3}, \
         emissive {:.5}",
        point.position,
        point.local_position,
        point.normal,
        point.material,
        material.name,
        point.uv,
        point.base,
        material.emissive,
    )
}
