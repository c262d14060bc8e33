//! The 8-wide bounding volume hierarchy: a binary one collapsed so that one vector instruction tests eight children.

use obvhs::bvh2::Bvh2;

/// Eight children: their boxes and where they are.
///
/// Rows of `bounds`: low x, high x, low y, high y, low z, high z. An unused slot has an inside-out box, which no ray meets.
#[repr(C, align(64))]
#[derive(Clone, Copy, Debug)]
pub(crate) struct Node {
    pub(crate) bounds: [[f32; 8]; 6],
    pub(crate) child: [Child; 8],
}

impl Node {
    const EMPTY: Node = {
        let (low, high) = ([f32::INFINITY; 8], [f32::NEG_INFINITY; 8]);
        Node { bounds: [low, high, low, high, low, high], child: [Node::UNUSED; 8] }
    };
    /// The child of a slot without one.
    pub(crate) const UNUSED: Child = Child(u32::MAX);
}

/// An inner node's index, or a leaf: bit 31 set, then 2 bits of length − 1, then 29 bits of index.
#[repr(transparent)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Child(u32);

impl Child {
    const LEAF: u32 = 1 << 31;
    const INDEX_BITS: u32 = 29;
    const INDEX: u32 = (1 << Self::INDEX_BITS) - 1;
    pub(crate) const ROOT: Child = Child(0);

    pub(crate) fn leaf(first: usize, length: usize) -> Child {
        assert!((1..=4).contains(&length), "a leaf holds 1 to 4 items, not {length}");
        assert!(first <= Self::INDEX as usize, "more than 2²⁹ leaf items");
        Child(Self::LEAF | (length as u32 - 1) << Self::INDEX_BITS | first as u32)
    }

    #[inline(always)]
    pub(crate) fn bits(self) -> u32 {
        self.0
    }

    /// The inverse of [`Child::bits`].
    #[inline(always)]
    pub(crate) fn from_bits(bits: u32) -> Child {
        Child(bits)
    }

    #[inline(always)]
    pub(crate) fn is_leaf(self) -> bool {
        self.0 & Self::LEAF != 0
    }

    /// Index of an inner node.
    #[inline(always)]
    pub(crate) fn node(self) -> usize {
        self.0 as usize
    }

    /// Items of a leaf.
    #[inline(always)]
    pub(crate) fn items(self) -> std::ops::Range<usize> {
        let first = (self.0 & Self::INDEX) as usize;
        first..first + (self.0 >> Self::INDEX_BITS & 3) as usize + 1
    }
}

/// Collapse `binary` into `nodes` (cleared first; its first node is the root). `leaf` is told a leaf's
/// primitives and says how to refer to them.
///
/// Starting from a node's two children, the inner node with the largest surface is replaced by its own children until
/// there are eight (Wald et al. 2008, "Getting Rid of Packets", §3.1): the surface is the probability of a visit.
///
/// Returns how many entries a traversal's stack can ever need.
pub(crate) fn collapse(
    binary: &Bvh2,
    nodes: &mut Vec<Node>,
    mut leaf: impl FnMut(&[u32]) -> Child,
) -> usize {
    nodes.clear();
    nodes.push(Node::EMPTY);
    if binary.nodes.is_empty() {
        return 0;
    }
    let mut stack_need = 0;
    // Binary node, wide node it becomes, entries on the stack when a traversal comes here.
    let mut work = vec![(0usize, 0usize, 0usize)];
    let mut members = Vec::with_capacity(8);
    while let Some((from, to, waiting)) = work.pop() {
        gather(binary, from, &mut members);
        let waiting = waiting + members.len() - 1;
        stack_need = stack_need.max(waiting);
        let mut node = Node::EMPTY;
        for (slot, &member) in members.iter().enumerate() {
            let source = &binary.nodes[member];
            let (low, high) = (source.aabb().min, source.aabb().max);
            for axis in 0..3 {
                node.bounds[2 * axis][slot] = low[axis];
                node.bounds[2 * axis + 1][slot] = high[axis];
            }
            node.child[slot] = if source.is_leaf() {
                let first = source.first_index as usize;
                leaf(&binary.primitive_indices[first..first + source.prim_count as usize])
            } else {
                nodes.push(Node::EMPTY);
                work.push((member, nodes.len() - 1, waiting));
                Child((nodes.len() - 1) as u32)
            };
        }
        nodes[to] = node;
    }
    stack_need
}

/// The up to eight descendants of `from` that become one wide node's children.
fn gather(binary: &Bvh2, from: usize, members: &mut Vec<usize>) {
    members.clear();
    members.push(from);
    while members.len() < 8 {
        let area = |&member: &usize| binary.nodes[member].aabb().half_area();
        let widest = (0..members.len())
            .filter(|&k| !binary.nodes[members[k]].is_leaf())
            .max_by(|&a, &b| area(&members[a]).total_cmp(&area(&members[b])));
        let Some(widest) = widest else { break };
        let first = binary.nodes[members[widest]].first_index as usize;
        members[widest] = first;
        members.push(first + 1);
    }
}
