//! From a binary tree to the 8-wide one over the same boxes that costs a ray least.
//!
//! With A half the surface of a binary node's box, which is the probability of a visit, c a leaf's cost in units of an inner node's, and
//! C(n, i) the least cost of what is below n as at most i children of one wide node (Ylitie, Karras & Laine 2017, "Efficient Incoherent Ray
//! Traversal on GPUs Through Compressed Wide BVHs", §3.1):
//!
//! ```text
//! C(n, 1) = min( A(n) c  if n can be a leaf,   A(n) + D(n, 8) )        D(n, j) = min over 0 < k < j of C(left, k) + C(right, j − k)
//! C(n, i) = min( C(n, i − 1), D(n, i) )                                1 < i < 8
//! ```
//!
//! Differs from the paper: a leaf costs the same however full it is, since its triangles are tested at once.

use obvhs::bvh2::Bvh2;

use crate::leaf::MOST_TRIANGLES;
use crate::wide::{Bounds, Child, NOTHING, Node};

/// Children of a wide node.
const WIDTH: usize = 8;

/// What becomes of a binary node. The costs that say so are wanted by its parent only, and there is no room for those of all.
///
/// Three bits per number of children i from 2 to 8, lowest first: the cheapest k of D(n, i), or 0 where C(n, i − 1) costs no more. Bit 31: it is
/// a leaf.
#[derive(Clone, Copy, Default)]
struct Plan(u32);

impl Plan {
    const LEAF: Plan = Plan(1 << 31);

    fn is_leaf(self) -> bool {
        self.0 & Plan::LEAF.0 != 0
    }

    /// How many of so many children are the left one's.
    fn left_of(self, children: usize) -> usize {
        (self.0 >> (3 * (children - 2)) & 7) as usize
    }

    fn set_left_of(&mut self, children: usize, left: usize) {
        self.0 |= (left as u32) << (3 * (children - 2));
    }
}

/// What a binary node costs.
#[derive(Clone, Copy)]
struct Cost {
    /// C(n, 1) to C(n, 7).
    least: [f32; WIDTH - 1],
    /// Boxes below; one more than a leaf may have stands for all larger numbers.
    count: u8,
}

const MANY: u8 = MOST_TRIANGLES as u8 + 1;

/// Plans what the wide tree is and makes it, in memory that is used again.
#[derive(Default)]
pub(crate) struct Collapse {
    plans: Vec<Plan>,
    /// Of nodes whose parent is still to be planned.
    costs: Vec<Cost>,
    /// Nodes that are still to be planned, and whether what is below them is.
    unplanned: Vec<(u32, bool)>,
    /// What is still to be made: a binary node, the wide node it becomes, entries on the stack when a traversal comes here.
    work: Vec<(u32, u32, usize)>,
}

/// The binary nodes that are a wide node's children.
#[derive(Default)]
struct Members {
    nodes: [u32; WIDTH],
    count: usize,
}

impl Members {
    fn as_slice(&self) -> &[u32] {
        &self.nodes[..self.count]
    }
}

/// What a leaf is over.
#[derive(Default)]
struct Boxes {
    indices: [u32; MOST_TRIANGLES],
    count: usize,
}

impl Collapse {
    /// Finds the wide tree of least cost. `fits`: whether these boxes, two to four of them, may be one leaf.
    ///
    /// # Panics
    /// If there is no tree, or a leaf of the binary tree has not just one box.
    pub(crate) fn plan(&mut self, binary: &Bvh2, leaf_cost: f32, fits: impl Fn(&[u32]) -> bool) {
        self.plans.clear();
        self.plans.resize(binary.nodes.len(), Plan::default());
        // Children before their parent, the left one first: what they cost lies on top then.
        let Collapse { plans, costs, unplanned, .. } = self;
        unplanned.push((0, false));
        while let Some((node, knows_children)) = unplanned.pop() {
            let source = &binary.nodes[node as usize];
            let as_leaf = leaf_cost * source.aabb().half_area();
            if source.is_leaf() {
                assert_eq!(source.prim_count, 1, "boxes of a binary leaf");
                plans[node as usize] = Plan::LEAF;
                costs.push(Cost { least: [as_leaf; WIDTH - 1], count: 1 });
            } else if knows_children {
                let (right, left) = (costs.pop(), costs.pop());
                let below = left.zip(right).expect("the costs of both children");
                let can_be_leaf = || {
                    let boxes = boxes_below(binary, node);
                    fits(&boxes.indices[..boxes.count])
                };
                let area = source.aabb().half_area();
                let (plan, cost) = weigh(below, area, as_leaf, can_be_leaf);
                plans[node as usize] = plan;
                costs.push(cost);
            } else {
                let left = source.first_index;
                unplanned.extend([(node, true), (left + 1, false), (left, false)]);
            }
        }
        costs.clear();
    }

