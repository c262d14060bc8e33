//! From triangles to a wide BVH: of few at once, of many in parts (see [`crate::parts`]).

use frameless::prefer_large_pages;
use frameless_scene::{FARTHEST_M, Mesh};
use glam::{Affine3A, Vec3, Vec3A};
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::node::Bvh2Node;
use obvhs::bvh2::reinsertion::ReinsertionOptimizer;

use crate::collapse::{Collapse, bounds};
use crate::leaf::{self, Corner, LONGEST, MOST_TRIANGLES, MOST_VERTICES};
use crate::parts;
use crate::sah;
use crate::wide::{Child, Node};

/// A mesh's bottom-level BVH with its triangles.
#[derive(Clone, Debug)]
pub(crate) struct Blas {
    /// The first is the root; parents come before their children.
    pub(crate) nodes: Vec<Node>,
    /// See [`crate::leaf`]; as many words follow the last leaf as may be read of one.
    pub(crate) leaves: Vec<u32>,
    /// Of all triangles that can be hit; `None` if there are none.
    pub(crate) bounds: Option<(Vec3A, Vec3A)>,
}

/// What a tree is built over.
pub(crate) trait Triangles: Sync {
    /// How many there are.
    fn count(&self) -> u32;

    fn corners(&self, triangle: u32) -> [Corner; 3];
}

/// A mesh where it stands.
pub(crate) struct OneMesh<'a> {
    pub(crate) mesh: &'a Mesh,
    pub(crate) place: &'a Affine3A,
}

impl Triangles for OneMesh<'_> {
    fn count(&self) -> u32 {
        self.mesh.triangles.len() as u32
    }

    fn corners(&self, triangle: u32) -> [Corner; 3] {
        corners_at(self.place, self.mesh, triangle)
    }
}

impl Blas {
    /// Of those triangles that can be hit: none with a vertex that is not finite, or so far away that squares overflow. The builder panics
    /// on NaN. Triangles without area stay; no ray hits them.
    pub(crate) fn new(triangles: &impl Triangles) -> Blas {
        let Tree { mut nodes, mut leaves, roots } = parts::build(triangles);
        if nodes.is_empty() {
            nodes.push(Node::EMPTY);
        }
        leaves.extend([0; LONGEST]);
        // What is aligned as nodes are is copied for that, beside all that there is: not for the last bytes, which nobody has touched.
        if nodes.capacity() > 2 * nodes.len() {
            nodes.shrink_to_fit();
        }
        leaves.shrink_to_fit();
        prefer_large_pages(&nodes);
        prefer_large_pages(&leaves);
        let bounds = roots.first().map(|root| root.bounds.map(Vec3A::from).into());
        Blas { nodes, leaves, bounds }
    }
}

/// A triangle's vertices.
pub(crate) fn corners(mesh: &Mesh, primitive: u32) -> [Vec3; 3] {
    mesh.triangles[primitive as usize].map(|vertex| mesh.positions[vertex as usize])
}

/// Where the mesh stands; what is at one place is one vertex.
pub(crate) fn corners_at(place: &Affine3A, mesh: &Mesh, primitive: u32) -> [Corner; 3] {
    corners(mesh, primitive).map(|corner| {
        let at = place.transform_point3(corner);
        Corner { at, name: at.to_array().map(f32::to_bits) }
    })
}

/// The box around a triangle; `None` if no tree may hold it.
pub(crate) fn sane_box(corners: &[Corner; 3]) -> Option<[Vec3; 2]> {
    let is_sane = |c: &Corner| c.at.is_finite() && c.at.abs().max_element() < FARTHEST_M;
    let [a, b, c] = corners.map(|corner| corner.at);
    corners.iter().all(is_sane).then(|| [a.min(b).min(c), a.max(b).max(c)])
}

/// Of a tree, and of trees that are to be joined.
#[derive(Default)]
pub(crate) struct Tree {
    /// Of one tree the first is the root.
    pub(crate) nodes: Vec<Node>,
    pub(crate) leaves: Vec<u32>,
    pub(crate) roots: Vec<Root>,
}

impl Tree {
    /// For what most trees take: an array that grows leaves behind what it was.
    fn with_room_for(triangles: usize) -> Tree {
        /// Leaves take about six words per triangle.
        const WORDS: usize = 7;
        const TRIANGLES_PER_NODE: usize = 12;
        Tree {
            nodes: Vec::with_capacity(triangles / TRIANGLES_PER_NODE),
            leaves: Vec::with_capacity(WORDS * triangles),
            roots: Vec::new(),
        }
    }
}

