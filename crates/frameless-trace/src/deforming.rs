//! Instances that deform: their vertices at one moment, and the BVH over them.

use std::sync::Arc;

use frameless::Deformed as Vertices;
use frameless_scene::{Deformed, Geometry, Mesh, Scene, State};
use rayon::prelude::*;

use crate::refit::Flexible;

/// One deforming instance at one moment. Its memory is used again for the next.
#[derive(Clone)]
pub(crate) struct Deforming {
    now: Deformed,
    pub(crate) tree: Flexible,
    /// The mesh's, as the loop wants them.
    triangles: Arc<Vec<[u32; 3]>>,
}

impl Deforming {
    /// All of the scene's, at time 0.
    pub(crate) fn all(scene: &Scene) -> Vec<Deforming> {
        let state = scene.state_at(0.0);
        let all = (0..scene.deformations.len()).into_par_iter().map(|index| {
            let mut now = Deformed::default();
            scene.deform(index, &state, &mut now);
            let mesh = mesh(scene, index);
            let tree = Flexible::new(mesh, now.positions());
            Deforming { now, tree, triangles: Arc::new(mesh.triangles.clone()) }
        });
        all.collect()
    }

    /// Brings deformation number `index` to `state`; returns whether anything has moved.
    pub(crate) fn update(&mut self, scene: &Scene, index: usize, state: &State) -> bool {
        let changed = scene.deform(index, state, &mut self.now);
        if changed {
            self.tree.update(mesh(scene, index), self.now.positions());
        }
        changed
    }

    /// How many there are.
    pub(crate) fn triangles(&self) -> usize {
        self.triangles.len()
    }

    pub(crate) fn now(&self) -> &Deformed {
        &self.now
    }

    /// For the pose. What is nowhere is at the origin: no sample is on it.
    pub(crate) fn vertices(&self) -> Vertices {
        let positions = self.now.positions().iter();
        let positions = positions.map(|p| if p.is_finite() { p.to_array() } else { [0.0; 3] });
        Vertices { triangles: self.triangles.clone(), positions: Arc::new(positions.collect()) }
    }
}

/// # Panics
/// If the scene has no such deformation, or it is not of a mesh: see [`Scene::check`].
fn mesh(scene: &Scene, deformation: usize) -> &Mesh {
    let instance = scene.instances[scene.deformations[deformation].instance as usize];
    match &scene.geometries[instance.geometry as usize] {
        Geometry::Mesh(mesh) => mesh,
        Geometry::Sphere { .. } => panic!("only meshes deform"),
    }
}
