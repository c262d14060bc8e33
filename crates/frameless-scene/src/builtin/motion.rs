//! Motion as keyframes: exact where it is linear, a cubic spline through the true positions and velocities
//! elsewhere.
//!
//! A cubic Hermite spline with keys h apart is off by at most h⁴/384 · max |f⁗|: for a circle of
//! radius r and n keys per turn r (2π/n)⁴/384, which at n = 32 is 4·10⁻⁶ r.

use std::f64::consts::TAU;

use glam::{DVec3, Quat, Vec3};

use crate::{Channel, Interpolation, Target, Values};

/// Through how much a linear rotation turns from key to key: well below the 180° at which the shorter arc
/// would be the wrong one.
const MAX_STEP_RAD: f64 = TAU / 6.0;

/// A translation along `path`: seconds ↦ (position in metres, velocity in m/s), over `duration_secs`.
pub(super) fn along(
    node: u32,
    duration_secs: f64,
    keys: u32,
    path: impl Fn(f64) -> (DVec3, DVec3),
) -> Channel {
    let (mut times, mut values) = (Vec::new(), Vec::new());
    for secs in key_times(duration_secs, keys) {
        let (position, velocity) = path(secs);
        times.push(secs as f32);
        values.extend([velocity, position, velocity].map(|v| v.as_vec3()));
    }
    let interpolation = Interpolation::CubicSpline;
    Channel {
        target: Target::Translation(node),
        times,
        values: Values::Vec3(values),
        interpolation,
    }
}

/// A rotation around y by `yaw`: seconds ↦ (angle θ in radians, θ′ in rad/s), over `duration_secs`.
///
/// q = (0, sin θ/2, 0, cos θ/2), q′ = θ′/2 · (0, cos θ/2, 0, −sin θ/2)
pub(super) fn yaw(
    node: u32,
    duration_secs: f64,
    keys: u32,
    yaw: impl Fn(f64) -> (f64, f64),
) -> Channel {
    let (mut times, mut values) = (Vec::new(), Vec::new());
    for secs in key_times(duration_secs, keys) {
        let (angle, speed) = yaw(secs);
        let (sin, cos) = (0.5 * angle).sin_cos();
        let around_y = |y: f64, w: f64| Quat::from_xyzw(0.0, y as f32, 0.0, w as f32);
        let tangent = around_y(0.5 * speed * cos, -0.5 * speed * sin);
        times.push(secs as f32);
        values.extend([tangent, around_y(sin, cos), tangent]);
    }
    let interpolation = Interpolation::CubicSpline;
    Channel { target: Target::Rotation(node), times, values: Values::Quat(values), interpolation }
}

/// `turns` whole turns around `axis` (unit length) at constant speed within `duration_secs`.
pub(super) fn spin(node: u32, duration_secs: f64, axis: Vec3, turns: i32) -> Channel {
    let keys = (f64::from(turns.unsigned_abs()) * TAU / MAX_STEP_RAD).ceil() as u32;
    let (mut times, mut values) = (Vec::new(), Vec::new());
    for secs in key_times(duration_secs, keys) {
        let angle = f64::from(turns) * TAU * (secs / duration_secs);
        times.push(secs as f32);
        values.push(Quat::from_axis_angle(axis, angle as f32));
    }
    let interpolation = Interpolation::Linear;
    Channel { target: Target::Rotation(node), times, values: Values::Quat(values), interpolation }
}

/// A sphere that rolls along x without slipping.
pub(super) struct Rolling {
    pub(super) node: u32,
    pub(super) radius: f32,
    /// The centre at x = 0.
    pub(super) centre: Vec3,
    /// Orientation at x = 0.
    pub(super) tilt: Quat,
}

impl Rolling {
    /// Translation and rotation through `stops` (seconds, x in metres), at constant speed in between.
    ///
    /// A sphere of radius r that moved by x has turned by −x/r around z.
    pub(super) fn through(&self, stops: &[(f64, f64)]) -> [Channel; 2] {
        let radius = f64::from(self.radius);
        let at = |x: f64| self.centre + Vec3::X * x as f32;
        let turned = |x: f64| Quat::from_rotation_z((-x / radius) as f32) * self.tilt;
        let (mut times, mut rotations) = (Vec::new(), Vec::new());
        for pair in stops.windows(2) {
            let ((start, from), (end, to)) = (pair[0], pair[1]);
            let steps = (((to - from) / radius).abs() / MAX_STEP_RAD).ceil().max(1.0);
            for step in 0..steps as u32 {
                let u = f64::from(step) / steps;
                times.push((start + (end - start) * u) as f32);
                rotations.push(turned(from + (to - from) * u));
            }
        }
        if let Some(&(end, x)) = stops.last() {
            times.push(end as f32);
            rotations.push(turned(x));
        }
        let translation = Channel {
            target: Target::Translation(self.node),
            times: stops.iter().map(|stop| stop.0 as f32).collect(),
            values: Values::Vec3(stops.iter().map(|stop| at(stop.1)).collect()),
            interpolation: Interpolation::Linear,
        };
        let rotation = Channel {
            target: Target::Rotation(self.node),
            times,
            values: Values::Quat(rotations),
            interpolation: Interpolation::Linear,
        };
        [translation, rotation]
    }
}

/// Constant between the keys: (seconds, value).
pub(super) fn jumps<const N: usize>(target: Target, keys: [(f32, Vec3); N]) -> Channel {
    Channel {
        target,
        times: keys.iter().map(|key| key.0).collect(),
        values: Values::Vec3(keys.iter().map(|key| key.1).collect()),
        interpolation: Interpolation::Step,
    }
}

/// `keys` equal intervals of [0, duration]: one more time than intervals, the last exactly `duration_secs`.
fn key_times(duration_secs: f64, keys: u32) -> impl Iterator<Item = f64> {
    (0..=keys).map(move |key| duration_secs * (f64::from(key) / f64::from(keys)))
}