/// Where a tree begins.
#[derive(Clone, Copy)]
pub(crate) struct Root {
    pub(crate) bounds: TightBox,
    pub(crate) child: Child,
    /// Entries that a traversal's stack needs.
    pub(crate) stack_need: u32,
}

/// A box by its corners, which alignment would make a third larger.
pub(crate) type TightBox = [Vec3; 2];

impl Root {
    /// Of what is below a node of the binary tree.
    pub(crate) fn new(binary: &Bvh2, node: u32, child: Child, stack_need: usize) -> Root {
        let bounds = bounds(binary, node).map(Vec3::from);
        Root { bounds, child, stack_need: stack_need as u32 }
    }
}

/// Of a part's nodes those that are placed again.
const REINSERTED: f32 = 0.3;

/// What it costs to test a leaf's triangles, in units of what a node's boxes cost.
const LEAF_COST: f32 = 1.0;

/// Builds trees over these triangles: one, whose root is a node, or as many as are left when the largest nodes are taken away until there are
/// `roots`.
pub(crate) fn build(
    triangles: &impl Triangles,
    members: &[u32],
    roots: usize,
    most_stack: usize,
) -> Tree {
    let corners = |member: u32| triangles.corners(members[member as usize]);
    let around =
        |triangle: [Corner; 3]| Aabb::from_points(&triangle.map(|corner| Vec3A::from(corner.at)));
    let boxes: Vec<Aabb> = (0..members.len() as u32).map(|m| around(corners(m))).collect();
    let make = |binary: &Bvh2| {
        let (mut tree, mut collapse) = (Tree::with_room_for(members.len()), Collapse::default());
        let Tree { nodes, leaves, .. } = &mut tree;
        collapse.plan(binary, LEAF_COST, |boxes| fits(corners, boxes));
        let mut make_leaf = |boxes: &[u32]| {
            let mut leaf = [(0, corners(boxes[0])); MOST_TRIANGLES];
            for (lane, &member) in leaf.iter_mut().zip(boxes) {
                *lane = (members[member as usize], corners(member));
            }
            Child::leaf(leaf::write(leaves, &leaf[..boxes.len()]))
        };
        tree.roots = if roots == 1 {
            let stack_need = collapse.make_root(binary, nodes, make_leaf);
            vec![Root::new(binary, 0, Child::ROOT, stack_need)]
        } else {
            let roots = collapse.cut(binary, roots).into_iter().map(|root| {
                let (child, stack_need) = collapse.make(binary, root, nodes, &mut make_leaf);
                Root::new(binary, root, child, stack_need)
            });
            roots.collect()
        };
        tree
    };
    let binary = binary_tree(members.len() as u32, move |m| boxes[m as usize], REINSERTED);
    let tree = make(&binary);
    let is_deep = tree.roots.iter().any(|root| root.stack_need as usize > most_stack);
    if is_deep { make(&halve(&boxes_of(&binary))) } else { tree }
}

/// Whether some triangles have few enough vertices for one leaf.
fn fits(corners: impl Fn(u32) -> [Corner; 3], triangles: &[u32]) -> bool {
    let mut names = [[[0; 3]; 3]; MOST_TRIANGLES];
    for (names, &triangle) in names.iter_mut().zip(triangles) {
        *names = corners(triangle).map(|corner| corner.name);
    }
    leaf::vertices(&names[..triangles.len()]) <= MOST_VERTICES
}

/// Divided from above; then the largest of the boxes, as many of a hundred, find better places. A box per leaf, which is the only one left of
/// it: see [`boxes_of`].
pub(crate) fn binary_tree(count: u32, boxes: impl Fn(u32) -> Aabb, reinserted: f32) -> Bvh2 {
    let mut binary = sah::divide(count, &boxes);
    drop(boxes);
    if !is_crowded(&binary) {
        ReinsertionOptimizer::default().run(&mut binary, reinserted, None);
    }
    binary
}

/// Whether so many boxes lie on top of each other that there are no better places for them, and looking for some takes seconds for half a
/// million.
fn is_crowded(binary: &Bvh2) -> bool {
    /// Boxes that a ray through the box around all meets. Of rooms, bushes and crowds of bodies it is a hundred.
    const MANY: f32 = 1000.0;
    let Some(root) = binary.nodes.first() else { return false };
    let leaves = binary.nodes.iter().filter(|node| node.is_leaf());
    let sum: f32 = leaves.map(|node| node.aabb().half_area()).sum();
    sum > MANY * root.aabb().half_area()
}

