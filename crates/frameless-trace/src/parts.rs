//! Many triangles, divided into parts over which trees are built by themselves: on all cores, and with the builder's memory for a few parts
//! at a time instead of for everything (it takes about 200 bytes per triangle, six times as much as is left of it).
//!
//! Triangles are divided from above by the surface area heuristic (see [`crate::sah`]).
//!
//! Of each part's tree the largest nodes are taken away, and one tree is built over what is left of all of them: a wall that lies in one part
//! would make it as large as the room. The parts depend on the triangles alone, not on how many threads there are.

use std::ops::Range;

use glam::Vec3;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use rayon::prelude::*;

use crate::build::{self, Root, TightBox, Tree, Triangles, binary_tree, boxes_of, halve, sane_box};
use crate::collapse::Collapse;
use crate::leaf::LONGEST;
use crate::sah::split;
use crate::traverse::STACK_PER_TREE;
use crate::wide::{Child, Node};

/// Triangles of a part at most. Fewer: boxes find better places among fewer; more: memory, and cores with nothing to do.
const PART: usize = 1 << 13;

/// So many trees find their places among each other, if there are enough triangles for them. More: memory, as the tree over all of them is
/// built when everything else is there.
const ROOTS: usize = 1 << 14;

/// For so many triangles there is one of these trees at least, and at most. Fewer: rays visit less of the tree, which takes longer to build.
const PER_ROOT: [usize; 2] = [16, 64];

/// Of the trees that find their place those that do so again.
const REINSERTED: f32 = 1.0;

/// Of the stack's entries those that a part may need. Halving 2¹³ triangles needs 7 · 13 at most.
const STACK_PER_PART: usize = 96;

/// Of a triangle that no tree may hold.
const NOWHERE: TightBox = [Vec3::INFINITY; 2];

/// Builds a tree: no node and no root if there are no triangles that can be hit, else one root.
pub(crate) fn build(triangles: &impl Triangles) -> Tree {
    let boxes = boxes(triangles);
    let mut order: Vec<u32> = (0..triangles.count()).collect();
    order.retain(|&triangle| boxes[triangle as usize] != NOWHERE);
    if order.is_empty() {
        return Tree::default();
    }
    if order.len() <= PART {
        return build::build(triangles, &order, 1, STACK_PER_TREE);
    }
    let mut parts = divide(&boxes, &mut order);
    // They are made again part by part: there is no room for all of them beside the tree.
    drop(boxes);
    let mut all = Tree::with_room_for_any(order.len());
    let per_root = (order.len() / ROOTS).clamp(PER_ROOT[0], PER_ROOT[1]);
    // The last ones first: as the tree grows, what is left of the order shrinks.
    while !parts.is_empty() {
        let some = parts.split_off(parts.len().saturating_sub(2 * rayon::current_num_threads()));
        let build = |part: &Range<usize>| {
            let roots = (part.len() / per_root).max(2);
            build::build(triangles, &order[part.clone()], roots, STACK_PER_PART)
        };
        let built: Vec<Tree> = some.par_iter().map(build).collect();
        order.truncate(some[0].start);
        order.shrink_to_fit();
        built.into_iter().rev().for_each(|part| all.append(part));
    }
    all.join();
    all
}

fn boxes(triangles: &impl Triangles) -> Vec<TightBox> {
    let all = (0..triangles.count()).into_par_iter();
    all.map(|triangle| sane_box(&triangles.corners(triangle)).unwrap_or(NOWHERE)).collect()
}

impl Tree {
    /// Memory that is not used is given back when the tree is done; until then it is none of the machine's.
    fn with_room_for_any(triangles: usize) -> Tree {
        /// A leaf with one triangle. All others take less for each.
        const WORDS: usize = 2 + 1 + 9;
        /// There are 19 or 20.
        const TRIANGLES_PER_NODE: usize = 12;
        Tree {
            nodes: Vec::with_capacity(triangles / TRIANGLES_PER_NODE),
            leaves: Vec::with_capacity(WORDS * triangles + LONGEST),
            roots: Vec::new(),
        }
    }

