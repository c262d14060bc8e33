//! What exists at one moment.

use glam::{Affine3A, Vec3};

use crate::{Scene, Target, Transform, Value};

/// A scene at one moment: where every node is and how bright every light. Made by [`Scene::state_at`].
#[derive(Clone, Debug, Default)]
pub struct State {
    /// The moment, in seconds of scene time.
    pub secs: f64,
    /// Parent from node, per node.
    pub parent_from_node: Vec<Transform>,
    /// World from node, per node.
    pub world_from_node: Vec<Affine3A>,
    /// Linear RGB, per light; see [`crate::Light::intensity`].
    pub light_intensity: Vec<Vec3>,
    /// How much of each morph target is added; see [`crate::Scene::morph_weights`].
    pub morph_weights: Vec<f32>,
}

impl Scene {
    /// The scene at `secs` (any finite number; animations repeat after their duration).
    pub fn state_at(&self, secs: f64) -> State {
        let mut state = State::default();
        self.update_state(secs, &mut state);
        state
    }

    /// Bring `state` to the scene at `secs`, reusing its memory: no allocation once it has held this scene.
    pub fn update_state(&self, secs: f64, state: &mut State) {
        state.secs = secs;
        state.parent_from_node.clear();
        state.parent_from_node.extend(self.nodes.iter().map(|node| node.rest));
        state.light_intensity.clear();
        state.light_intensity.extend(self.lights.iter().map(|light| light.intensity));
        state.morph_weights.clone_from(&self.morph_weights);
        self.apply_animation(secs, state);
        self.compose_world(state);
    }

    /// Per node: whether the animation moves it or what it hangs on.
    pub fn moving_nodes(&self) -> Vec<bool> {
        let mut moves = vec![false; self.nodes.len()];
        for channel in &self.animation.channels {
            match channel.target {
                Target::Translation(node) | Target::Rotation(node) | Target::Scale(node) => {
                    moves[node as usize] = true;
                }
                Target::LightIntensity(_) | Target::MorphWeight(_) => {}
            }
        }
        for (index, node) in self.nodes.iter().enumerate() {
            moves[index] |= node.parent.is_some_and(|parent| moves[parent as usize]);
        }
        moves
    }

    fn apply_animation(&self, secs: f64, state: &mut State) {
        if self.animation.duration_secs <= 0.0 {
            return;
        }
        let local_secs = self.animation.local_secs(secs);
        let nodes = &mut state.parent_from_node;
        for channel in &self.animation.channels {
            match (channel.target, channel.value_at(local_secs)) {
                (Target::Translation(i), Value::Vec3(v)) => nodes[i as usize].translation = v,
                (Target::Rotation(i), Value::Quat(q)) => nodes[i as usize].rotation = q,
                (Target::Scale(i), Value::Vec3(v)) => nodes[i as usize].scale = v,
                (Target::LightIntensity(i), Value::Vec3(v)) => {
                    state.light_intensity[i as usize] = v;
                }
                (Target::MorphWeight(i), Value::Scalar(w)) => state.morph_weights[i as usize] = w,
                (target, value) => unreachable!("{target:?} cannot be {value:?}: see Scene::check"),
            }
        }
    }

    /// Bring [`State::world_from_node`] up to date with [`State::parent_from_node`], for whoever moves something that the scene's
    /// own animation does not. One pass: parents come before their children.
    pub fn compose_world(&self, state: &mut State) {
        state.world_from_node.clear();
        for (node, transform) in self.nodes.iter().zip(&state.parent_from_node) {
            let parent_from_node = transform.affine();
            let world_from_node = match node.parent {
                Some(parent) => state.world_from_node[parent as usize] * parent_from_node,
                None => parent_from_node,
            };
            state.world_from_node.push(world_from_node);
        }
    }
}