    /// The roots of the trees that are left when the largest nodes are taken away until there are `count`, or leaves alone.
    pub(crate) fn cut(&self, binary: &Bvh2, count: usize) -> Vec<u32> {
        let mut roots = vec![0];
        let area = |node: u32| binary.nodes[node as usize].aabb().half_area();
        while roots.len() < count {
            let inner = (0..roots.len()).filter(|&k| !self.plans[roots[k] as usize].is_leaf());
            let largest = inner.max_by(|&a, &b| area(roots[a]).total_cmp(&area(roots[b])));
            let Some(largest) = largest else { break };
            let root = roots.swap_remove(largest);
            roots.extend_from_slice(self.members(binary, root).as_slice());
        }
        roots
    }

    /// Appends the wide tree over everything below a binary node to `nodes`, if it needs any. `leaf` is told which boxes are to be in a leaf
    /// and says where it is. Returns where the tree is, and how many entries a traversal's stack can need in it.
    pub(crate) fn make(
        &mut self,
        binary: &Bvh2,
        root: u32,
        nodes: &mut Vec<Node>,
        mut leaf: impl FnMut(&[u32]) -> Child,
    ) -> (Child, usize) {
        let mut make_leaf = |node: u32| {
            let boxes = boxes_below(binary, node);
            leaf(&boxes.indices[..boxes.count])
        };
        if self.plans[root as usize].is_leaf() {
            return (make_leaf(root), 0);
        }
        let (first, mut stack_need) = (nodes.len(), 0);
        nodes.push(Node::EMPTY);
        let mut work = std::mem::take(&mut self.work);
        work.push((root, first as u32, 0));
        while let Some((from, to, waiting)) = work.pop() {
            let members = self.members(binary, from);
            let waiting = waiting + members.count - 1;
            stack_need = stack_need.max(waiting);
            let mut children = [(NOTHING, Node::UNUSED); WIDTH];
            for (place, &member) in children.iter_mut().zip(members.as_slice()) {
                let child = if self.plans[member as usize].is_leaf() {
                    make_leaf(member)
                } else {
                    nodes.push(Node::EMPTY);
                    work.push((member, nodes.len() as u32 - 1, waiting));
                    Child::inner(nodes.len() - 1)
                };
                *place = (bounds(binary, member), child);
            }
            nodes[to as usize] = Node::new(&children[..members.count]);
        }
        self.work = work;
        (Child::inner(first), stack_need)
    }

    /// The same with the root a wide node in any case.
    pub(crate) fn make_root(
        &mut self,
        binary: &Bvh2,
        nodes: &mut Vec<Node>,
        mut leaf: impl FnMut(&[u32]) -> Child,
    ) -> usize {
        if self.plans[0].is_leaf() {
            let boxes = boxes_below(binary, 0);
            let child = leaf(&boxes.indices[..boxes.count]);
            nodes.push(Node::new(&[(bounds(binary, 0), child)]));
            return 0;
        }
        self.make(binary, 0, nodes, leaf).1
    }

    /// The children of the wide node that a binary node becomes.
    fn members(&self, binary: &Bvh2, node: u32) -> Members {
        let mut members = Members::default();
        // Binary nodes, and as how many children at most.
        let mut work = [(0u32, 0usize); WIDTH];
        let mut waiting = 1;
        work[0] = (node, WIDTH);
        while waiting > 0 {
            waiting -= 1;
            let (node, mut children) = work[waiting];
            let plan = self.plans[node as usize];
            if children < WIDTH {
                while children > 1 && plan.left_of(children) == 0 {
                    children -= 1;
                }
                if children == 1 {
                    members.nodes[members.count] = node;
                    members.count += 1;
                    continue;
                }
            }
            let left = binary.nodes[node as usize].first_index;
            let k = plan.left_of(children);
            work[waiting] = (left + 1, children - k);
            work[waiting + 1] = (left, k);
            waiting += 2;
        }
        members
    }
}

/// What becomes of an inner node whose children cost that, and what it costs.
fn weigh(
    (left, right): (Cost, Cost),
    area: f32,
    as_leaf: f32,
    can_be_leaf: impl Fn() -> bool,
) -> (Plan, Cost) {
    // D(n, i), and its k.
    let divided = |children: usize| {
        let ways = (1..children).filter(|&k| k < WIDTH && children - k < WIDTH);
        let ways = ways.map(|k| (left.least[k - 1] + right.least[children - k - 1], k));
        ways.min_by(|a, b| a.0.total_cmp(&b.0)).expect("two children at least")
    };
    let (mut plan, count) = (Plan::default(), (left.count + right.count).min(MANY));
    let (whole, k) = divided(WIDTH);
    plan.set_left_of(WIDTH, k);
    let mut least = [area + whole; WIDTH - 1];
    if count < MANY && as_leaf <= least[0] && can_be_leaf() {
        plan.0 |= Plan::LEAF.0;
        least[0] = as_leaf;
    }
    for children in 2..WIDTH {
        let (cost, k) = divided(children);
        least[children - 1] = least[children - 2].min(cost);
        if least[children - 2] > least[children - 1] {
            plan.set_left_of(children, k);
        }
    }
    (plan, Cost { least, count })
}

