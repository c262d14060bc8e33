//! A bottom-level BVH over vertices that move: its boxes follow them, its shape stays, until it has become a bad one.
//!
//! How bad is told by the surface area heuristic (MacDonald & Booth 1990): the expected work of a ray that meets the root,
//!
//! ```text
//! C = Σ_slots A(slot) / A(root) · c        c: 1 for an inner node, the number of packs for a leaf
//! ```

use frameless_scene::Mesh;
use glam::{Vec3, Vec3A};
use obvhs::aabb::Aabb;

use crate::build::{Blas, FARTHEST};
use crate::kernel::Pack;
use crate::wide::Node;

/// The tree is built anew when a ray's expected work has grown by this factor. Lower: more building, which takes as long as
/// hundreds of refits; higher: slower rays. Within it lie the walks and jumps of the models we have tried.
const WORST: f32 = 1.8;

/// See the module.
#[derive(Clone, Debug)]
pub(crate) struct Flexible {
    pub(crate) blas: Blas,
    /// The vertices of the packs' triangles: `[corner][lane]`.
    vertices: Vec<[[u32; 4]; 3]>,
    /// C when the tree was built.
    cost_built: f32,
}

impl Flexible {
    /// A tree for the mesh with its vertices at `positions`. Unlike [`Blas::new`] it holds every triangle, since those that
    /// are nowhere now may be somewhere later.
    pub(crate) fn new(mesh: &Mesh, positions: &[Vec3]) -> Flexible {
        let corners = |primitive: u32| {
            sane(mesh.triangles[primitive as usize].map(|vertex| positions[vertex as usize]))
        };
        let primitives: Vec<u32> = (0..mesh.triangles.len() as u32).collect();
        let boxes = primitives.iter().map(|&p| Aabb::from_points(&corners(p).map(Vec3A::from)));
        let blas = Blas::over(&primitives, &boxes.collect::<Vec<_>>(), corners);
        let vertices = blas.packs.iter().map(|pack| {
            let lanes = pack.primitive.map(|primitive| mesh.triangles[primitive as usize]);
            std::array::from_fn(|corner| lanes.map(|triangle| triangle[corner]))
        });
        let mut flexible = Flexible { vertices: vertices.collect(), blas, cost_built: 0.0 };
        flexible.cost_built = flexible.fit_boxes();
        flexible
    }

    /// The tree with the vertices at `positions`, for which it is built anew if need be. Triangles with a vertex that is
    /// infinite, NaN or too far away have no area, so that no ray meets them.
    pub(crate) fn update(&mut self, mesh: &Mesh, positions: &[Vec3]) {
        if self.refit(positions) > WORST * self.cost_built {
            *self = Flexible::new(mesh, positions);
        }
    }

    /// Moves triangles and boxes; returns C.
    pub(crate) fn refit(&mut self, positions: &[Vec3]) -> f32 {
        for (pack, vertices) in self.blas.packs.iter_mut().zip(&self.vertices) {
            move_pack(pack, vertices, positions);
        }
        self.fit_boxes()
    }

    /// Boxes from the leaves up: children come after their parents. Returns C.
    fn fit_boxes(&mut self) -> f32 {
        let Blas { nodes, packs, bounds } = &mut self.blas;
        let mut work = 0.0;
        for index in (0..nodes.len()).rev() {
            let mut node = nodes[index];
            for slot in 0..8 {
                let child = node.child[slot];
                if child == Node::UNUSED {
                    continue;
                }
                let (low, high, cost) = if child.is_leaf() {
                    let packs = &packs[child.items()];
                    let (low, high) = box_of_packs(packs);
                    (low, high, packs.len() as f32)
                } else {
                    let (low, high) = nodes[child.node()].bounds();
                    (low, high, 1.0)
                };
                for axis in 0..3 {
                    node.bounds[2 * axis][slot] = low[axis];
                    node.bounds[2 * axis + 1][slot] = high[axis];
                }
                work += cost * half_area(low, high);
            }
            nodes[index] = node;
        }
        let (low, high) = nodes[0].bounds();
        *bounds = low.cmple(high).all().then_some((low, high));
        // A mesh that is a point costs nothing.
        work / half_area(low, high).max(f32::MIN_POSITIVE)
    }
}

#[inline(always)]
fn half_area(low: Vec3A, high: Vec3A) -> f32 {
    let d = high - low;
    d.x * d.y + d.y * d.z + d.z * d.x
}

/// The triangle, or a point of it if it is not finite.
fn sane(corners: [Vec3; 3]) -> [Vec3; 3] {
    let is_sane = |corner: &Vec3| corner.abs().max_element() < FARTHEST && !corner.is_nan();
    if corners.iter().all(is_sane) {
        return corners;
    }
    [corners.into_iter().find(is_sane).unwrap_or(Vec3::ZERO); 3]
}

#[inline(always)]
fn move_pack(pack: &mut Pack, vertices: &[[u32; 4]; 3], positions: &[Vec3]) {
    // NaN if any coordinate is; the sum of nine sane ones is less than this.
    let mut size = [0.0_f32; 4];
    for (corner, lanes) in pack.vertex.iter_mut().zip(vertices) {
        for lane in 0..4 {
            let position = positions[lanes[lane] as usize];
            for axis in 0..3 {
                corner[axis][lane] = position[axis];
                size[lane] += position[axis].abs();
            }
        }
    }
    if !size.iter().all(|&size| size < FARTHEST) {
        mend(pack, vertices, positions);
    }
}

#[cold]
fn mend(pack: &mut Pack, vertices: &[[u32; 4]; 3], positions: &[Vec3]) {
    for lane in 0..4 {
        let corners = vertices.map(|lanes| positions[lanes[lane] as usize]);
        for (corner, position) in pack.vertex.iter_mut().zip(sane(corners)) {
            (0..3).for_each(|axis| corner[axis][lane] = position[axis]);
        }
    }
}

#[inline(always)]
fn box_of_packs(packs: &[Pack]) -> (Vec3A, Vec3A) {
    let (mut low, mut high) = ([[f32::INFINITY; 4]; 3], [[f32::NEG_INFINITY; 4]; 3]);
    for corner in packs.iter().flat_map(|pack| &pack.vertex) {
        for axis in 0..3 {
            for lane in 0..4 {
                low[axis][lane] = low[axis][lane].min(corner[axis][lane]);
                high[axis][lane] = high[axis][lane].max(corner[axis][lane]);
            }
        }
    }
    let least = low.map(|lanes| lanes.into_iter().fold(f32::INFINITY, f32::min));
    let most = high.map(|lanes| lanes.into_iter().fold(f32::NEG_INFINITY, f32::max));
    (Vec3A::from_array(least), Vec3A::from_array(most))
}
