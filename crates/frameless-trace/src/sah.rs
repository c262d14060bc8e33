//! Divides boxes from above by the surface area heuristic:
//!
//! ```text
//! C = A(left) · b(left) + A(right) · b(right)        A: half the surface of the box around; b: full leaves that are needed; the least C divides
//! ```
//!
//! Of few boxes every division of their order along an axis is tried, of many those at planes at equal distances (Wald 2007, "On fast
//! Construction of SAH-based Bounding Volume Hierarchies").

use glam::Vec3A;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::node::Bvh2Node;

use crate::leaf::MOST_TRIANGLES;

/// So few are put in order.
const FEW: usize = 32;

/// Planes per axis, and one.
const BINS: usize = 16;

/// A binary tree over so many boxes, with one per leaf.
pub(crate) fn divide(count: u32, boxes: &impl Fn(u32) -> Aabb) -> Bvh2 {
    let mut binary = Bvh2::zeroed(0);
    if count == 0 {
        return binary;
    }
    let around = |members: &[u32]| {
        members.iter().fold(Aabb::INVALID, |sum, &member| sum.union(&boxes(member)))
    };
    let mut order: Vec<u32> = (0..count).collect();
    let nodes = &mut binary.nodes;
    nodes.reserve_exact(2 * order.len() - 1);
    nodes.push(Bvh2Node::new(around(&order), count, 0));
    let mut work = vec![(0, 1)];
    while let Some((at, depth)) = work.pop() {
        binary.max_depth = binary.max_depth.max(depth);
        let (first, count) = (nodes[at].first_index as usize, nodes[at].prim_count as usize);
        if count == 1 {
            continue;
        }
        let members = &mut order[first..first + count];
        let left = split(boxes, members);
        let next = nodes.len();
        nodes[at].make_inner(next as u32);
        for (members, first) in [(&members[..left], first), (&members[left..], first + left)] {
            nodes.push(Bvh2Node::new(around(members), members.len() as u32, first as u32));
        }
        work.extend([next, next + 1].map(|child| (child, depth + 1)));
    }
    binary.primitive_indices = order;
    binary.children_are_ordered_after_parents = true;
    binary
}

/// Brings the members on one side of the best division before the others; returns how many they are: at least one, and not all.
pub(crate) fn split(boxes: &impl Fn(u32) -> Aabb, order: &mut [u32]) -> usize {
    match order.len() {
        ..=FEW => sweep(boxes, order),
        _ => split_by_planes(boxes, order),
    }
}

/// Of at least two boxes.
fn sweep(boxes: &impl Fn(u32) -> Aabb, order: &mut [u32]) -> usize {
    let count = order.len();
    let centre = |member: u32| {
        let around = boxes(member);
        around.min + around.max
    };
    let mut best = (f32::INFINITY, 0, count / 2);
    for axis in 0..3 {
        sort(order, axis, centre);
        let mut right = [0.0; FEW];
        let mut sum = Aabb::INVALID;
        for k in (1..count).rev() {
            sum = sum.union(&boxes(order[k]));
            right[k] = sum.half_area() * leaves(count - k);
        }
        sum = Aabb::INVALID;
        for k in 1..count {
            sum = sum.union(&boxes(order[k - 1]));
            let cost = sum.half_area() * leaves(k) + right[k];
            if cost < best.0 {
                best = (cost, axis, k);
            }
        }
    }
    let (_, axis, left) = best;
    sort(order, axis, centre);
    left
}

/// How many leaves hold so many boxes.
fn leaves(count: usize) -> f32 {
    count.div_ceil(MOST_TRIANGLES) as f32
}

fn sort(order: &mut [u32], axis: usize, centre: impl Fn(u32) -> Vec3A) {
    order.sort_unstable_by(|&a, &b| centre(a)[axis].total_cmp(&centre(b)[axis]).then(a.cmp(&b)));
}

/// Half-open bins along one axis.
#[derive(Clone, Copy)]
struct Bin {
    bounds: Aabb,
    count: usize,
}

const NO_BIN: Bin = Bin { bounds: Aabb::INVALID, count: 0 };

fn split_by_planes(boxes: &impl Fn(u32) -> Aabb, order: &mut [u32]) -> usize {
    // Twice the centres.
    let centre = |member: u32| {
        let around = boxes(member);
        around.min + around.max
    };
    let centres =
        order.iter().fold(Aabb::INVALID, |mut around, &member| *around.extend(centre(member)));
    let width = centres.max - centres.min;
    let scale = Vec3A::splat(BINS as f32 * (1.0 - f32::EPSILON))
        / width.max(Vec3A::splat(f32::MIN_POSITIVE));
    let bin =
        |member: u32| ((centre(member) - centres.min) * scale).min(Vec3A::splat(BINS as f32 - 1.0));
    let mut bins = [[NO_BIN; BINS]; 3];
    for &member in &*order {
        let bounds = boxes(member);
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
        let work = |side: Bin| side.bounds.half_area() * leaves(side.count);
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

    #[test]
    fn a_tree_has_each_box_in_a_leaf_of_its_own() {
        let mut rng = Rng::new(5);
        let mut point = || Vec3A::from_array(std::array::from_fn(|_| rng.unit_f32()));
        let scattered = (0..500).map(|_| Aabb::from_points(&[point(), point()])).collect();
        let alike = vec![Aabb::new(Vec3A::ZERO, Vec3A::ONE); 500];
        for boxes in [scattered, alike] {
            let binary = divide(boxes.len() as u32, &|k| boxes[k as usize]);
            assert_eq!(binary.nodes.len(), 2 * boxes.len() - 1);
            let leaves = binary.nodes.iter().filter(|node| node.is_leaf());
            let mut found: Vec<u32> = leaves
                .map(|leaf| {
                    let found = binary.primitive_indices[leaf.first_index as usize];
                    assert_eq!((leaf.prim_count, leaf.aabb()), (1, &boxes[found as usize]));
                    found
                })
                .collect();
            found.sort_unstable();
            assert!(found.into_iter().eq(0..boxes.len() as u32));
        }
    }

    /// Two crowds far from each other, one of them twice as large: few, and many.
    #[test]
    fn the_division_lies_where_nothing_is() {
        for count in [FEW as u32 - 2, 3000] {
            let place = |k: u32| if k.is_multiple_of(3) { 100.0 * Vec3A::X } else { Vec3A::ZERO };
            let boxes: Vec<Aabb> = (0..count)
                .map(|k| (place(k), Vec3A::splat((k % 100) as f32 / 100.0)))
                .map(|(place, jitter)| Aabb::new(place + jitter, place + jitter + 1.0))
                .collect();
            let mut order: Vec<u32> = (0..count).collect();
            let at = split(&|member| boxes[member as usize], &mut order);
            assert_eq!(at as u32, 2 * count / 3);
            assert!(order[..at].iter().all(|member| !member.is_multiple_of(3)));
        }
    }
}
