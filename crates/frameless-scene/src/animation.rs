//! Keyframes: which property of which node has which value when (glTF 2.0 §3.11, appendix C).

use glam::{Quat, Vec3};

/// All motion of a scene.
#[derive(Clone, Debug, Default)]
pub struct Animation {
    /// Time after which everything begins again, in seconds; 0: nothing moves.
    pub duration_secs: f64,
    /// Each property of each node at most once.
    pub channels: Vec<Channel>,
}

/// How one property of one target changes.
#[derive(Clone, Debug)]
pub struct Channel {
    /// What is driven.
    pub target: Target,
    /// Key times in seconds: finite, at least 0, strictly increasing, at least one.
    pub times: Vec<f32>,
    /// One value per key (step, linear) or three (cubic spline: in-tangent, value, out-tangent).
    pub values: Values,
    /// Between keys; before the first and after the last key the value is held.
    pub interpolation: Interpolation,
}

/// What a channel drives.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Target {
    /// A node's translation, by index.
    Translation(u32),
    /// A node's rotation, by index.
    Rotation(u32),
    /// A node's scale, by index.
    Scale(u32),
    /// A light's intensity, by index into the scene's lights.
    LightIntensity(u32),
}

/// Values at the keys.
#[derive(Clone, Debug)]
pub enum Values {
    /// Translation, scale, light intensity.
    Vec3(Vec<Vec3>),
    /// Rotation; unit length.
    Quat(Vec<Quat>),
}

/// How values between keys come about.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Interpolation {
    /// The earlier key's value.
    Step,
    /// Straight line; for rotations the shorter great arc.
    #[default]
    Linear,
    /// Cubic Hermite spline.
    CubicSpline,
}
