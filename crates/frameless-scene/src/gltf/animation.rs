//! Keyframe animation: of the file's animations those that are wanted, together.

use std::collections::{HashMap, HashSet};
use std::ops::Range;
use std::rc::Rc;

use glam::{Quat, Vec3};

use crate::{Animation, Channel, Contents, Interpolation, Target, Values};

use super::choice::AnimationChoice;
use super::document::Document;
use super::error::Fault;
use super::instances::WeightsOfNode;
use super::json::Json;
use super::node::{Hierarchy, unit};

/// Per node of the scene that moves: the number of the file's animation that moves it first.
pub(super) type Movers = HashMap<u32, usize>;

/// All motion of the scene's nodes, and by what; says in `contents` which animations that is.
pub(super) fn load_animation(
    document: &mut Document<'_>,
    nodes: &Nodes<'_>,
    choice: &AnimationChoice,
    contents: &mut Contents,
) -> Result<(Animation, Movers), Fault> {
    let list = document.root.list("animations")?;
    let mut parsed = Vec::new();
    for json in &list {
        parsed.push(parse_animation(json, document, nodes)?);
    }
    contents.played = played(&list, &parsed, choice, document)?;
    let (mut animation, mut movers) = (Animation::default(), Movers::new());
    let mut driven = HashSet::new();
    for &number in &contents.played {
        let owner = list[number].called("animation");
        for Move { keys, sampler, what } in &parsed[number] {
            if !driven.insert(what.clone()) {
                let what = "what an earlier animation moves already was left out";
                document.warnings.about(what, &owner);
                continue;
            }
            keys.add_channels(sampler, what, &owner, document, &mut animation.channels)?;
            if let What::Node(
                Target::Translation(node) | Target::Rotation(node) | Target::Scale(node),
            ) = what
            {
                movers.entry(*node).or_insert(number);
            }
        }
    }
    let last_keys = animation.channels.iter().filter_map(|channel| channel.times.last());
    animation.duration_secs = last_keys.fold(0.0, |longest, &secs| longest.max(f64::from(secs)));
    Ok((animation, movers))
}

/// The nodes that may be moved.
pub(super) struct Nodes<'a> {
    pub(super) hierarchy: &'a Hierarchy,
    pub(super) weights_of: &'a WeightsOfNode,
}

/// Indices of the animations that are played.
fn played(
    list: &[Json<'_>],
    parsed: &[Vec<Move<'_>>],
    choice: &AnimationChoice,
    document: &mut Document<'_>,
) -> Result<Vec<usize>, Fault> {
    Ok(match choice {
        AnimationChoice::None => Vec::new(),
        AnimationChoice::One(pick) => vec![pick.find(list, "animations", "animation")?],
        AnimationChoice::Fitting if compete(parsed) => {
            let first = list[0].called("animation");
            let count = list.len();
            document
                .warnings
                .add(format!("{count} animations move the same things: only {first} is played"));
            vec![0]
        }
        AnimationChoice::Fitting | AnimationChoice::All => (0..list.len()).collect(),
    })
}

/// Whether two animations move the same thing.
fn compete(parsed: &[Vec<Move<'_>>]) -> bool {
    let mut owner = HashMap::new();
    let all = parsed.iter().enumerate().flat_map(|(i, moves)| moves.iter().map(move |m| (i, m)));
    all.into_iter().any(|(index, one)| *owner.entry(&one.what).or_insert(index) != index)
}

/// A channel of the file, of something in the scene.
struct Move<'a> {
    keys: Rc<Keys>,
    sampler: Json<'a>,
    what: What,
}

/// What a channel of the file moves.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
enum What {
    /// One property of one node.
    Node(Target),
    /// All weights of one node's mesh.
    Weights(Range<u32>),
}

fn parse_animation<'a>(
    json: &Json<'a>,
    document: &mut Document<'_>,
    nodes: &Nodes<'_>,
) -> Result<Vec<Move<'a>>, Fault> {
    let samplers = load_samplers(json, document)?;
    let owner = json.called("animation");
    let mut moves = Vec::new();
    for channel in json.required("channels")?.elements()? {
        let sampler = channel.required("sampler")?;
        let keys = samplers[sampler.index(samplers.len(), "samplers")?].clone();
        if let Some(what) = parse_target(&channel, &owner, document, nodes)? {
            keys.check_count(&sampler, &what, document)?;
            moves.push(Move { keys, sampler, what });
        }
    }
    Ok(moves)
}

/// When, and the accessor that says what.
struct Keys {
    times: Vec<f32>,
    /// Index into the accessors; checked against the target when there is one.
    output: usize,
    interpolation: Interpolation,
}

