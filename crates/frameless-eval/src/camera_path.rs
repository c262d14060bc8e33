//! Cameras that an experiment moves.

use frameless_scene::{Projection, View, look_at};
use glam::{Affine3A, Vec3};
use serde::Deserialize;

/// Where the camera is at every time.
#[derive(Clone, Debug, PartialEq)]
pub struct CameraPath {
    /// Angle between the top and the bottom of the picture, in radians.
    yfov_rad: f32,
    motion: Motion,
}

#[derive(Clone, Debug, PartialEq)]
enum Motion {
    Orbit(Orbit),
    Keys(Vec<Key>),
}

/// `camera = { orbit = { … } }` or `camera = { keyframes = [ … ] }` in an experiment file.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct CameraSpec {
    orbit: Option<Orbit>,
    #[serde(default)]
    keyframes: Vec<Key>,
    #[serde(default = "default_yfov_degrees")]
    yfov_degrees: f32,
}

fn default_yfov_degrees() -> f32 {
    50.0
}

/// Around a point at constant height and distance.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq)]
#[serde(deny_unknown_fields)]
struct Orbit {
    /// Metres; what the camera looks at.
    target: [f32; 3],
    /// Metres, horizontally.
    radius: f32,
    /// Metres above the target.
    #[serde(default)]
    height: f32,
    /// 0: the camera stands on the +z side; 90: on the +x side.
    #[serde(default)]
    start_degrees: f32,
    degrees_per_sec: f32,
}

/// Between keys position and target follow straight lines, smoothly accelerated if `ease` is set on the
/// earlier key.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq)]
#[serde(deny_unknown_fields)]
struct Key {
    /// Seconds.
    time: f64,
    /// Metres.
    eye: [f32; 3],
    /// Metres.
    target: [f32; 3],
    #[serde(default)]
    ease: bool,
}

impl CameraSpec {
    /// The path, or what is wrong with the description.
    pub(crate) fn check(self) -> Result<CameraPath, String> {
        if !(self.yfov_degrees > 0.0 && self.yfov_degrees < 180.0) {
            return Err(format!(
                "yfov_degrees must be between 0 and 180, got {}",
                self.yfov_degrees
            ));
        }
        let motion = match (self.orbit, self.keyframes) {
            (Some(orbit), keys) if keys.is_empty() => Motion::Orbit(checked_orbit(orbit)?),
            (None, keys) if !keys.is_empty() => Motion::Keys(checked_keys(keys)?),
            _ => return Err("a camera needs either orbit or keyframes".into()),
        };
        Ok(CameraPath { yfov_rad: self.yfov_degrees.to_radians(), motion })
    }
}

fn checked_orbit(orbit: Orbit) -> Result<Orbit, String> {
    let numbers = [orbit.radius, orbit.height, orbit.start_degrees, orbit.degrees_per_sec];
    if !numbers.iter().chain(&orbit.target).all(|n| n.is_finite()) || orbit.radius <= 0.0 {
        return Err("an orbit needs finite numbers and a positive radius".into());
    }
    Ok(orbit)
}

fn checked_keys(keys: Vec<Key>) -> Result<Vec<Key>, String> {
    if let Some(pair) = keys.windows(2).find(|pair| pair[1].time <= pair[0].time) {
        return Err(format!(
            "keyframe times must increase, got {} after {}",
            pair[1].time, pair[0].time
        ));
    }
    for key in &keys {
        let finite = key.eye.iter().chain(&key.target).all(|n| n.is_finite());
        if !finite || !key.time.is_finite() || key.eye == key.target {
            return Err(format!(
                "the keyframe at {} s needs finite numbers and a target away from the eye",
                key.time
            ));
        }
    }
    Ok(keys)
}

impl CameraPath {
    /// The view at `secs`; before the first and after the last keyframe the camera stands still.
    pub fn view(&self, secs: f64) -> View {
        let world_from_camera = match &self.motion {
            Motion::Orbit(orbit) => orbit.at(secs),
            Motion::Keys(keys) => keys_at(keys, secs),
        };
        View { world_from_camera, projection: Projection::Perspective { yfov_rad: self.yfov_rad } }
    }
}

impl Orbit {
    fn at(&self, secs: f64) -> Affine3A {
        let degrees = f64::from(self.start_degrees) + f64::from(self.degrees_per_sec) * secs;
        let (sin, cos) = degrees.rem_euclid(360.0).to_radians().sin_cos();
        let target = Vec3::from(self.target);
        let offset = Vec3::new(self.radius * sin as f32, self.height, self.radius * cos as f32);
        look_at(target + offset, target, Vec3::Y)
    }
}

fn keys_at(keys: &[Key], secs: f64) -> Affine3A {
    let after = keys.partition_point(|key| key.time <= secs);
    let (a, b) = (&keys[after.saturating_sub(1)], &keys[after.min(keys.len() - 1)]);
    let u =
        if b.time > a.time { ((secs - a.time) / (b.time - a.time)).clamp(0.0, 1.0) } else { 0.0 };
    let u = if a.ease { u * u * (3.0 - 2.0 * u) } else { u } as f32;
    let mix = |a: [f32; 3], b: [f32; 3]| Vec3::from(a).lerp(Vec3::from(b), u);
    look_at(mix(a.eye, b.eye), mix(a.target, b.target), Vec3::Y)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Result<CameraPath, String> {
        toml::from_str::<CameraSpec>(text).map_err(|e| e.to_string())?.check()
    }

    #[test]
    fn an_orbit_goes_round() {
        let path =
            parse("orbit = { target = [1, 2, 3], radius = 5, height = 1, degrees_per_sec = 90 }")
                .expect("valid");
        let eye = |secs| path.view(secs).world_from_camera.translation;
        assert!((eye(0.0) - glam::Vec3A::new(1.0, 3.0, 8.0)).length() < 1e-5);
        assert!((eye(1.0) - glam::Vec3A::new(6.0, 3.0, 3.0)).length() < 1e-5);
        assert!((eye(4.0) - eye(0.0)).length() < 1e-5);
    }

    #[test]
    fn keyframes_are_met_and_held() {
        let path = parse(
            "keyframes = [{ time = 1, eye = [0, 0, 4], target = [0, 0, 0] },
                          { time = 3, eye = [4, 0, 4], target = [4, 0, 0] }]",
        )
        .expect("valid");
        let eye = |secs| path.view(secs).world_from_camera.translation.x;
        assert_eq!([eye(0.0), eye(1.0), eye(2.0), eye(3.0), eye(9.0)], [0.0, 0.0, 2.0, 4.0, 4.0]);
    }

    #[test]
    fn nonsense_is_refused() {
        for (text, part) in [
            ("yfov_degrees = 50", "either orbit or keyframes"),
            ("orbit = { target = [0, 0, 0], radius = 0, degrees_per_sec = 1 }", "positive radius"),
            ("orbit = { target = [0, 0, 0], radius = 1, degrees_per_sec = 1, speed = 3 }", "speed"),
            (
                "yfov_degrees = 180\nkeyframes = [{ time = 0, eye = [0, 0, 1], target = [0, 0, 0] }]",
                "yfov",
            ),
            (
                "keyframes = [{ time = 0, eye = [0, 0, 0], target = [0, 0, 0] }]",
                "away from the eye",
            ),
        ] {
            let message = parse(text).expect_err(text);
            assert!(message.contains(part), "{text}: {message}");
        }
    }
}