    fn append(&mut self, part: Tree) {
        let (nodes, leaves) = (self.nodes.len(), self.leaves.len());
        self.nodes.extend(part.nodes.into_iter().map(|node| node.moved(nodes, leaves)));
        self.leaves.extend(part.leaves);
        let roots = part.roots.into_iter();
        self.roots
            .extend(roots.map(|root| Root { child: root.child.moved(nodes, leaves), ..root }));
    }

    /// Builds the tree over the trees, in front of them.
    fn join(&mut self) {
        // Memory is never as scarce as here: what is not wanted any more goes at once.
        let roots = std::mem::take(&mut self.roots);
        let most_below = roots.iter().map(|root| root.stack_need).max().unwrap_or(0) as usize;
        let children: Vec<Child> = roots.iter().map(|root| root.child).collect();
        let around = move |k: u32| aabb(&roots[k as usize].bounds);
        let mut binary = binary_tree(children.len() as u32, around, REINSERTED);
        let (mut collapse, end) = (Collapse::default(), self.nodes.len());
        let mut make = |binary: &Bvh2, nodes: &mut Vec<Node>| {
            collapse.plan(binary, 1.0, |_| false);
            let below = |root: &[u32]| children[root[0] as usize];
            most_below + collapse.make_root(binary, nodes, below)
        };
        let mut stack_need = make(&binary, &mut self.nodes);
        if stack_need > STACK_PER_TREE {
            self.nodes.truncate(end);
            binary = halve(&boxes_of(&binary));
            stack_need = make(&binary, &mut self.nodes);
        }
        self.roots = vec![Root::new(&binary, 0, Child::ROOT, stack_need)];
        drop((collapse, children, binary));
        self.bring_to_front(end);
    }

    /// Exchanges the nodes up to `middle` and those behind, whose children the former are.
    fn bring_to_front(&mut self, middle: usize) {
        let front = self.nodes.len() - middle;
        for child in self.nodes.iter_mut().flat_map(|node| &mut node.child) {
            if *child != Node::UNUSED && !child.is_leaf() {
                let node = child.node();
                *child = Child::inner(if node < middle { node + front } else { node - middle });
            }
        }
        self.nodes.rotate_right(front);
    }
}

fn aabb(&[low, high]: &TightBox) -> Aabb {
    Aabb::new(low.into(), high.into())
}

/// Orders the triangles so that each part is a range of them.
fn divide(boxes: &[TightBox], order: &mut [u32]) -> Vec<Range<usize>> {
    fn parts(boxes: &[TightBox], order: &mut [u32], first: usize) -> Vec<Range<usize>> {
        if order.len() <= PART {
            return std::iter::once(first..first + order.len()).collect();
        }
        let at = split(&|member| aabb(&boxes[member as usize]), order);
        let (left, right) = order.split_at_mut(at);
        let (mut all, more) =
            rayon::join(|| parts(boxes, left, first), || parts(boxes, right, first + at));
        all.extend(more);
        all
    }
    parts(boxes, order, 0)
}

#[cfg(test)]
mod tests {
    use std::time::Instant;

    use frameless::Rng;
    use glam::Vec3A;

    use super::*;
    use crate::leaf::{Corner, Leaf};

    /// Triangles by their corners.
    struct Loose(Vec<[Vec3; 3]>);

    impl Triangles for Loose {
        fn count(&self) -> u32 {
            self.0.len() as u32
        }

        fn corners(&self, triangle: u32) -> [Corner; 3] {
            self.0[triangle as usize].map(|at| Corner { at, name: at.to_array().map(f32::to_bits) })
        }
    }

    fn scattered(count: usize) -> Loose {
        let mut rng = Rng::new(7);
        let mut point = || Vec3::from_array(std::array::from_fn(|_| rng.unit_f32()));
        Loose((0..count).map(|_| [point(), point(), point()]).collect())
    }

