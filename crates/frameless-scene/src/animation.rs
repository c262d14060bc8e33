//! Keyframes: which property of which node has which value when (glTF 2.0 §3.11, appendix C).

use std::ops::{Add, Mul, Sub};

use glam::{Quat, Vec3};

/// All motion of a scene.
#[derive(Clone, Debug, Default)]
pub struct Animation {
    /// Length in seconds; 0: nothing moves and the channels are ignored.
    pub duration_secs: f64,
    /// What happens after `duration_secs`.
    pub after_end: AfterEnd,
    /// Each property of each node at most once.
    pub channels: Vec<Channel>,
}

/// What happens once an animation's duration has passed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum AfterEnd {
    /// Everything begins again; times before 0 are earlier rounds.
    #[default]
    Repeat,
    /// Everything stays as it is at the end; times before 0 show the beginning.
    Hold,
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
    /// How much of a morph target is added, by index into the scene's morph weights.
    MorphWeight(u32),
}

/// Values at the keys.
#[derive(Clone, Debug)]
pub enum Values {
    /// Translation, scale, light intensity.
    Vec3(Vec<Vec3>),
    /// Rotation; unit length.
    Quat(Vec<Quat>),
    /// Morph weight.
    Scalar(Vec<f32>),
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

impl Animation {
    /// The moment of the animation that is shown at `secs` of scene time, in [0, `duration_secs`].
    ///
    /// Wrapped in double precision, so that a scene that has run for days moves as smoothly as on its
    /// first day; rounded afterwards to the precision of the keys, so that `t = 1.6` has reached the key 1.6.
    pub fn local_secs(&self, secs: f64) -> f32 {
        let local = match self.after_end {
            AfterEnd::Repeat => secs.rem_euclid(self.duration_secs),
            AfterEnd::Hold => secs.clamp(0.0, self.duration_secs),
        };
        local as f32
    }
}

/// A channel's value at one moment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Value {
    /// Translation, scale, light intensity.
    Vec3(Vec3),
    /// Rotation; unit length.
    Quat(Quat),
    /// Morph weight.
    Scalar(f32),
}

impl Channel {
    /// The value at `local_secs`, see [`Animation::local_secs`].
    pub fn value_at(&self, local_secs: f32) -> Value {
        let place = Place::find(&self.times, local_secs);
        match &self.values {
            Values::Vec3(values) => Value::Vec3(self.blend(&place, values)),
            Values::Scalar(values) => Value::Scalar(self.blend(&place, values)),
            Values::Quat(values) => Value::Quat(match self.interpolation {
                Interpolation::Step => values[place.key],
                Interpolation::Linear => place.linear(values, great_arc),
                Interpolation::CubicSpline => {
                    unit_or(place.spline(values), values[3 * place.key + 1])
                }
            }),
        }
    }
}

impl Channel {
    /// Values that add up and need no particular length.
    fn blend<V>(&self, place: &Place, values: &[V]) -> V
    where
        V: Copy + Add<Output = V> + Sub<Output = V> + Mul<f32, Output = V>,
    {
        match self.interpolation {
            Interpolation::Step => values[place.key],
            Interpolation::Linear => place.linear(values, |a, b, u| a + (b - a) * u),
            Interpolation::CubicSpline => place.spline(values),
        }
    }
}

/// A moment between two keys.
struct Place {
    /// The key before (or at) the moment; before the first key: the first.
    key: usize,
    /// Where between `key` and the next key; `None`: hold `key`.
    between: Option<Between>,
}

struct Between {
    /// In [0, 1).
    u: f32,
    /// Seconds from key to key.
    interval: f32,
}

impl Place {
    fn find(times: &[f32], secs: f32) -> Place {
        let after = times.partition_point(|&time| time <= secs);
        if after == 0 || after == times.len() {
            return Place { key: after.saturating_sub(1), between: None };
        }
        let (start, end) = (times[after - 1], times[after]);
        let interval = end - start;
        Place { key: after - 1, between: Some(Between { u: (secs - start) / interval, interval }) }
    }

    fn linear<V: Copy>(&self, values: &[V], mix: impl Fn(V, V, f32) -> V) -> V {
        match self.between {
            None => values[self.key],
            Some(Between { u, .. }) => mix(values[self.key], values[self.key + 1], u),
        }
    }

    /// glTF 2.0, appendix C.5, with t = u and t_d = interval:
    ///
    /// v(u) = (2u³ − 3u² + 1) v₀ + t_d (u³ − 2u² + u) b₀ + (−2u³ + 3u²) v₁ + t_d (u³ − u²) a₁
    ///
    /// where a, v, b are the in-tangent, value and out-tangent of a key. The weights of v₀ and v₁ sum to one,
    /// so we add a multiple of v₁ − v₀ to v₀: what stands still between two keys does so to the last bit.
    fn spline<V>(&self, values: &[V]) -> V
    where
        V: Copy + Add<Output = V> + Sub<Output = V> + Mul<f32, Output = V>,
    {
        let v0 = values[3 * self.key + 1];
        let Some(Between { u, interval }) = self.between else { return v0 };
        let b0 = values[3 * self.key + 2];
        let a1 = values[3 * self.key + 3];
        let v1 = values[3 * self.key + 4];
        let (u2, u3) = (u * u, u * u * u);
        let tangents = b0 * (u3 - 2.0 * u2 + u) + a1 * (u3 - u2);
        v0 + (v1 - v0) * (3.0 * u2 - 2.0 * u3) + tangents * interval
    }
}

/// The shorter great arc from `a` to `b` at constant speed. Two equal rotations give exactly that rotation.
fn great_arc(a: Quat, b: Quat, u: f32) -> Quat {
    if a == b { a } else { a.slerp(b, u) }
}

/// `q` at unit length; `fallback` where a spline passes so near to zero that it names no rotation.
fn unit_or(q: Quat, fallback: Quat) -> Quat {
    let length = q.length();
    if length > 1e-6 { q * length.recip() } else { fallback }
}
