//! From triangles to a wide BVH.

use frameless_scene::Mesh;
use glam::{Affine3A, Vec3, Vec3A};
use obvhs::BvhBuildParams;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::leaf_collapser;
use obvhs::bvh2::node::Bvh2Node;
use obvhs::bvh2::reinsertion::ReinsertionOptimizer;
use obvhs::ploc::PlocBuilder;

use crate::kernel::Pack;
use crate::pages::prefer_large_pages;
use crate::parts::{Of, PART, build_in_parts};
use crate::traverse::STACK_PER_TREE;
use crate::untied::Ploc;
use crate::wide::{Child, Node, collapse};

/// A mesh's bottom-level BVH: triangles copied into packs of four, in the order of the leaves.
#[derive(Clone, Debug)]
pub(crate) struct Blas {
    pub(crate) nodes: Vec<Node>,
    pub(crate) packs: Vec<Pack>,
    /// Of all triangles that can be hit; `None` if there are none.
    pub(crate) bounds: Option<(Vec3A, Vec3A)>,
}

impl Blas {
    /// The mesh's triangles at a place. Those with a vertex that is not finite, or so far away that squares overflow, are left out: the builder
    /// panics on NaN. Triangles without area stay; no ray hits them.
    pub(crate) fn new(mesh: &Mesh, place: &Affine3A) -> Blas {
        let corners = |primitive| corners_at(place, mesh, primitive);
        let (primitives, boxes): (Vec<u32>, Vec<Aabb>) = (0..mesh.triangles.len() as u32)
            .filter_map(|primitive| Some((primitive, sane_box(&corners(primitive))?)))
            .unzip();
        Blas::over(&primitives, boxes, corners)
    }

    /// Of these triangles, whose boxes are known; `corners` tells where each is.
    pub(crate) fn over(
        primitives: &[u32],
        boxes: Vec<Aabb>,
        corners: impl Fn(u32) -> [Vec3; 3],
    ) -> Blas {
        let mut blas = Blas { nodes: Vec::new(), packs: Vec::new(), bounds: union(&boxes) };
        let mut binary = binary_by_clustering(&boxes);
        // Not held beside the packs: they are the largest things in memory.
        drop(boxes);
        if blas.take(&binary, primitives, &corners) > STACK_PER_TREE {
            let around = |&primitive| Aabb::from_points(&corners(primitive).map(Vec3A::from));
            let boxes: Vec<Aabb> = primitives.iter().map(around).collect();
            binary = binary_by_median(&boxes);
            blas.take(&binary, primitives, &corners);
        }
        blas.prefer_large_pages();
        blas
    }

    fn prefer_large_pages(&self) {
        prefer_large_pages(&self.nodes);
        prefer_large_pages(&self.packs);
    }

    fn take(
        &mut self,
        binary: &Bvh2,
        primitives: &[u32],
        corners: &impl Fn(u32) -> [Vec3; 3],
    ) -> usize {
        self.packs.clear();
        let packs = &mut self.packs;
        collapse(binary, &mut self.nodes, |members| {
            let first = packs.len();
            packs.extend(members.chunks(4).map(|four| pack(primitives, four, corners)));
            Child::leaf(first, packs.len() - first)
        })
    }
}

/// A triangle's vertices.
pub(crate) fn corners(mesh: &Mesh, primitive: u32) -> [Vec3; 3] {
    mesh.triangles[primitive as usize].map(|vertex| mesh.positions[vertex as usize])
}

/// The same where the mesh stands.
pub(crate) fn corners_at(place: &Affine3A, mesh: &Mesh, primitive: u32) -> [Vec3; 3] {
    corners(mesh, primitive).map(|corner| place.transform_point3(corner))
}

/// Products of two coordinates, and of three in the builder's areas, must stay below 3.4e38.
pub(crate) const FARTHEST: f32 = 1e15;

pub(crate) fn sane_box(corners: &[Vec3; 3]) -> Option<Aabb> {
    let sane = corners.iter().all(|c| c.is_finite() && c.abs().max_element() < FARTHEST);
    sane.then(|| Aabb::from_points(&corners.map(Vec3A::from)))
}

fn union(boxes: &[Aabb]) -> Option<(Vec3A, Vec3A)> {
    boxes.iter().map(|b| (b.min, b.max)).reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)))
}

