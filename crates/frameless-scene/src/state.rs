//! What exists at one moment.

use glam::{Affine3A, Vec3};

use crate::{Projection, Scene};

/// A scene at one moment: where every node is and how bright every light. Made by [`Scene::state_at`].
#[derive(Clone, Debug, Default)]
pub struct State {
    /// The moment, in seconds of scene time.
    pub secs: f64,
    /// World from node, per node.
    pub world_from_node: Vec<Affine3A>,
    /// Linear RGB, per light; see [`crate::Light::intensity`].
    pub light_intensity: Vec<Vec3>,
}

/// From where and how the scene is looked at.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// World from camera: looks along −z, +y is up. Rigid (no scale).
    pub world_from_camera: Affine3A,
    /// How directions become pixels.
    pub projection: Projection,
}

impl Scene {
    /// The scene at `secs` (any finite number; animations repeat after their duration).
    pub fn state_at(&self, secs: f64) -> State {
        let mut state = State::default();
        self.update_state(secs, &mut state);
        state
    }
}