pub(crate) fn bounds(binary: &Bvh2, node: u32) -> Bounds {
    let around = binary.nodes[node as usize].aabb();
    [around.min, around.max]
}

/// The boxes below a node that has at most four.
fn boxes_below(binary: &Bvh2, node: u32) -> Boxes {
    let mut boxes = Boxes::default();
    let mut work = [0u32; MOST_TRIANGLES];
    let mut waiting = 1;
    work[0] = node;
    while waiting > 0 {
        waiting -= 1;
        let node = &binary.nodes[work[waiting] as usize];
        if node.is_leaf() {
            boxes.indices[boxes.count] = binary.primitive_indices[node.first_index as usize];
            boxes.count += 1;
        } else {
            work[waiting] = node.first_index + 1;
            work[waiting + 1] = node.first_index;
            waiting += 2;
        }
    }
    boxes
}

#[cfg(test)]
mod tests {
    use glam::Vec3A;
    use obvhs::aabb::Aabb;

    use super::*;
    use crate::sah::divide;

    /// Boxes in a row, each touching the next.
    fn row(count: usize) -> Vec<Aabb> {
        let corner = |k: usize| Vec3A::new(k as f32, 0.0, 0.0);
        (0..count).map(|k| Aabb::new(corner(k), corner(k) + Vec3A::ONE)).collect()
    }

    fn divided(boxes: &[Aabb]) -> Bvh2 {
        divide(boxes.len() as u32, &|k| boxes[k as usize])
    }

    fn collapsed(count: usize, leaf_cost: f32) -> (Vec<Node>, Vec<Vec<u32>>) {
        let binary = divided(&row(count));
        let (mut collapse, mut nodes, mut leaves) = (Collapse::default(), Vec::new(), Vec::new());
        collapse.plan(&binary, leaf_cost, |_| true);
        collapse.make_root(&binary, &mut nodes, |boxes| {
            leaves.push(boxes.to_vec());
            Child::leaf(leaves.len() - 1)
        });
        (nodes, leaves)
    }

    #[test]
    fn every_box_is_in_one_leaf_and_every_node_has_one_parent() {
        for count in [1, 2, 3, 4, 5, 8, 31, 32, 33, 1000] {
            let (nodes, leaves) = collapsed(count, 1.0);
            let mut boxes = leaves.concat();
            boxes.sort_unstable();
            assert!(boxes.into_iter().eq(0..count as u32), "{count}");
            let children = nodes.iter().flat_map(|node| node.child);
            let mut inner: Vec<usize> = children
                .filter(|&child| child != Node::UNUSED && !child.is_leaf())
                .map(Child::node)
                .collect();
            inner.sort_unstable();
            assert!(inner.into_iter().eq(1..nodes.len()), "{count}");
        }
    }

    /// Of 32 boxes in a row eight leaves of four below one node: nothing is cheaper.
    #[test]
    fn full_leaves_and_full_nodes_are_cheapest() {
        let (nodes, leaves) = collapsed(32, 1.0);
        assert_eq!((nodes.len(), leaves.len()), (1, 8), "{leaves:?}");
    }

    #[test]
    fn boxes_that_do_not_fit_together_are_in_leaves_of_their_own() {
        let binary = divided(&row(20));
        let (mut collapse, mut nodes, mut leaves) = (Collapse::default(), Vec::new(), 0);
        collapse.plan(&binary, 1.0, |boxes| boxes.len() == 2);
        collapse.make_root(&binary, &mut nodes, |boxes| {
            assert!(boxes.len() <= 2, "{boxes:?}");
            leaves += 1;
            Child::leaf(0)
        });
        assert!(leaves >= 10, "{leaves}");
    }

    #[test]
    fn a_cut_leaves_trees_over_everything() {
        let binary = divided(&row(500));
        let mut collapse = Collapse::default();
        collapse.plan(&binary, 1.0, |_| true);
        let roots = collapse.cut(&binary, 20);
        assert!((20..28).contains(&roots.len()), "{}", roots.len());
        let (mut nodes, mut boxes) = (Vec::new(), Vec::new());
        for root in roots {
            collapse.make(&binary, root, &mut nodes, |leaf| {
                boxes.extend_from_slice(leaf);
                Child::leaf(0)
            });
        }
        boxes.sort_unstable();
        assert!(boxes.into_iter().eq(0..500));
    }
}
