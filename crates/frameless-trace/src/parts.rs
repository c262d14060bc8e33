//! Many boxes, divided into parts over which trees are built by themselves: on all cores, and with the builder's memory for a few parts at
//! a time instead of for everything (it takes about 300 bytes per box, several times as much as a triangle).
//!
//! Boxes are divided from above by the surface area heuristic, as far as sixteen planes per axis tell it (Wald 2007, "On fast construction
//! of SAH-based bounding volume hierarchies"):
//!
//! ```text
//! C(k) = A(left of plane k) · n(left) + A(right) · n(right)        A: half the surface of the box around; the plane of least C divides
//! ```
//!
//! The parts depend on the boxes alone, not on how many threads there are.

use std::ops::Range;

use glam::Vec3A;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::node::Bvh2Node;
use obvhs::bvh2::reinsertion::ReinsertionOptimizer;
use rayon::prelude::*;

/// Boxes of a part at most. Fewer: more of the tree is divided by planes instead of clustered; more: memory, and cores with nothing to do.
pub(crate) const PART: usize = 1 << 13;

/// Of all nodes, those that are placed again once the parts are one tree; and how often, since of two that get into each other's way one stays.
const LARGE_ONES: f32 = 0.05;
const ROUNDS: u32 = 4;

/// Planes per axis, and one.
const BINS: usize = 16;

/// What a tree is over.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Of {
    /// The boxes of a part.
    Boxes,
    /// The parts, each of which has to have a leaf of its own.
    Parts,
}

/// Builds one tree over all boxes: those over the parts, and the one over these, by `build`.
pub(crate) fn build_in_parts(boxes: &[Aabb], build: impl Fn(&[Aabb], Of) -> Bvh2 + Sync) -> Bvh2 {
    let mut order: Vec<u32> = (0..boxes.len() as u32).collect();
    let parts = divide(boxes, &mut order);
    let built: Vec<Bvh2> = parts
        .into_par_iter()
        .map(|part| {
            let members = &order[part];
            let boxes: Vec<Aabb> = members.iter().map(|&member| boxes[member as usize]).collect();
            let mut tree = build(&boxes, Of::Boxes);
            let indices = tree.primitive_indices.iter().map(|&index| members[index as usize]);
            tree.primitive_indices = indices.collect();
            // Nobody asks any longer.
            tree.parents = Vec::new();
            tree
        })
        .collect();
    drop(order);
    let roots: Vec<Aabb> = built.iter().map(|part| *part.nodes[0].aabb()).collect();
    let mut all = join(&build(&roots, Of::Parts), built);
    place_large_ones(&mut all);
    all
}

/// Lets the largest boxes find a better place in the whole tree: a wall that lies in one part makes it as large as the room.
fn place_large_ones(all: &mut Bvh2) {
    let count = ((LARGE_ONES * all.nodes.len() as f32) as usize).max(1);
    let area = |&node: &u32| all.nodes[node as usize].aabb().half_area();
    let mut nodes: Vec<u32> = (1..all.nodes.len() as u32).collect();
    nodes.select_nth_unstable_by(count, |a, b| area(b).total_cmp(&area(a)).then(a.cmp(b)));
    nodes.truncate(count);
    ReinsertionOptimizer::default().run_with_candidates(all, &nodes, ROUNDS);
    all.parents = Vec::new();
}

