//! The lights at one time: what shading stored surfaces again needs to know of a renderer.

use crate::Surface;

/// The lights at one time, and how the objects stand in the world. Plain data, like [`crate::Pose`].
///
/// The light that comes straight from them to a matte surface, and that [`Surface::direct`] holds for the time of the sample, is
///
/// ```text
/// direct = albedo / π · Σ_i lit_i · E_i · max(0, n · l_i)
/// ```
///
/// with E_i the irradiance of light i at the point ([`Light::at`]), l_i the direction to it and n the normal. Shadows are those of
/// the sample ([`Surface::lit`]).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Lighting {
    /// All lights, in the order of the bits of [`Surface::lit`]; those beyond 32 take no part.
    pub lights: Vec<Light>,
    /// Per object number: its place in the world; `None` for an object that deforms, which is not shaded again.
    pub world_from_object: Vec<Option<Placement>>,
}

/// A point, spot or directional light as in KHR_lights_punctual.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Light {
    /// In the world; `None`: infinitely far away.
    pub position: Option<[f32; 3]>,
    /// Unit vector against the direction in which it shines. Not used by point lights.
    pub backwards: [f32; 3],
    /// Linear RGB: radiant intensity, or irradiance if it is infinitely far away.
    pub intensity: [f32; 3],
    /// Beyond this distance it gives nothing; may be infinite.
    pub range: f32,
    /// Cosines of a spot's inner and outer angle; `None`: it shines everywhere.
    pub cone: Option<[f32; 2]>,
}

/// What a light would send to a point if nothing stood in between.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Arriving {
    /// Unit vector to the light.
    pub direction: [f32; 3],
    /// Linear RGB irradiance of a surface that faces the light.
    pub irradiance: [f32; 3],
}

/// An affine map from an object's coordinates to the world's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placement {
    /// The first three rows: world = row · (x, y, z, 1).
    pub point: [[f32; 4]; 3],
    /// Takes normals along: the inverse transpose of the linear part, of any length.
    pub normal: [[f32; 3]; 3],
}

impl Light {
    /// Nearer than a tenth of a millimetre a point light would be without bound.
    pub(crate) const NEAREST_SQUARED: f32 = 1e-8;

    /// I/r² · window · cone, or the irradiance of a light that is infinitely far away.
    ///
    /// window = clamp(1 − (r/range)⁴, 0, 1) and cone = clamp((cos − cos_outer)/(cos_inner − cos_outer), 0, 1)², both as
    /// KHR_lights_punctual recommends.
    #[inline]
    pub fn at(&self, point: [f32; 3]) -> Arriving {
        let Some(position) = self.position else {
            return Arriving { direction: self.backwards, irradiance: self.intensity };
        };
        let towards: [f32; 3] = std::array::from_fn(|k| position[k] - point[k]);
        let r2 = dot(towards, towards).max(Light::NEAREST_SQUARED);
        let r = r2.sqrt();
        let direction = towards.map(|x| x / r);
        let window = if self.range.is_finite() {
            (1.0 - (r2 / (self.range * self.range)).powi(2)).clamp(0.0, 1.0)
        } else {
            1.0
        };
        let per_r2 = window * self.spot(direction) / r2;
        Arriving { direction, irradiance: self.intensity.map(|i| i * per_r2) }
    }

    fn spot(&self, direction: [f32; 3]) -> f32 {
        let Some([cos_inner, cos_outer]) = self.cone else { return 1.0 };
        let cos = dot(direction, self.backwards);
        let width = (cos_inner - cos_outer).max(1e-4);
        ((cos - cos_outer) / width).clamp(0.0, 1.0).powi(2)
    }
}

