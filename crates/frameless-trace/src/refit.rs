//! A bottom-level BVH over vertices that move: its boxes follow them, its shape stays, until it has become a bad one.
//!
//! How bad is told by the surface area heuristic (MacDonald & Booth 1990): the expected work of a ray that meets the root,
//!
//! ```text
//! C = Σ_slots A(slot) / A(root)
//! ```

use frameless_scene::{FARTHEST_M, Mesh};
use glam::Vec3A;

use crate::build::{Blas, Triangles};
use crate::leaf::{Corner, Leaf, vertices_at};
use crate::wide::{Bounds, Child, NOTHING, Node, half_area, union};

/// The tree is built anew when a ray's expected work has grown by this factor. Lower: more building, which takes as long as
/// hundreds of refits; higher: slower rays. Walking, running and bending models that we have tried stay within it (at most 1.74).
const WORST: f32 = 1.8;

/// See the module.
#[derive(Clone, Debug)]
pub(crate) struct Flexible {
    pub(crate) blas: Blas,
    /// Which vertices the leaves have, from the last node to the first.
    vertices: Vec<u32>,
    /// Per node: the box around it.
    boxes: Vec<Bounds>,
    /// C when the tree was built.
    cost_built: f32,
    /// Whether every vertex is somewhere.
    pub(crate) is_whole: bool,
}

/// A mesh with its vertices elsewhere. It holds every triangle, since those that are nowhere now may be somewhere later.
struct Bent<'a> {
    mesh: &'a Mesh,
    positions: &'a [Vec3A],
}

impl Triangles for Bent<'_> {
    fn count(&self) -> u32 {
        self.mesh.triangles.len() as u32
    }

    /// Or three times a point of it if it is not finite. Vertices that are at one place now may part.
    fn corners(&self, triangle: u32) -> [Corner; 3] {
        let vertices = self.mesh.triangles[triangle as usize];
        let corners = vertices.map(|vertex| self.positions[vertex as usize]);
        let corners = match corners.iter().all(is_sane) {
            true => corners,
            false => [corners.into_iter().find(is_sane).unwrap_or(Vec3A::ZERO); 3],
        };
        [0, 1, 2].map(|k| Corner { at: corners[k].into(), name: [vertices[k], 0, 0] })
    }
}

impl Flexible {
    /// A tree for the mesh with its vertices at `positions`.
    pub(crate) fn new(mesh: &Mesh, positions: &[Vec3A]) -> Flexible {
        let blas = Blas::new(&Bent { mesh, positions });
        let mut vertices = Vec::new();
        let children = blas.nodes.iter().rev().flat_map(|node| node.child);
        for child in children.filter(|&child| child != Node::UNUSED && child.is_leaf()) {
            let leaf = Leaf::at(&blas.leaves, child.place());
            let (begin, (_, count)) = (vertices.len(), vertices_at(&blas.leaves, child.place()));
            vertices.resize(begin + count, u32::MAX);
            for lane in 0..leaf.triangles() {
                let triangle = mesh.triangles[leaf.triangle(lane) as usize];
                for (corner, vertex) in triangle.into_iter().enumerate() {
                    vertices[begin + leaf.vertex_of(lane, corner)] = vertex;
                }
            }
        }
        vertices.shrink_to_fit();
        let boxes = vec![NOTHING; blas.nodes.len()];
        let mut flexible = Flexible { blas, vertices, boxes, cost_built: 0.0, is_whole: true };
        flexible.cost_built = flexible.refit(positions);
        flexible
    }

    /// The tree with the vertices at `positions`, for which it is built anew if need be. Triangles with a vertex that is
    /// infinite, NaN or too far away are hit by no ray.
    pub(crate) fn update(&mut self, mesh: &Mesh, positions: &[Vec3A]) {
        if self.refit(positions) > WORST * self.cost_built {
            *self = Flexible::new(mesh, positions);
        }
    }

    /// Moves triangles and boxes; returns C.
    pub(crate) fn refit(&mut self, positions: &[Vec3A]) -> f32 {
        self.is_whole = are_all_sane(positions);
        match self.is_whole {
            true => self.fit_boxes(positions, |_| true),
            false => self.fit_boxes(positions, is_sane),
        }
    }

    /// Boxes from the leaves up: children come after their parents. Returns C.
    #[inline(always)]
    fn fit_boxes(&mut self, positions: &[Vec3A], is_sane: impl Fn(&Vec3A) -> bool) -> f32 {
        let Flexible { blas: Blas { nodes, leaves, bounds }, vertices, boxes, .. } = self;
        let (mut work, mut vertices) = (0.0, &vertices[..]);
        for (index, node) in nodes.iter_mut().enumerate().rev() {
            let mut inside = [NOTHING; 8];
            for (child, inside) in node.child.iter().zip(&mut inside) {
                if *child == Node::UNUSED {
                    continue;
                }
                *inside = match child.is_leaf() {
                    true => move_leaf(leaves, &mut vertices, *child, positions, &is_sane),
                    false => boxes[child.node()],
                };
                work += half_area(*inside);
            }
            boxes[index] = node.fit(&inside);
        }
        let [low, high] = boxes[0];
        *bounds = low.cmple(high).all().then_some((low, high));
        // A mesh that is a point costs nothing.
        work / half_area(boxes[0]).max(f32::MIN_POSITIVE)
    }
}

/// Whether no vertex is too far away, infinite or NaN: so is the sum, then. It may err on the safe side.
fn are_all_sane(positions: &[Vec3A]) -> bool {
    let sum = positions.iter().fold(Vec3A::ZERO, |sum, position| sum + position.abs());
    sum.cmplt(Vec3A::splat(FARTHEST_M)).all()
}

fn is_sane(position: &Vec3A) -> bool {
    position.abs().cmplt(Vec3A::splat(FARTHEST_M)).all()
}

/// Moves a leaf's vertices, which are the next ones; returns the box around those that are sane. The others become NaN, so that no ray meets their triangles.
#[inline(always)]
fn move_leaf(
    leaves: &mut [u32],
    vertices: &mut &[u32],
    leaf: Child,
    positions: &[Vec3A],
    is_sane: impl Fn(&Vec3A) -> bool,
) -> Bounds {
    let (first, count) = vertices_at(leaves, leaf.place());
    let mut around = NOTHING;
    let words = &mut leaves[first..first + 3 * count];
    let (these, rest) = vertices.split_at(count);
    *vertices = rest;
    for (k, &vertex) in these.iter().enumerate() {
        let mut position = positions[vertex as usize];
        if is_sane(&position) {
            around = union(around, [position; 2]);
        } else {
            position = Vec3A::NAN;
        }
        for axis in 0..3 {
            words[axis * count + k] = position[axis].to_bits();
        }
    }
    around
}
