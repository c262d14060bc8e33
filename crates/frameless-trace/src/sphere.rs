//! The unit sphere around the origin, analytically.

use glam::Vec3A;

use crate::ray::Ray;

/// The first t in (0, t_max] at which the ray is on the sphere, from outside or inside.
///
/// With f = o, a = d·d, b' = −f·d, c = f·f − 1: Δ = 1 − |f + (b'/a)·d|², q = b' + sign(b')·√(a·Δ), and the roots are c/q and
/// q/a. Neither subtracts nearly equal numbers, even where the sphere is small and far away (Haines, Günther &
/// Akenine-Möller 2019, "Precision Improvements for Ray/Sphere Intersection", Ray Tracing Gems, ch. 7).
#[inline(always)]
pub(crate) fn intersect(ray: &Ray, t_max: f32) -> Option<f32> {
    let (f, d) = (ray.origin, ray.direction);
    let a = d.dot(d);
    let b = -f.dot(d);
    let nearest_to_centre = f + (b / a) * d;
    let delta = 1.0 - nearest_to_centre.dot(nearest_to_centre);
    // NaN comes from directions too short to square.
    if delta.is_nan() || delta < 0.0 {
        return None;
    }
    let c = f.dot(f) - 1.0;
    let q = b + (a * delta).sqrt().copysign(b);
    let (t0, t1) = (c / q, q / a);
    let (near, far) = if t0 < t1 { (t0, t1) } else { (t1, t0) };
    if near > 0.0 {
        (near <= t_max).then_some(near)
    } else {
        (far > 0.0 && far <= t_max).then_some(far)
    }
}

/// Texture coordinates of a point on the sphere, see [`frameless_scene::Geometry::Sphere`].
pub(crate) fn texture_coordinates(p: Vec3A) -> [f32; 2] {
    use std::f32::consts::{PI, TAU};
    let u = p.z.atan2(p.x) / TAU;
    [if u < 0.0 { u + 1.0 } else { u }, p.y.clamp(-1.0, 1.0).acos() / PI]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ray(origin: [f32; 3], direction: [f32; 3]) -> Ray {
        Ray { origin: origin.into(), direction: direction.into() }
    }

    #[test]
    fn hits_where_algebra_says() {
        assert_eq!(intersect(&ray([0.0, 0.0, 3.0], [0.0, 0.0, -1.0]), 9.0), Some(2.0));
        assert_eq!(
            intersect(&ray([0.0, 0.0, 3.0], [0.0, 0.0, -2.0]), 9.0),
            Some(1.0),
            "t in directions"
        );
        assert_eq!(intersect(&ray([0.0, 0.0, 3.0], [0.0, 0.0, 1.0]), 9.0), None, "behind");
        assert_eq!(
            intersect(&ray([0.0, 0.0, 3.0], [0.0, 0.0, -1.0]), 2.0),
            Some(2.0),
            "t_max is included"
        );
        assert_eq!(intersect(&ray([0.0; 3], [0.0, 1.0, 0.0]), 9.0), Some(1.0), "from inside");
        assert_eq!(intersect(&ray([0.0, 0.0, 3.0], [0.0, 0.0, -1.0]), 1.999), None, "too far");
        assert_eq!(intersect(&ray([0.0, 1.5, 3.0], [0.0, 0.0, -1.0]), 9.0), None, "beside");
        assert_eq!(intersect(&ray([0.0; 3], [0.0; 3]), 9.0), None, "no direction");
        // 0.6² + 0.8² = 1: beside the centre the surface is at z = ±0.8.
        let beside = intersect(&ray([0.0, 0.6, 3.0], [0.0, 0.0, -1.0]), 9.0).unwrap();
        assert!((beside - 2.2).abs() < 1e-6, "{beside}");
        let inside = intersect(&ray([0.0, 0.6, 0.0], [0.0, 0.0, 1.0]), 9.0).unwrap();
        assert!((inside - 0.8).abs() < 1e-6, "{inside}");
        let slanted = intersect(&ray([2.0, 2.0, 0.5], [-1.0, -1.0, 0.0]), 9.0).unwrap();
        assert!((slanted - (2.0 - 0.375f32.sqrt())).abs() < 1e-6, "{slanted}");
    }

    #[test]
    fn precise_from_far_away() {
        // The textbook's b² − 4ac loses everything here: 1e10 ± 1 in single precision.
        let t = intersect(&ray([0.0, 0.5, 1e5], [0.0, 0.0, -1.0]), f32::MAX).unwrap();
        let exact = 1e5 - 0.75f64.sqrt();
        assert!((f64::from(t) - exact).abs() < 0.01, "{t} is not {exact}");
    }

    #[test]
    fn texture_coordinates_follow_the_contract() {
        assert_eq!(texture_coordinates(Vec3A::X), [0.0, 0.5]);
        assert_eq!(texture_coordinates(Vec3A::Z), [0.25, 0.5]);
        assert_eq!(texture_coordinates(-Vec3A::Z), [0.75, 0.5]);
        assert_eq!(texture_coordinates(Vec3A::Y)[1], 0.0);
        assert_eq!(texture_coordinates(-Vec3A::Y)[1], 1.0);
    }
}