/// Puts the parts in the place of the leaves of the tree over them.
fn join(top: &Bvh2, parts: Vec<Bvh2>) -> Bvh2 {
    let mut all = Bvh2::zeroed(0);
    let in_parts: usize = parts.iter().map(|part| part.nodes.len()).sum();
    all.nodes.reserve_exact(top.nodes.len() + in_parts);
    all.nodes.extend_from_slice(&top.nodes);
    all.primitive_indices
        .reserve_exact(parts.iter().map(|part| part.primitive_indices.len()).sum());
    let mut leaf_of = vec![0; parts.len()];
    for (node, index) in top.nodes.iter().zip(0usize..).filter(|(node, _)| node.is_leaf()) {
        let first = node.first_index as usize;
        assert_eq!(node.prim_count, 1, "the tree over the parts has a leaf for each");
        leaf_of[top.primitive_indices[first] as usize] = index;
    }
    for (part, leaf) in parts.into_iter().zip(leaf_of) {
        // Of a part's nodes all but the root move, in pairs, behind those that are there.
        let (nodes, indices) = (all.nodes.len() as u32, all.primitive_indices.len() as u32);
        let mut placed = part.nodes.iter().map(|node| {
            let by = if node.is_leaf() { indices } else { nodes.wrapping_sub(1) };
            Bvh2Node { first_index: node.first_index.wrapping_add(by), ..*node }
        });
        all.nodes[leaf] = placed.next().expect("a part has a root");
        all.nodes.extend(placed);
        all.primitive_indices.extend_from_slice(&part.primitive_indices);
    }
    all
}

/// Orders the boxes so that each part is a range of them.
fn divide(boxes: &[Aabb], order: &mut [u32]) -> Vec<Range<usize>> {
    fn halve(boxes: &[Aabb], order: &mut [u32], first: usize) -> Vec<Range<usize>> {
        if order.len() <= PART {
            return std::iter::once(first..first + order.len()).collect();
        }
        let at = split(boxes, order);
        let (left, right) = order.split_at_mut(at);
        let (mut parts, more) =
            rayon::join(|| halve(boxes, left, first), || halve(boxes, right, first + at));
        parts.extend(more);
        parts
    }
    halve(boxes, order, 0)
}

/// Half-open bins along one axis.
#[derive(Clone, Copy)]
struct Bin {
    bounds: Aabb,
    count: usize,
}

const NO_BIN: Bin = Bin { bounds: Aabb::INVALID, count: 0 };

/// Brings the members on one side of the best plane before the others; returns how many they are: at least one, and not all.
fn split(boxes: &[Aabb], order: &mut [u32]) -> usize {
    // Twice the centres.
    let centre = |member: u32| boxes[member as usize].min + boxes[member as usize].max;
    let centres =
        order.iter().fold(Aabb::INVALID, |mut around, &member| *around.extend(centre(member)));
    let width = centres.max - centres.min;
    let scale = Vec3A::splat(BINS as f32 * (1.0 - f32::EPSILON))
        / width.max(Vec3A::splat(f32::MIN_POSITIVE));
    let bin =
        |member: u32| ((centre(member) - centres.min) * scale).min(Vec3A::splat(BINS as f32 - 1.0));
    let mut bins = [[NO_BIN; BINS]; 3];
    for &member in &*order {
        let bounds = boxes[member as usize];
        for (bins, at) in bins.iter_mut().zip(bin(member).to_array()) {
            let bin = &mut bins[at as usize];
            bin.bounds = bin.bounds.union(&bounds);
            bin.count += 1;
        }
    }
    let best = (0..3).filter_map(|axis| Some((axis, best_plane(&bins[axis])?)));
    let best = best.min_by(|(_, a), (_, b)| a.cost.total_cmp(&b.cost));
    let Some((axis, Plane { bin: plane, .. })) = best else {
        // All in one place: it does not matter.
        return order.len() / 2;
    };
    let is_left = |&member: &u32| (bin(member)[axis] as usize) < plane;
    partition(order, is_left)
}

/// The plane before a bin, and what it costs.
struct Plane {
    bin: usize,
    cost: f32,
}