fn pack(primitives: &[u32], members: &[u32], corners: &impl Fn(u32) -> [Vec3; 3]) -> Pack {
    let mut pack = Pack { vertex: [[[0.0; 4]; 3]; 3], primitive: [0; 4] };
    for lane in 0..4 {
        let primitive = primitives[members[lane.min(members.len() - 1)] as usize];
        pack.primitive[lane] = primitive;
        for (corner, position) in corners(primitive).iter().enumerate() {
            for axis in 0..3 {
                pack.vertex[corner][axis][lane] = position[axis];
            }
        }
    }
    pack
}

/// Two packs.
const MOST_PER_LEAF: u32 = 8;

/// By clustering, of many boxes part by part.
fn binary_by_clustering(boxes: &[Aabb]) -> Bvh2 {
    if boxes.len() <= PART {
        return cluster(boxes, MOST_PER_LEAF);
    }
    build_in_parts(boxes, |boxes, of| match of {
        Of::Boxes => cluster(boxes, MOST_PER_LEAF),
        Of::Parts => cluster(boxes, 1),
    })
}

/// Parallel locally-ordered clustering with reinsertion; `obvhs`' medium preset, step by step, since its helper
/// validates the whole tree in debug builds.
pub(crate) fn cluster(boxes: &[Aabb], most_per_leaf: u32) -> Bvh2 {
    if boxes.len() as u32 <= most_per_leaf.min(4) {
        return one_leaf(boxes);
    }
    let preset = BvhBuildParams::medium_build();
    let ploc = Ploc {
        search_distance: preset.ploc_search_distance,
        sort_precision: preset.sort_precision,
        search_depth_threshold: preset.search_depth_threshold,
    };
    let mut binary = Bvh2::zeroed(boxes.len());
    ploc.build(&mut PlocBuilder::with_capacity(boxes.len()), boxes, &mut binary);
    let mut optimizer = ReinsertionOptimizer::default();
    let ratio = preset.reinsertion_batch_ratio;
    optimizer.run(&mut binary, ratio, None);
    leaf_collapser::collapse(&mut binary, most_per_leaf, preset.collapse_traversal_cost);
    optimizer.run(
        &mut binary,
        ratio * preset.post_collapse_reinsertion_batch_ratio_multiplier,
        None,
    );
    binary
}

fn one_leaf(boxes: &[Aabb]) -> Bvh2 {
    let mut binary = Bvh2::zeroed(0);
    if let Some((min, max)) = union(boxes) {
        binary.nodes.push(Bvh2Node::new(Aabb::new(min, max), boxes.len() as u32, 0));
        binary.primitive_indices = (0..boxes.len() as u32).collect();
    }
    binary
}

/// Halves the primitives by their centres along the longest axis: never deeper than log₂, for inputs on which
/// clustering grows a tree that is too deep for the traversal's stack.
pub(crate) fn binary_by_median(boxes: &[Aabb]) -> Bvh2 {
    let mut binary = one_leaf(boxes);
    let Bvh2 { nodes, primitive_indices, .. } = &mut binary;
    let mut work: Vec<usize> = (0..nodes.len()).collect();
    while let Some(at) = work.pop() {
        let (first, count) = (nodes[at].first_index as usize, nodes[at].prim_count as usize);
        if count <= 4 {
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

    fn stack_need(binary: &Bvh2) -> usize {
        collapse(binary, &mut Vec::new(), |_| Child::leaf(0, 1))
    }

    /// Boxes that shrink towards the origin: clustering makes a list of them.
    fn shrinking(count: i32) -> Vec<Aabb> {
        (0..count)
            .map(|k| 0.8f32.powi(k))
            .map(|size| Aabb::new(Vec3A::splat(size), Vec3A::splat(1.1 * size)))
            .collect()
    }

    #[test]
    fn median_splits_never_need_more_stack_than_there_is() {
        let boxes = shrinking(390);
        let clustered = stack_need(&binary_by_clustering(&boxes));
        let halved = stack_need(&binary_by_median(&boxes));
        assert!(halved <= 7 * 9, "{halved} for 390 boxes");
        // Before boxes were made unlike each other ([`Ploc`]) it was more than there is.
        assert!(clustered > 100, "{clustered}: nothing that halving would be better for");
    }

    #[test]
    fn all_boxes_alike_are_still_halved() {
        let boxes = vec![Aabb::new(Vec3A::ZERO, Vec3A::ONE); 1_000];
        assert!(stack_need(&binary_by_median(&boxes)) <= 7 * 10);
        let mut members = binary_by_median(&boxes).primitive_indices;
        members.sort_unstable();
        assert!(members.into_iter().eq(0..1_000));
    }
}