    #[test]
    fn parts_are_small_and_hold_every_triangle_once() {
        let alike = Loose(vec![[Vec3::ZERO, Vec3::X, Vec3::Y]; 3 * PART]);
        for triangles in [scattered(5 * PART), alike] {
            let boxes = boxes(&triangles);
            let mut order: Vec<u32> = (0..boxes.len() as u32).collect();
            let parts = divide(&boxes, &mut order);
            assert!(parts.iter().all(|part| (1..=PART).contains(&part.len())));
            assert!(parts.windows(2).all(|pair| pair[0].end == pair[1].start));
            assert_eq!((parts[0].start, parts[parts.len() - 1].end), (0, boxes.len()));
            order.sort_unstable();
            assert!(order.into_iter().eq(0..boxes.len() as u32));
        }
    }

    /// Trees over the same in one place, or at equal distances, are made as fast as any.
    #[test]
    fn triangles_that_are_alike_are_divided_in_time() {
        const COUNT: u32 = 100_000;
        let flat = [Vec3::ZERO, Vec3::X, Vec3::Y];
        let spread = [Vec3::ZERO, Vec3::X, Vec3::ONE];
        let far = Vec3::splat(-1e14);
        for (what, corners, step) in [
            ("one flat triangle", flat, Vec3::ZERO),
            ("one triangle", spread, Vec3::ZERO),
            ("a point at the origin", [Vec3::ZERO; 3], Vec3::ZERO),
            ("a point far away", [far; 3], Vec3::ZERO),
            ("something tiny", spread.map(|corner| 1e-25 * corner), Vec3::ZERO),
            ("a row", flat, Vec3::X),
            ("a row of points", [Vec3::ZERO; 3], Vec3::X),
            ("a dense row", spread, 0.0625 * Vec3::X),
            ("a denormal row", [Vec3::ZERO; 3], 1e-42 * Vec3::X),
        ] {
            let place = |k: u32| corners.map(|corner| corner + k as f32 * step);
            let triangles = Loose((0..COUNT).map(place).collect());
            let begin = Instant::now();
            let tree = build(&triangles);
            let secs = begin.elapsed().as_secs_f64();
            assert!(secs < 10.0, "{what}: {secs:.1} s");
            assert!(tree.roots[0].stack_need as usize <= STACK_PER_TREE, "{what}");
        }
    }

    /// One part, and several.
    #[test]
    fn the_tree_holds_every_triangle_where_it_is() {
        for count in [1, 3, 300, 3 * PART + 5] {
            let triangles = scattered(count);
            let Tree { nodes, mut leaves, roots } = build(&triangles);
            leaves.extend([0; LONGEST]);
            let mut seen = vec![0; count];
            let mut work = vec![(roots[0].child, roots[0].bounds.map(Vec3A::from))];
            while let Some((child, [low, high])) = work.pop() {
                if child.is_leaf() {
                    let leaf = Leaf::at(&leaves, child.place());
                    for lane in 0..leaf.triangles() {
                        let triangle = leaf.triangle(lane);
                        seen[triangle as usize] += 1;
                        for k in 0..3 {
                            let corner = Vec3A::from(leaf.corner(lane, k));
                            assert_eq!(corner, triangles.0[triangle as usize][k].into());
                            assert!(corner.cmpge(low).all() && corner.cmple(high).all());
                        }
                    }
                    continue;
                }
                let node = &nodes[child.node()];
                for slot in (0..8).filter(|&slot| node.child[slot] != Node::UNUSED) {
                    let corner = |side: usize| {
                        let along = |axis: usize| node.plane(2 * axis + side, slot);
                        Vec3A::from_array([0, 1, 2].map(along))
                    };
                    work.push((node.child[slot], [corner(0), corner(1)]));
                }
            }
            assert!(seen.iter().all(|&count| count == 1));
        }
    }
}
