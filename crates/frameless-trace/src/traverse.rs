//! The walk through a wide BVH, nearest box first.

use crate::kernel::{Kernel, SLAB_MARGIN, SlabRay};
use crate::wide::{Child, Node};

/// Entries that one tree's traversal may put on the stack. A tree balanced by median splits of 2²⁹ leaves needs
/// 7 per binary level: 7 · 27 = 189.
pub(crate) const STACK_PER_TREE: usize = 192;

/// Nodes still to be visited: the top level's and, above them, one instance's.
pub(crate) struct Stack {
    entries: [(Child, f32); 2 * STACK_PER_TREE],
    length: usize,
}

impl Stack {
    pub(crate) fn new() -> Stack {
        Stack { entries: [(Child::ROOT, 0.0); 2 * STACK_PER_TREE], length: 0 }
    }

    #[inline(always)]
    fn push(&mut self, child: Child, near: f32) {
        self.entries[self.length] = (child, near);
        self.length += 1;
    }

    /// Insert so that entries from `base` on stay sorted, the nearest on top.
    #[inline(always)]
    fn insert(&mut self, base: usize, child: Child, near: f32) {
        let mut place = self.length;
        self.length += 1;
        while place > base && self.entries[place - 1].1 < near {
            self.entries[place] = self.entries[place - 1];
            place -= 1;
        }
        self.entries[place] = (child, near);
    }

    #[inline(always)]
    fn pop(&mut self) -> (Child, f32) {
        self.length -= 1;
        self.entries[self.length]
    }
}

/// What lies in the leaves.
pub(crate) trait Leaves {
    /// Test a leaf's items; on a hit nearer than `t_max` lower it and return true.
    fn visit(&mut self, leaf: Child, t_max: &mut f32, stack: &mut Stack) -> bool;
}

/// Whether anything is hit before `t_max`, which ends up at the nearest hit; with `ANY`, at the first one found.
#[inline(always)]
pub(crate) fn walk<K: Kernel, const ANY: bool>(
    nodes: &[Node],
    ray: &SlabRay,
    t_max: &mut f32,
    stack: &mut Stack,
    leaves: &mut impl Leaves,
) -> bool {
    let base = stack.length;
    let mut current = Child::ROOT;
    let mut found = false;
    loop {
        if current.is_leaf() {
            if leaves.visit(current, t_max, stack) {
                found = true;
                if ANY {
                    stack.length = base;
                    return true;
                }
            }
        } else if let Some(nearest) = descend::<K, ANY>(&nodes[current.node()], ray, *t_max, stack)
        {
            current = nearest;
            continue;
        }
        loop {
            if stack.length == base {
                return found;
            }
            let (child, near) = stack.pop();
            if ANY || near <= *t_max * SLAB_MARGIN {
                current = child;
                break;
            }
        }
    }
}

/// The child to visit next; the others that the ray meets wait on the stack.
#[inline(always)]
fn descend<K: Kernel, const ANY: bool>(
    node: &Node,
    ray: &SlabRay,
    t_max: f32,
    stack: &mut Stack,
) -> Option<Child> {
    let (mut mask, near) = K::boxes(node, ray, t_max);
    let mut next = || {
        let slot = mask.trailing_zeros() as usize;
        mask &= mask.wrapping_sub(1);
        (slot < 8).then(|| (node.child[slot & 7], near[slot & 7]))
    };
    let first = next()?;
    let Some(second) = next() else { return Some(first.0) };
    if ANY {
        // Any order finds whether there is a hit; sorting would only cost.
        stack.push(second.0, 0.0);
        while let Some((child, _)) = next() {
            stack.push(child, 0.0);
        }
        return Some(first.0);
    }
    let (nearer, farther) = if second.1 < first.1 { (second, first) } else { (first, second) };
    let Some(third) = next() else {
        stack.push(farther.0, farther.1);
        return Some(nearer.0);
    };
    let base = stack.length;
    stack.push(farther.0, farther.1);
    stack.push(nearer.0, nearer.1);
    stack.insert(base, third.0, third.1);
    while let Some((child, near)) = next() {
        stack.insert(base, child, near);
    }
    Some(stack.pop().0)
}