fn load_samplers(
    animation: &Json<'_>,
    document: &mut Document<'_>,
) -> Result<Vec<Rc<Keys>>, Fault> {
    let samplers = animation.required("samplers")?.elements()?;
    samplers.iter().map(|json| load_keys(json, document).map(Rc::new)).collect()
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
    let input_json = json.required("input")?;
    let input = input_json.index(accessors.len(), "accessors")?;
    accessors[input].check_kind(&["SCALAR"], &input_json)?;
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
    nodes: &Nodes<'_>,
) -> Result<Option<What>, Fault> {
    let target = channel.required("target")?;
    let path = target.required("path")?;
    let index_of = &nodes.hierarchy.index_of;
    let file_node = match target.field("node")? {
        Some(node) => Some(node.index(index_of.len(), "nodes")?),
        None => None,
    };
    let node = file_node.and_then(|node| index_of[node]);
    let make_target: fn(u32) -> Target = match path.text()? {
        "translation" => Target::Translation,
        "rotation" => Target::Rotation,
        "scale" => Target::Scale,
        "weights" => {
            let weights = file_node.and_then(|node| nodes.weights_of[node].clone());
            if node.is_some() && weights.is_none() {
                document.warnings.about("weights without morph targets are not animated", owner);
            }
            return Ok(weights.map(What::Weights));
        }
        "pointer" => {
            document.warnings.about("animated pointers are left out", owner);
            return Ok(None);
        }
        _ => return Err(path.fault("translation, rotation, scale or weights")),
    };
    Ok(node.map(|node| What::Node(make_target(node))))
}

impl Keys {
    /// Numbers per key: in-tangent, value, out-tangent or only that.
    fn per_key(&self) -> usize {
        if self.interpolation == Interpolation::CubicSpline { 3 } else { 1 }
    }

    fn check_count(
        &self,
        sampler: &Json<'_>,
        what: &What,
        document: &Document<'_>,
    ) -> Result<(), Fault> {
        let per_key = match what {
            What::Node(_) => self.per_key(),
            What::Weights(weights) => self.per_key() * weights.len(),
        };
        let output = &document.accessors[self.output];
        let kind = match what {
            What::Node(Target::Rotation(_)) => "VEC4",
            What::Node(_) => "VEC3",
            What::Weights(_) => "SCALAR",
        };
        output.check_kind(&[kind], sampler)?;
        let came = output.count;
        if self.times.len().checked_mul(per_key) == Some(came) {
            return Ok(());
        }
        let wanted = format!("{per_key} values for each of {} keys", self.times.len());
        Err(Fault::at(sampler.pointer(), wanted, came))
    }

    /// Channels without keys that are infinite, NaN, before time 0 or not after the one before; none if no key is left.
    fn add_channels(
        &self,
        sampler: &Json<'_>,
        what: &What,
        owner: &str,
        document: &mut Document<'_>,
        channels: &mut Vec<Channel>,
    ) -> Result<(), Fault> {
        let Document { accessors, budget, warnings, .. } = document;
        let (output, per_key) = (&accessors[self.output], self.per_key());
        budget.allocate(sampler.pointer(), self.times.len(), size_of::<f32>())?;
        let mut add = |target: Target, kept: usize, times: Vec<f32>, values: Values| {
            if kept < self.times.len() {
                warnings.about("keys without a usable time or value were left out", owner);
            }
            if kept > 0 {
                let interpolation = self.interpolation;
                channels.push(Channel { target, times, values, interpolation });
            }
        };
        match what {
            What::Node(target @ Target::Rotation(_)) => {
                let mut values = output.numbers::<4>(budget)?;
                let usable = |key: &mut [[f32; 4]]| normalize_key(key) && is_finite(key);
                let (kept, times) = self.keep(&mut values, per_key, usable);
                let values = values.into_iter().map(Quat::from_array).collect();
                add(*target, kept, times, Values::Quat(values));
            }
            What::Node(target) => {
                let mut values = output.numbers::<3>(budget)?;
                let (kept, times) = self.keep(&mut values, per_key, |key| is_finite(key));
                let values = values.into_iter().map(Vec3::from_array).collect();
                add(*target, kept, times, Values::Vec3(values));
            }
            What::Weights(weights) => {
                let all = output.numbers::<1>(budget)?;
                // Every weight becomes a channel of its own, with the times of all.
                budget.allocate(sampler.pointer(), all.len(), 2 * size_of::<f32>())?;
                budget.allocate(sampler.pointer(), weights.len(), BYTES_PER_CHANNEL)?;
                for (place, weight) in weights.clone().enumerate() {
                    let mut values: Vec<[f32; 1]> =
                        all.iter().skip(place).step_by(weights.len()).copied().collect();
                    let (kept, times) = self.keep(&mut values, per_key, |key| is_finite(key));
                    let values = values.into_iter().flatten().collect();
                    add(Target::MorphWeight(weight), kept, times, Values::Scalar(values));
                }
            }
        }
        Ok(())
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

/// Itself, and what its two arrays take besides their numbers.
const BYTES_PER_CHANNEL: usize = size_of::<Channel>() + 64;

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
