//! The vertices of a mesh that deforms, at one moment: morph targets first, then the skin (glTF 2.0 §3.7.2.2, §3.7.3).
//!
//! ```text
//! v  = position + Σ_k w_k · target_k                 morphing; normals and colours likewise
//! M  = Σ_j s_j · (world from joint j) · (inverse bind matrix j)        s: the vertex's joint weights, which sum to 1
//! v' = M v,    n' = cof(M) n / |cof(M) n|            skinning: straight into the world
//! ```
//!
//! Normals take the cofactor matrix, det(M) · M⁻ᵀ, which exists for every M; where it gives no direction, the normal is zero
//! and the triangle's own counts. A mesh without normals stays without: its triangles are flat in every pose.

use glam::{Affine3A, Mat3A, Vec3, Vec3A, Vec4};

use crate::{Deformation, Geometry, Influences, Mesh, Scene, State};

/// The vertices of one deforming instance, and the pose that they belong to. Its memory is used again for the next pose.
#[derive(Clone, Debug, Default)]
pub struct Deformed {
    positions: Vec<Vec3>,
    normals: Vec<Vec3>,
    colors: Vec<Vec4>,
    /// World from mesh, per joint: of the vertices, and of a pose that is being compared.
    joints: Vec<Affine3A>,
    next_joints: Vec<Affine3A>,
    weights: Vec<f32>,
    /// Which deformation the vertices are of; `None` before the first pose.
    deformation: Option<usize>,
}

impl Deformed {
    /// As many as the mesh has vertices, in the instance's coordinates (the world's, if it is skinned). Infinite or NaN where
    /// transforms overflow.
    pub fn positions(&self) -> &[Vec3] {
        &self.positions
    }

    /// Of length one or zero; none if the mesh has none.
    pub fn normals(&self) -> &[Vec3] {
        &self.normals
    }

    /// In [0, 1]; none if the mesh has none.
    pub fn colors(&self) -> &[Vec4] {
        &self.colors
    }
}

impl Scene {
    /// Brings `deformed`, of this scene, to the vertices that deformation number `index` has in `state`. Returns whether anything
    /// has changed: nothing is computed for a pose that it has already. Allocates nothing once it has held this deformation.
    pub fn deform(&self, index: usize, state: &State, deformed: &mut Deformed) -> bool {
        let deformation = &self.deformations[index];
        self.find_joints(deformation, state, &mut deformed.next_joints);
        let Deformation { weights, .. } = deformation;
        let weights = &state.morph_weights[weights.start as usize..weights.end as usize];
        let same_pose = deformed.joints == deformed.next_joints && deformed.weights == *weights;
        if deformed.deformation == Some(index) && same_pose {
            return false;
        }
        deformed.deformation = Some(index);
        std::mem::swap(&mut deformed.joints, &mut deformed.next_joints);
        deformed.weights.clear();
        deformed.weights.extend_from_slice(weights);
        let instance = self.instances[deformation.instance as usize];
        if let Geometry::Mesh(mesh) = &self.geometries[instance.geometry as usize] {
            deformed.morph(mesh);
            if deformation.skin.is_some() {
                deformed.skin(mesh);
            }
        }
        true
    }

    /// World from the coordinates of an instance: its node's place, or nothing to be done if it is skinned.
    pub fn world_from_instance(&self, instance: usize, state: &State) -> Affine3A {
        match self.deformation_of(instance) {
            Some(index) if self.deformations[index].skin.is_some() => Affine3A::IDENTITY,
            _ => state.world_from_node[self.instances[instance].node as usize],
        }
    }

    /// The number of an instance's deformation, if it deforms.
    pub fn deformation_of(&self, instance: usize) -> Option<usize> {
        self.deformations.binary_search_by_key(&instance, |d| d.instance as usize).ok()
    }

    fn find_joints(&self, deformation: &Deformation, state: &State, joints: &mut Vec<Affine3A>) {
        joints.clear();
        let Some(skin) = deformation.skin else { return };
        let skin = &self.skins[skin as usize];
        let bones = skin.joints.iter().zip(&skin.inverse_bind);
        joints.extend(bones.map(|(&joint, bind)| state.world_from_node[joint as usize] * *bind));
    }
}

impl Deformed {
    fn morph(&mut self, mesh: &Mesh) {
        self.positions.clone_from(&mesh.positions);
        self.normals.clone_from(&mesh.normals);
        self.colors.clone_from(&mesh.colors);
        let mut changed = [false; 2];
        for (target, &weight) in mesh.targets.iter().zip(&self.weights) {
            if weight == 0.0 {
                continue;
            }
            add(&mut self.positions, &target.positions, weight);
            add(&mut self.normals, &target.normals, weight);
            add(&mut self.colors, &target.colors, weight);
            changed[0] |= !target.normals.is_empty();
            changed[1] |= !target.colors.is_empty();
        }
        if changed[0] {
            self.normals.iter_mut().for_each(|normal| *normal = normal.normalize_or_zero());
        }
        if changed[1] {
            // What is no number becomes 0.
            let sane = |c: &mut Vec4| *c = c.max(Vec4::ZERO).min(Vec4::ONE);
            self.colors.iter_mut().for_each(sane);
        }
    }

    fn skin(&mut self, mesh: &Mesh) {
        let Deformed { positions, normals, joints, .. } = self;
        let matrix = |vertex: usize| match &mesh.influences[..] {
            [set] => blend(set, vertex, joints),
            sets => sets.iter().map(|set| blend(set, vertex, joints)).fold(ZERO, plus),
        };
        if normals.is_empty() {
            for (vertex, position) in positions.iter_mut().enumerate() {
                *position = matrix(vertex).transform_point3(*position);
            }
            return;
        }
        for (vertex, (position, normal)) in positions.iter_mut().zip(normals).enumerate() {
            let world_from_mesh = matrix(vertex);
            *position = world_from_mesh.transform_point3(*position);
            let turned = cofactors(&world_from_mesh.matrix3) * Vec3A::from(*normal);
            *normal = turned.normalize_or_zero().into();
        }
    }
}

const ZERO: Affine3A = Affine3A { matrix3: Mat3A::ZERO, translation: Vec3A::ZERO };

/// Σ s_j · M_j over the four joints of a set.
#[inline(always)]
fn blend(set: &Influences, vertex: usize, joints: &[Affine3A]) -> Affine3A {
    let (joint, weight) = (set.joints[vertex], set.weights[vertex]);
    let part = |k: usize| scaled(&joints[usize::from(joint[k])], weight[k]);
    plus(plus(part(0), part(1)), plus(part(2), part(3)))
}

#[inline(always)]
fn scaled(m: &Affine3A, by: f32) -> Affine3A {
    Affine3A { matrix3: m.matrix3 * by, translation: m.translation * by }
}

#[inline(always)]
fn plus(a: Affine3A, b: Affine3A) -> Affine3A {
    Affine3A { matrix3: a.matrix3 + b.matrix3, translation: a.translation + b.translation }
}

/// det(M) · M⁻ᵀ: its columns are the cross products of M's.
#[inline(always)]
fn cofactors(m: &Mat3A) -> Mat3A {
    let (x, y, z) = (m.x_axis, m.y_axis, m.z_axis);
    Mat3A::from_cols(y.cross(z), z.cross(x), x.cross(y))
}

/// values += weight · displacements, unless there are none.
fn add<V>(values: &mut [V], displacements: &[V], weight: f32)
where
    V: Copy + std::ops::AddAssign + std::ops::Mul<f32, Output = V>,
{
    for (value, &displacement) in values.iter_mut().zip(displacements) {
        *value += displacement * weight;
    }
}