/// What a tree with a box per leaf was made of.
pub(crate) fn boxes_of(binary: &Bvh2) -> Vec<Aabb> {
    let mut boxes = vec![Aabb::INVALID; binary.primitive_indices.len()];
    for leaf in binary.nodes.iter().filter(|node| node.is_leaf()) {
        boxes[binary.primitive_indices[leaf.first_index as usize] as usize] = *leaf.aabb();
    }
    boxes
}

fn one_leaf(boxes: &[Aabb]) -> Bvh2 {
    let mut binary = Bvh2::zeroed(0);
    if !boxes.is_empty() {
        let around = boxes.iter().fold(Aabb::INVALID, |sum, bounds| sum.union(bounds));
        binary.nodes.push(Bvh2Node::new(around, boxes.len() as u32, 0));
        binary.primitive_indices = (0..boxes.len() as u32).collect();
    }
    binary
}

/// Halves the boxes by their centres along the longest axis: never deeper than log₂, for inputs of
/// which the usual tree is too deep for the traversal's stack.
pub(crate) fn halve(boxes: &[Aabb]) -> Bvh2 {
    let mut binary = one_leaf(boxes);
    let Bvh2 { nodes, primitive_indices, .. } = &mut binary;
    let mut work: Vec<usize> = (0..nodes.len()).collect();
    while let Some(at) = work.pop() {
        let (first, count) = (nodes[at].first_index as usize, nodes[at].prim_count as usize);
        if count == 1 {
            continue;
        }
        let members = &mut primitive_indices[first..first + count];
        let diagonal = nodes[at].aabb().max - nodes[at].aabb().min;
        let axis = (0..3).max_by(|&a, &b| diagonal[a].total_cmp(&diagonal[b])).unwrap_or(0);
        let centre =
            |&member: &u32| boxes[member as usize].min[axis] + boxes[member as usize].max[axis];
        members.select_nth_unstable_by(count / 2, |a, b| {
            centre(a).total_cmp(&centre(b)).then(a.cmp(b))
        });
        let child = |members: &[u32], first: usize| {
            let bounds =
                members.iter().fold(Aabb::INVALID, |sum, &m| sum.union(&boxes[m as usize]));
            Bvh2Node::new(bounds, members.len() as u32, first as u32)
        };
        let (left, right) = members.split_at(count / 2);
        let pair = [child(left, first), child(right, first + count / 2)];
        let next = nodes.len();
        nodes[at].make_inner(next as u32);
        work.extend([next, next + 1]);
        nodes.extend(pair);
    }
    binary
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::traverse::STACK_PER_TREE;

    fn stack_need(binary: &Bvh2) -> usize {
        let mut collapse = Collapse::default();
        collapse.plan(binary, LEAF_COST, |_| true);
        collapse.make_root(binary, &mut Vec::new(), |_| Child::leaf(0))
    }

    /// Boxes that shrink towards the origin: a tree of them is a list.
    fn shrinking(count: i32) -> Vec<Aabb> {
        (0..count)
            .map(|k| 0.8f32.powi(k))
            .map(|size| Aabb::new(Vec3A::splat(size), Vec3A::splat(1.1 * size)))
            .collect()
    }

    #[test]
    fn halving_never_needs_more_stack_than_there_is() {
        let boxes = shrinking(390);
        let binary = binary_tree(boxes.len() as u32, |k| boxes[k as usize], REINSERTED);
        let deep = stack_need(&binary);
        assert!(deep > STACK_PER_TREE, "{deep}: the fallback would never be taken");
        let kept = boxes_of(&binary);
        assert!(kept.iter().map(|b| (b.min, b.max)).eq(boxes.iter().map(|b| (b.min, b.max))));
        let halved = stack_need(&halve(&boxes));
        assert!(halved <= 7 * 9, "{halved} for 390 boxes");
    }

    #[test]
    fn all_boxes_alike_are_still_halved() {
        let boxes = vec![Aabb::new(Vec3A::ZERO, Vec3A::ONE); 1_000];
        assert!(stack_need(&halve(&boxes)) <= 7 * 10);
        let mut members = halve(&boxes).primitive_indices;
        members.sort_unstable();
        assert!(members.into_iter().eq(0..1_000));
    }
}
