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

use crate::{Deformation, Geometry, Mesh, Scene, State};

/// A tenth of a light year: no vertex is drawn that is farther along an axis of its coordinates. Products of two coordinates, and of three in
/// areas, must stay below 3.4e38.
pub const FARTHEST_M: f32 = 1e15;

/// The vertices of one deforming instance, and the pose that they belong to. Its memory is used again for the next pose.
#[derive(Clone, Debug, Default)]
pub struct Deformed {
    positions: Vec<Vec3A>,
    normals: Vec<Vec3A>,
    colors: Vec<Vec4>,
    /// Positions and normals of a mesh with morph targets, before the skin.
    morphed: [Vec<Vec3>; 2],
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
    pub fn positions(&self) -> &[Vec3A] {
        &self.positions
    }

    /// How many of them are nowhere: infinite, NaN or beyond [`FARTHEST_M`].
    pub fn lost(&self) -> usize {
        let is_somewhere = |p: &Vec3A| p.abs().cmplt(Vec3A::splat(FARTHEST_M)).all();
        self.positions.iter().filter(|position| !is_somewhere(position)).count()
    }

    /// Of length one or zero; none if the mesh has none.
    pub fn normals(&self) -> &[Vec3A] {
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
            deformed.take_pose(mesh, deformation.skin.is_some());
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
    fn take_pose(&mut self, mesh: &Mesh, is_skinned: bool) {
        self.colors.clone_from(&mesh.colors);
        let mut morphed = std::mem::take(&mut self.morphed);
        let (positions, normals) = if mesh.targets.is_empty() {
            (&mesh.positions, &mesh.normals)
        } else {
            self.morph(mesh, &mut morphed);
            (&morphed[0], &morphed[1])
        };
        if is_skinned {
            self.skin(mesh, positions, normals);
        } else {
            self.positions.clear();
            self.positions.extend(positions.iter().map(|&position| Vec3A::from(position)));
            self.normals.clear();
            self.normals.extend(normals.iter().map(|&normal| Vec3A::from(normal)));
        }
        self.morphed = morphed;
    }

    /// Adds the targets, to positions and normals there and to the colours here.
    fn morph(&mut self, mesh: &Mesh, [positions, normals]: &mut [Vec<Vec3>; 2]) {
        positions.clone_from(&mesh.positions);
        normals.clone_from(&mesh.normals);
        let [mut turned, mut tinted] = [false; 2];
        for (target, &weight) in mesh.targets.iter().zip(&self.weights) {
            if weight == 0.0 {
                continue;
            }
            add(positions, &target.positions, weight);
            add(normals, &target.normals, weight);
            add(&mut self.colors, &target.colors, weight);
            turned |= !target.normals.is_empty();
            tinted |= !target.colors.is_empty();
        }
        if turned {
            normals.iter_mut().for_each(|normal| *normal = normal.normalize_or_zero());
        }
        if tinted {
            // What is no number becomes 0.
            let sane = |c: &mut Vec4| *c = c.max(Vec4::ZERO).min(Vec4::ONE);
            self.colors.iter_mut().for_each(sane);
        }
    }

    fn skin(&mut self, mesh: &Mesh, positions: &[Vec3], normals: &[Vec3]) {
        let joints = &self.joints[..];
        let (first, others) = mesh.influences.split_first().expect("a skinned mesh has joints");
        let matrix = |vertex: usize, (&joint, &weight): (&[u16; 4], &[f32; 4])| {
            let more = others.iter().map(|set| (&set.joints[vertex], &set.weights[vertex]));
            more.fold(blend(joints, joint, weight), |sum, (&joint, &weight)| {
                plus(sum, blend(joints, joint, weight))
            })
        };
        let influences = first.joints.iter().zip(&first.weights).enumerate();
        let matrices = influences.map(|(vertex, influence)| matrix(vertex, influence));
        self.positions.clear();
        self.normals.clear();
        if normals.is_empty() {
            let moved = positions.iter().zip(matrices);
            self.positions.extend(moved.map(|(&p, matrix)| matrix.transform_point3a(p.into())));
            return;
        }
        self.normals.resize(normals.len(), Vec3A::ZERO);
        let moved = positions.iter().zip(matrices).zip(normals.iter().zip(&mut self.normals));
        self.positions.extend(moved.map(|((&position, matrix), (&normal, turned))| {
            *turned = (cofactors(&matrix.matrix3) * Vec3A::from(normal)).normalize_or_zero();
            matrix.transform_point3a(position.into())
        }));
    }
}

/// Σ s_j · M_j over the four joints of a set.
#[inline(always)]
fn blend(joints: &[Affine3A], joint: [u16; 4], weight: [f32; 4]) -> Affine3A {
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