impl Lighting {
    /// The direct light that a surface sends back; `None` if its object is not shaded again (the sky, what deforms, what is
    /// gone).
    #[inline]
    pub fn direct(&self, surface: &Surface) -> Option<[f32; 3]> {
        let placement = (*self.world_from_object.get(surface.object as usize)?)?;
        let [x, y, z] = surface.position;
        let point = placement.point.map(|r| r[0] * x + r[1] * y + (r[2] * z + r[3]));
        let normal = placement.normal.map(|row| dot(row, surface.normal));
        let per_length = 1.0 / dot(normal, normal).sqrt().max(f32::MIN_POSITIVE);
        let mut sum = [0.0; 3];
        for (index, light) in self.lights.iter().take(32).enumerate() {
            if surface.lit & (1 << index) == 0 {
                continue;
            }
            let arriving = light.at(point);
            let cos = (dot(normal, arriving.direction) * per_length).max(0.0);
            (0..3).for_each(|k| sum[k] += arriving.irradiance[k] * cos);
        }
        let direct = |k: usize| surface.albedo[k] * std::f32::consts::FRAC_1_PI * sum[k];
        Some(std::array::from_fn(direct))
    }
}

#[inline]
fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// At (0, 2, 0), shining down.
    const POINT: Light = Light {
        position: Some([0.0, 2.0, 0.0]),
        backwards: [0.0, 1.0, 0.0],
        intensity: [1.0; 3],
        range: f32::INFINITY,
        cone: None,
    };

    #[test]
    fn point_light_falls_with_the_square() {
        assert_eq!(POINT.at([0.0; 3]).irradiance[0], 0.25);
        assert_eq!(POINT.at([0.0, -2.0, 0.0]).irradiance[0], 1.0 / 16.0);
        assert!(POINT.at([0.0, 2.0, 0.0]).irradiance[0].is_finite());
    }

    #[test]
    fn range_ends_the_light() {
        let ranged = Light { range: 4.0, ..POINT };
        assert_eq!(ranged.at([0.0; 3]).irradiance[0], 0.25 * (1.0 - 1.0 / 16.0));
        assert_eq!(ranged.at([0.0, -2.0, 0.0]).irradiance[0], 0.0);
    }

    #[test]
    fn spot_is_full_inside_and_nothing_outside() {
        let spot = Light { cone: Some([0.9, 0.7]), ..POINT };
        let share = |cos: f32| {
            spot.at([2.0 * (1.0 - cos * cos).sqrt(), 2.0 - 2.0 * cos, 0.0]).irradiance[0] * 4.0
        };
        assert!((share(0.95) - 1.0).abs() < 1e-5);
        assert!((share(0.8) - 0.25).abs() < 1e-4, "half way in cosine: (1/2)²");
        assert_eq!(share(0.65), 0.0);
    }

    #[test]
    fn a_matte_surface_by_hand() {
        // Twice as large, turned by 90° about x (y → z), and one to the right.
        let placement = Placement {
            point: [[2.0, 0.0, 0.0, 1.0], [0.0, 0.0, -2.0, 0.0], [0.0, 2.0, 0.0, 0.0]],
            normal: [[0.5, 0.0, 0.0], [0.0, 0.0, -0.5], [0.0, 0.5, 0.0]],
        };
        let mut lighting =
            Lighting { lights: vec![POINT; 2], world_from_object: vec![Some(placement), None] };
        let mut surface = Surface {
            object: 0,
            primitive: 0,
            position: [-0.5, 0.0, 0.0],
            normal: [0.0, 0.0, -1.0],
            albedo: [1.0, 0.5, 0.0],
            direct: [0.0; 3],
            lit: 0b10,
        };
        // The origin of the world, facing up: I/r² = 1/4 from the second light, the first is in shadow.
        let quarter = 0.25 * std::f32::consts::FRAC_1_PI;
        assert_eq!(lighting.direct(&surface), Some([quarter, 0.5 * quarter, 0.0]));
        surface.normal = [0.0, 0.0, 1.0];
        assert_eq!(lighting.direct(&surface), Some([0.0; 3]), "faces away");
        surface.object = 1;
        assert_eq!(lighting.direct(&surface), None, "deforms");
        lighting.world_from_object.clear();
        assert_eq!(lighting.direct(&surface), None, "is gone");
    }
}
