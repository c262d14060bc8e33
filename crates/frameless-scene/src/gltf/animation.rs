//! Keyframe animation. The file's animations run together; what two of them drive, the first does.

use std::collections::HashSet;

use glam::{Quat, Vec3};

use crate::{Animation, Channel, Interpolation, Target, Values};

use super::document::Document;
use super::error::Fault;
use super::json::Json;
use super::node::{Hierarchy, unit};

/// All motion of the scene's nodes.
pub(super) fn load_animation(
    document: &mut Document<'_>,
    hierarchy: &Hierarchy,
) -> Result<Animation, Fault> {
    let mut animation = Animation::default();
    let mut driven = HashSet::new();
    for json in document.root.list("animations")? {
        let samplers = load_samplers(&json, document)?;
        for channel in json.required("channels")?.elements()? {
            let owner = json.called("animation");
            let sampler = channel.required("sampler")?;
            let keys = &samplers[sampler.index(samplers.len(), "samplers")?];
            let Some(target) = parse_target(&channel, &owner, document, hierarchy)? else {
                continue;
            };
            if !driven.insert(target) {
                let what = "what an earlier animation moves already was left out";
                document.warnings.about(what, owner);
                continue;
            }
            animation.channels.extend(keys.channel(&sampler, target, &owner, document)?);
        }
    }
    let last_keys = animation.channels.iter().filter_map(|channel| channel.times.last());
    animation.duration_secs = last_keys.fold(0.0, |longest, &secs| longest.max(f64::from(secs)));
    Ok(animation)
}

/// When, and the accessor that says what.
struct Keys {
    times: Vec<f32>,
    /// Index into the accessors; checked against the target when there is one.
    output: usize,
    interpolation: Interpolation,
}

fn load_samplers(animation: &Json<'_>, document: &mut Document<'_>) -> Result<Vec<Keys>, Fault> {
    let samplers = animation.required("samplers")?.elements()?;
    samplers.iter().map(|json| load_keys(json, document)).collect()
}

fn load_keys(json: &Json<'_>, document: &mut Document<'_>) -> Result<Keys, Fault> {
    let interpolation = match json.field("interpolation")? {
        None => Interpolation::Linear,
        Some(name) => match name.text()? {
            "LINEAR" => Interpolation::Linear,
            "STEP" => Interpolation::Step,
            "CUBICSPLINE" => Interpolation::CubicSpline,
            _ => return Err(name.fault("LINEAR, STEP or CUBICSPLINE")),
        },
    };
    let accessors = &document.accessors;
    let input = json.required("input")?.index(accessors.len(), "accessors")?;
    let output = json.required("output")?.index(accessors.len(), "accessors")?;
    document.budget.add_keyframes(json.pointer(), accessors[input].count)?;
    let times = accessors[input].numbers::<1>(&mut document.budget)?;
    Ok(Keys { times: times.into_iter().flatten().collect(), output, interpolation })
}

/// What a channel moves; `None` if that is not in the scene, or nothing that can be moved.
fn parse_target(
    channel: &Json<'_>,
    owner: &str,
    document: &mut Document<'_>,
    hierarchy: &Hierarchy,
) -> Result<Option<Target>, Fault> {
    let target = channel.required("target")?;
    let path = target.required("path")?;
    let node = match target.field("node")? {
        Some(node) => hierarchy.index_of[node.index(hierarchy.index_of.len(), "nodes")?],
        None => None,
    };
    let make_target: fn(u32) -> Target = match path.text()? {
        "translation" => Target::Translation,
        "rotation" => Target::Rotation,
        "scale" => Target::Scale,
        "weights" => {
            document.warnings.about("morph weights are not animated", owner);
            return Ok(None);
        }
        "pointer" => {
            document.warnings.about("animated pointers are left out", owner);
            return Ok(None);
        }
        _ => return Err(path.fault("translation, rotation, scale or weights")),
    };
    Ok(node.map(make_target))
}

impl Keys {
    /// The channel without keys that are infinite, NaN, before time 0 or not after the one before; `None` if none is left.
    fn channel(
        &self,
        sampler: &Json<'_>,
        target: Target,
        owner: &str,
        document: &mut Document<'_>,
    ) -> Result<Option<Channel>, Fault> {
        let per_key = if self.interpolation == Interpolation::CubicSpline { 3 } else { 1 };
        let output = &document.accessors[self.output];
        let wanted = self.times.len().checked_mul(per_key);
        if wanted != Some(output.count) {
            let wanted = format!("{per_key} values for each of {} keys", self.times.len());
            return Err(Fault::at(sampler.pointer(), wanted, output.count));
        }
        let (kept, times, values) = match target {
            Target::Rotation(_) => {
                let mut values = output.numbers::<4>(&mut document.budget)?;
                let usable = |key: &mut [[f32; 4]]| normalize_key(key) && is_finite(key);
                let (kept, times) = self.keep(&mut values, per_key, usable);
                (kept, times, Values::Quat(values.into_iter().map(Quat::from_array).collect()))
            }
            _ => {
                let mut values = output.numbers::<3>(&mut document.budget)?;
                let (kept, times) = self.keep(&mut values, per_key, |key| is_finite(key));
                (kept, times, Values::Vec3(values.into_iter().map(Vec3::from_array).collect()))
            }
        };
        if kept < self.times.len() {
            document.warnings.about("keys without a usable time or value were left out", owner);
        }
        let interpolation = self.interpolation;
        Ok((kept > 0).then_some(Channel { target, times, values, interpolation }))
    }

    /// Drops unusable keys from `values`; returns how many are left, and their times.
    fn keep<const N: usize>(
        &self,
        values: &mut Vec<[f32; N]>,
        per_key: usize,
        usable: impl Fn(&mut [[f32; N]]) -> bool,
    ) -> (usize, Vec<f32>) {
        let mut times: Vec<f32> = Vec::with_capacity(self.times.len());
        for (key, &time) in self.times.iter().enumerate() {
            let after_last = times.last().is_none_or(|&last| time > last);
            let range = per_key * key..per_key * (key + 1);
            if time.is_finite() && time >= 0.0 && after_last && usable(&mut values[range.clone()]) {
                values.copy_within(range, per_key * times.len());
                times.push(time);
            }
        }
        values.truncate(per_key * times.len());
        (times.len(), times)
    }
}

fn is_finite<const N: usize>(key: &[[f32; N]]) -> bool {
    key.iter().flatten().all(|x| x.is_finite())
}

/// Brings a key's rotation to length one; its tangents, if it has any, stand before and after it and have no length to keep.
/// False if it has no direction.
fn normalize_key(key: &mut [[f32; 4]]) -> bool {
    let middle = &mut key[key.len() / 2];
    let Some(rotation) = unit(Quat::from_array(*middle)) else { return false };
    *middle = rotation.to_array();
    true
}
