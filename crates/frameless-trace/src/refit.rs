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
/// hundreds of refits; higher: slower rays. Walking, running and bending models that we have tried stay within it (at most 1.74).
const WORST: f32 = 1.8;

/// See the module.
#[derive(Clone, Debug)]
pub(crate) struct Flexible {
    pub(crate) blas: Blas,
    /// The vertices of the packs' triangles: `[corner][lane]`.
    vertices: Vec<[[u32; 4]; 3]>,
    /// Per pack and per node: the box around it.
    pack_boxes: Vec<[Vec3A; 2]>,
    node_boxes: Vec<[Vec3A; 2]>,
    /// C when the tree was built.
    cost_built: f32,
}

impl Flexible {
    /// A tree for the mesh with its vertices at `positions`. Unlike [`Blas::new`] it holds every triangle, since those that
    /// are nowhere now may be somewhere later.
    pub(crate) fn new(mesh: &Mesh, positions: &[Vec3A]) -> Flexible {
        let corners = |primitive: u32| {
            sane(mesh.triangles[primitive as usize].map(|v| positions[v as usize]))
        };
        let primitives: Vec<u32> = (0..mesh.triangles.len() as u32).collect();
        let boxes = primitives.iter().map(|&primitive| Aabb::from_points(&corners(primitive)));
        let boxes: Vec<Aabb> = boxes.collect();
        let blas = Blas::over(&primitives, boxes, |primitive| corners(primitive).map(Vec3::from));
        let vertices = blas.packs.iter().map(|pack| {
            let lanes = pack.primitive.map(|primitive| mesh.triangles[primitive as usize]);
            std::array::from_fn(|corner| lanes.map(|triangle| triangle[corner]))
        });
        let mut flexible = Flexible {
            vertices: vertices.collect(),
            pack_boxes: vec![NOTHING; blas.packs.len()],
            node_boxes: vec![NOTHING; blas.nodes.len()],
            blas,
            cost_built: 0.0,
        };
        flexible.cost_built = flexible.refit(positions);
        flexible
    }

    /// The tree with the vertices at `positions`, for which it is built anew if need be. Triangles with a vertex that is
    /// infinite, NaN or too far away have no area, so that no ray meets them.
    pub(crate) fn update(&mut self, mesh: &Mesh, positions: &[Vec3A]) {
        if self.refit(positions) > WORST * self.cost_built {
            *self = Flexible::new(mesh, positions);
        }
    }

    /// Moves triangles and boxes; returns C.
    pub(crate) fn refit(&mut self, positions: &[Vec3A]) -> f32 {
        let packs = self.blas.packs.iter_mut().zip(&self.vertices).zip(&mut self.pack_boxes);
        if are_all_sane(positions) {
            packs.for_each(|((pack, vertices), bounds)| {
                *bounds = move_pack(pack, vertices, positions, |triangle| triangle);
            });
        } else {
            packs.for_each(|((pack, vertices), bounds)| {
                *bounds = move_pack(pack, vertices, positions, sane);
            });
        }
        self.fit_boxes()
    }

    /// Boxes from the leaves up: children come after their parents. Returns C.
    fn fit_boxes(&mut self) -> f32 {
        let Flexible { blas: Blas { nodes, bounds, .. }, pack_boxes, node_boxes, .. } = self;
        let mut work = 0.0;
        for (index, node) in nodes.iter_mut().enumerate().rev() {
            let mut around = NOTHING;
            for slot in 0..8 {
                let child = node.child[slot];
                if child == Node::UNUSED {
                    continue;
                }
                let (inside, cost) = if child.is_leaf() {
                    let packs = &pack_boxes[child.items()];
                    (packs.iter().copied().fold(NOTHING, union), packs.len() as f32)
                } else {
                    (node_boxes[child.node()], 1.0)
                };
                let [low, high] = inside;
                for axis in 0..3 {
                    node.bounds[2 * axis][slot] = low[axis];
                    node.bounds[2 * axis + 1][slot] = high[axis];
                }
                work += cost * half_area(inside);
                around = union(around, inside);
            }
            node_boxes[index] = around;
        }
        let [low, high] = node_boxes[0];
        *bounds = low.cmple(high).all().then_some((low, high));
        // A mesh that is a point costs nothing.
        work / half_area(node_boxes[0]).max(f32::MIN_POSITIVE)
    }
}

/// The box around nothing.
const NOTHING: [Vec3A; 2] = [Vec3A::INFINITY, Vec3A::NEG_INFINITY];

#[inline(always)]
fn union(a: [Vec3A; 2], b: [Vec3A; 2]) -> [Vec3A; 2] {
    [a[0].min(b[0]), a[1].max(b[1])]
}

#[inline(always)]
fn half_area([low, high]: [Vec3A; 2]) -> f32 {
    let d = high - low;
    d.x * d.y + d.y * d.z + d.z * d.x
}

/// Whether no vertex is too far away, infinite or NaN: so is the sum, then. It may err on the safe side.
fn are_all_sane(positions: &[Vec3A]) -> bool {
    let sum = positions.iter().fold(Vec3A::ZERO, |sum, position| sum + position.abs());
    sum.cmplt(Vec3A::splat(FARTHEST)).all()
}

/// The triangle, or a point of it if it is not finite.
fn sane(corners: [Vec3A; 3]) -> [Vec3A; 3] {
    let is_sane = |corner: &Vec3A| corner.abs().cmplt(Vec3A::splat(FARTHEST)).all();
    if corners.iter().all(is_sane) {
        return corners;
    }
    [corners.into_iter().find(is_sane).unwrap_or(Vec3A::ZERO); 3]
}

/// Moves the pack's triangles, each as `mend` leaves it; returns the box around them.
#[inline(always)]
fn move_pack(
    pack: &mut Pack,
    vertices: &[[u32; 4]; 3],
    positions: &[Vec3A],
    mend: impl Fn([Vec3A; 3]) -> [Vec3A; 3],
) -> [Vec3A; 2] {
    let lanes: [[Vec3A; 3]; 4] = std::array::from_fn(|lane| {
        mend(std::array::from_fn(|corner| positions[vertices[corner][lane] as usize]))
    });
    let mut around = NOTHING;
    for (corner, moved) in pack.vertex.iter_mut().enumerate() {
        let [a, b, c, d] = std::array::from_fn(|lane| lanes[lane][corner]);
        *moved = [[a.x, b.x, c.x, d.x], [a.y, b.y, c.y, d.y], [a.z, b.z, c.z, d.z]];
        around = union(around, [a.min(b).min(c.min(d)), a.max(b).max(c.max(d))]);
    }
    around
}
