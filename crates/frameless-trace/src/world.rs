//! A scene prepared for tracing.

use std::f32::consts::FRAC_1_PI;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, OnceLock};

use frameless_scene::{Bounds, Geometry, Mesh, Scene};
use glam::{Affine3A, Vec3A};
use rayon::prelude::*;

use crate::build::{Blas, OneMesh};
use crate::deforming::Deforming;
use crate::emitters::Emitters;
use crate::forecast::Efforts;
use crate::holes::may_have_holes;
use crate::images::Mirrors;
use crate::kernel::Isa;
use crate::matter::is_plain;
use crate::sparing::Sparing;
use crate::standing::Standing;
use crate::surroundings::Surroundings;
use crate::texture::Copies;

/// A [`Scene`] prepared for tracing: what does not change with time. Immutable; share it in an [`Arc`].
pub struct World {
    scene: Arc<Scene>,
    /// Per geometry; empty for spheres, and for meshes all of whose instances deform. Not made of what is `standing`, until it moves.
    pub(crate) blas: Vec<OnceLock<Blas>>,
    /// All that does not move, in one tree.
    pub(crate) standing: Option<Standing>,
    /// Per deformation of the scene: what its first moment begins with.
    pub(crate) deforming: Vec<Deforming>,
    /// Smaller copies of the scene's pictures.
    pub(crate) copies: Copies,
    /// Per material, see [`is_plain`].
    pub(crate) is_plain: Vec<bool>,
    /// Per material: how many textures are looked up to know all of it.
    pub(crate) textures: Vec<u32>,
    /// Per geometry: whether rays may pass some of its triangles.
    pub(crate) holes: Vec<bool>,
    /// Whether any has.
    pub(crate) has_holes: bool,
    /// Per geometry: its box at rest.
    pub(crate) boxes: Vec<Option<Bounds>>,
    pub(crate) mirrors: Mirrors,
    pub(crate) emitters: Emitters,
    /// The scene's environment.
    pub(crate) surroundings: Option<Surroundings>,
    pub(crate) isa: Isa,
    /// What samples may take.
    pub(crate) efforts: Efforts,
    /// Tells the moments of this world from those of others.
    pub(crate) id: u64,
}

impl World {
    /// Builds a bottom-level BVH per mesh: about 2 s per million triangles on one core, on all cores.
    pub fn new(scene: Arc<Scene>) -> World {
        World::with_isa(scene, Isa::detect())
    }

    pub(crate) fn with_isa(scene: Arc<Scene>, isa: Isa) -> World {
        static WORLDS: AtomicU64 = AtomicU64::new(1);
        let _sparing = Sparing::begin();
        let is_rigid = rigid_geometries(&scene);
        let (standing, copies) = rayon::join(|| Standing::new(&scene), || Copies::new(&scene));
        let mut stands = vec![false; scene.geometries.len()];
        for (index, instance) in scene.instances.iter().enumerate() {
            let is_there = standing.as_ref().is_some_and(|standing| standing.has(index));
            stands[instance.geometry as usize] |= is_there;
        }
        let geometries = scene.geometries.par_iter().zip(is_rigid).zip(stands);
        let blas = geometries.map(|((geometry, is_rigid), stands)| match geometry {
            Geometry::Mesh(_) if stands => OnceLock::new(),
            Geometry::Mesh(mesh) if is_rigid => {
                Blas::new(&OneMesh { mesh, place: &Affine3A::IDENTITY }).into()
            }
            _ => Blas::new(&OneMesh { mesh: &Mesh::default(), place: &Affine3A::IDENTITY }).into(),
        });
        let holes: Vec<bool> = scene.geometries.iter().map(|g| has_holes(&scene, g)).collect();
        World {
            has_holes: holes.contains(&true),
            holes,
            blas: blas.collect(),
            standing,
            boxes: scene.geometries.par_iter().map(Geometry::bounds).collect(),
            deforming: Deforming::all(&scene),
            mirrors: Mirrors::new(&scene),
            emitters: Emitters::new(&scene),
            surroundings: scene.environment.as_ref().map(Surroundings::new),
            copies,
            textures: scene.materials.iter().map(|m| m.textures().count() as u32).collect(),
            is_plain: scene.materials.iter().map(|m| is_plain(&scene, m)).collect(),
            scene,
            isa,
            efforts: Efforts::default(),
            id: WORLDS.fetch_add(1, Ordering::Relaxed),
        }
    }

    /// What comes from far away, along a direction of any length: the environment, else the sky, mixed between straight down and straight up
    /// by the direction's height.
    #[inline]
    pub(crate) fn sky(&self, direction: Vec3A) -> Vec3A {
        self.sky_along(direction.normalize_or_zero())
    }

    /// The same along a direction of unit length.
    #[inline(always)]
    pub(crate) fn sky_along(&self, direction: Vec3A) -> Vec3A {
        if let Some(surroundings) = &self.surroundings {
            return surroundings.radiance(direction);
        }
        let [down, up] = self.scene.sky.map(Vec3A::from);
        down.lerp(up, 0.5 + 0.5 * direction.y)
    }

    /// What a white matte surface that nothing shades sends back of ambient light.
    #[inline]
    pub(crate) fn ambient(&self, normal: Vec3A) -> Vec3A {
        let ambient = Vec3A::from(self.scene.ambient);
        match &self.surroundings {
            None => ambient,
            Some(surroundings) => ambient + surroundings.irradiance(normal) * FRAC_1_PI,
        }
    }

    /// Makes the trees of what stands still, for a moment at which it does not.
    #[cold]
    pub(crate) fn part_what_stands(&self) {
        let Some(standing) = &self.standing else { return };
        for (index, instance) in self.scene.instances.iter().enumerate() {
            let geometry = instance.geometry as usize;
            if let (Some(place), Geometry::Mesh(mesh)) =
                (standing.place(index), &self.scene.geometries[geometry])
            {
                self.blas[geometry].get_or_init(|| Blas::new(&OneMesh { mesh, place }));
            }
        }
    }

    /// Whether bringing it to another time takes more than a fifth of a batch: about 100 µs.
    pub(crate) fn takes_long_to_move(&self) -> bool {
        /// Deforming triangles; 20 ns each, vertices included.
        const MANY: usize = 5_000;
        /// An instance that moves takes its part in the tree over all of them: 100 ns.
        const PER_INSTANCE: usize = 5;
        if self.scene.animation.channels.is_empty() {
            return false;
        }
        let deforming: usize = self.deforming.iter().map(Deforming::triangles).sum();
        let moves = self.scene.moving_nodes();
        let moving = self.scene.instances.iter().filter(|one| moves[one.node as usize]).count();
        deforming + PER_INSTANCE * moving > MANY
    }

    /// What was prepared.
    pub fn scene(&self) -> &Arc<Scene> {
        &self.scene
    }
}

fn has_holes(scene: &Scene, geometry: &Geometry) -> bool {
    matches!(geometry, Geometry::Mesh(mesh) if may_have_holes(scene, mesh))
}

/// Per geometry, whether any of its instances does not deform.
fn rigid_geometries(scene: &Scene) -> Vec<bool> {
    let mut is_rigid = vec![false; scene.geometries.len()];
    for (index, instance) in scene.instances.iter().enumerate() {
        is_rigid[instance.geometry as usize] |= scene.deformation_of(index).is_none();
    }
    is_rigid
}