/// `None` if all are in one bin.
fn best_plane(bins: &[Bin; BINS]) -> Option<Plane> {
    let mut right = [NO_BIN; BINS];
    let mut sum = NO_BIN;
    for (right, bin) in right.iter_mut().zip(bins).rev() {
        sum = both(sum, *bin);
        *right = sum;
    }
    let mut left = NO_BIN;
    let mut best: Option<Plane> = None;
    for bin in 1..BINS {
        left = both(left, bins[bin - 1]);
        if left.count == 0 || right[bin].count == 0 {
            continue;
        }
        let work = |side: Bin| side.bounds.half_area() * side.count as f32;
        let cost = work(left) + work(right[bin]);
        if best.as_ref().is_none_or(|best| cost < best.cost) {
            best = Some(Plane { bin, cost });
        }
    }
    best
}

fn both(a: Bin, b: Bin) -> Bin {
    Bin { bounds: a.bounds.union(&b.bounds), count: a.count + b.count }
}

/// Those that are left first, in no particular but always the same order.
fn partition(order: &mut [u32], is_left: impl Fn(&u32) -> bool) -> usize {
    let mut left = 0;
    for i in 0..order.len() {
        if is_left(&order[i]) {
            order.swap(left, i);
            left += 1;
        }
    }
    left
}

#[cfg(test)]
mod tests {
    use frameless::Rng;

    use super::*;
    use crate::build::{binary_by_median, cluster};

    fn scattered(count: usize) -> Vec<Aabb> {
        let mut rng = Rng::new(7);
        let mut point = || Vec3A::from_array(std::array::from_fn(|_| rng.unit_f32()));
        (0..count).map(|_| Aabb::from_points(&[point(), point()])).collect()
    }

    #[test]
    fn parts_are_small_and_hold_every_box_once() {
        for boxes in [scattered(5 * PART), vec![Aabb::new(Vec3A::ZERO, Vec3A::ONE); 3 * PART]] {
            let mut order: Vec<u32> = (0..boxes.len() as u32).collect();
            let parts = divide(&boxes, &mut order);
            assert!(parts.iter().all(|part| (1..=PART).contains(&part.len())));
            assert!(parts.windows(2).all(|pair| pair[0].end == pair[1].start));
            assert_eq!((parts[0].start, parts[parts.len() - 1].end), (0, boxes.len()));
            order.sort_unstable();
            assert!(order.into_iter().eq(0..boxes.len() as u32));
        }
    }

    /// Two crowds far from each other, one of them twice as large.
    #[test]
    fn the_plane_lies_where_nothing_is() {
        let place = |k: u32| if k.is_multiple_of(3) { Vec3A::X * 100.0 } else { Vec3A::ZERO };
        let boxes: Vec<Aabb> = (0..3000)
            .map(|k| (place(k), Vec3A::splat((k % 100) as f32 / 100.0)))
            .map(|(place, jitter)| Aabb::new(place + jitter, place + jitter + 1.0))
            .collect();
        let mut order: Vec<u32> = (0..3000).collect();
        let at = split(&boxes, &mut order);
        assert_eq!(at, 2000);
        assert!(order[..at].iter().all(|member| !member.is_multiple_of(3)));
    }

    #[test]
    fn the_tree_of_parts_holds_every_box_where_it_is() {
        let boxes = scattered(3 * PART + 5);
        let all = build_in_parts(&boxes, |boxes, of| match of {
            Of::Boxes => binary_by_median(boxes),
            Of::Parts => cluster(boxes, 1),
        });
        let mut seen = vec![0; boxes.len()];
        let mut work = vec![0];
        while let Some(at) = work.pop() {
            let node = all.nodes[at];
            let first = node.first_index as usize;
            let around = |inside: &Aabb| {
                let [low, high] = [node.aabb().min, node.aabb().max];
                inside.min.cmpge(low).all() && inside.max.cmple(high).all()
            };
            if node.is_leaf() {
                for &member in &all.primitive_indices[first..first + node.prim_count as usize] {
                    assert!(around(&boxes[member as usize]));
                    seen[member as usize] += 1;
                }
            } else {
                assert!(around(all.nodes[first].aabb()) && around(all.nodes[first + 1].aabb()));
                work.extend([first, first + 1]);
            }
        }
        assert!(seen.iter().all(|&count| count == 1));
    }
}
