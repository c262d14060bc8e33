//! Instances that deform: their vertices at one moment, and the BVH over them.

use std::sync::{Arc, Once, OnceLock};

use frameless::Deformed as Vertices;
use frameless_scene::{Deformed, Geometry, Mesh, Scene, State};
use rayon::prelude::*;

use crate::crowd::expected_boxes;
use crate::refit::Flexible;

/// One deforming instance at one moment. Its memory is used again for the next.
#[derive(Clone)]
pub(crate) struct Deforming {
    now: Deformed,
    pub(crate) tree: Flexible,
    /// What entering it counts for, see [`Stack::boxes`](crate::traverse::Stack::boxes).
    pub(crate) price: u32,
    /// The mesh's, as the loop wants them.
    triangles: Arc<Vec<[u32; 3]>>,
    /// Whether it has been said that vertices are lost: of whichever instance, at whichever moment.
    pub(crate) is_said: Arc<Once>,
}

impl Deforming {
    /// All of the scene's, at time 0.
    pub(crate) fn all(scene: &Scene) -> Vec<Deforming> {
        let (state, is_said) = (scene.state_at(0.0), Arc::new(Once::new()));
        // Per geometry: a crowd has one.
        let triangles = vec![OnceLock::new(); scene.geometries.len()];
        let all = (0..scene.deformations.len()).into_par_iter().map(|index| {
            let mut now = Deformed::default();
            scene.deform(index, &state, &mut now);
            let mesh = mesh(scene, index);
            let tree = Flexible::new(mesh, now.positions());
            let instance = scene.instances[scene.deformations[index].instance as usize];
            let triangles = triangles[instance.geometry as usize]
                .get_or_init(|| Arc::new(mesh.triangles.clone()))
                .clone();
            let price = expected_boxes(&tree.blas);
            Deforming { now, tree, price, triangles, is_said: is_said.clone() }
        });
        all.collect()
    }

    /// Brings deformation number `index` to `state`; returns whether anything has moved.
    pub(crate) fn update(&mut self, scene: &Scene, index: usize, state: &State) -> bool {
        let changed = scene.deform(index, state, &mut self.now);
        if changed {
            self.tree.update(mesh(scene, index), self.now.positions());
            self.say_what_is_lost(scene, index, state.secs);
        }
        changed
    }

    /// Once per world, however many of its instances and moments lose some. What is lost at time 0 the loader has told.
    fn say_what_is_lost(&self, scene: &Scene, index: usize, secs: f64) {
        if self.tree.is_whole || self.is_said.is_completed() {
            return;
        }
        let (lost, all) = (self.now.lost(), self.now.positions().len());
        if lost == 0 {
            return;
        }
        self.is_said.call_once(|| {
            let instance = scene.deformations[index].instance;
            let node = &scene.nodes[scene.instances[instance as usize].node as usize].name;
            log::warn!(
                "{}: at {secs:.3} s morph targets or joints bring {lost} of {all} vertices of {node:?} infinitely far away: they are \
                 not drawn (said once)",
                scene.name
            );
        });
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
