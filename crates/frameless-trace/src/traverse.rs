//! The walk through a wide BVH, nearest box first.

use crate::kernel::{Kernel, SLAB_MARGIN, SlabRay};
use crate::packet::Worth;
use crate::ray::Hit;
use crate::stream::Ways;
use crate::wide::{Child, Node};

/// Entries that one tree's traversal may put on the stack. A tree balanced by median splits of 2²⁷ leaves needs
/// 7 per binary level: 7 · 27 = 189.
pub(crate) const STACK_PER_TREE: usize = 192;

/// Room for two trees, and a power of two, so that an index can be kept inside without asking.
const ENTRIES: usize = (2 * STACK_PER_TREE).next_power_of_two();

/// Nodes still to be visited: the top level's and, above them, one instance's. And what the thread whose it is has learned of walking rays
/// together, which no result depends on.
pub(crate) struct Stack {
    entries: [Entry; ENTRIES],
    /// Per entry of a packet: eight times its parent's index, plus its slot there.
    from: [u32; ENTRIES],
    length: usize,
    /// Nodes and leaves that rays have come to that were walked alone, and as many as take the time of what else they met. Whatever is done with
    /// a ray, and by whichever instructions, that is the same number.
    pub(crate) boxes: u64,
    /// Of rays that look for what is nearest, and of those that look for anything.
    pub(crate) worth: [Worth; 2],
    /// For rays that are walked by turns: those that are, and their memory.
    pub(crate) alone: Vec<u32>,
    pub(crate) ways: Ways,
}

/// A node and where the ray enters it, in one number that is larger the farther away that is: bits of floats that are not negative
/// are in the order of the floats.
#[repr(transparent)]
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Entry(u64);

impl Entry {
    /// Where a walk begins.
    pub(crate) const ROOT: Entry = Entry(0);

    #[inline(always)]
    pub(crate) fn new(child: Child, near: f32) -> Entry {
        Entry(u64::from(near.to_bits()) << 32 | u64::from(child.bits()))
    }

    #[inline(always)]
    pub(crate) fn child(self) -> Child {
        Child::from_bits(self.0 as u32)
    }

    #[inline(always)]
    pub(crate) fn near(self) -> f32 {
        f32::from_bits((self.0 >> 32) as u32)
    }
}

impl Stack {
    pub(crate) fn new() -> Stack {
        Stack {
            entries: [Entry::ROOT; ENTRIES],
            from: [0; ENTRIES],
            length: 0,
            boxes: 0,
            worth: [Worth::default(); 2],
            alone: Vec::new(),
            ways: Ways::default(),
        }
    }

    #[inline(always)]
    fn push(&mut self, entry: Entry) {
        debug_assert!(self.length < ENTRIES, "the builder keeps trees within STACK_PER_TREE");
        self.entries[self.length % ENTRIES] = entry;
        self.length += 1;
    }

    #[inline(always)]
    fn pop(&mut self) -> Entry {
        self.length -= 1;
        self.entries[self.length % ENTRIES]
    }

    /// Puts an entry where those from `base` on stay sorted, the nearest on top.
    #[inline(always)]
    fn insert(&mut self, base: usize, entry: Entry) {
        let mut place = self.length;
        self.length += 1;
        while place > base && self.entries[(place - 1) % ENTRIES] < entry {
            self.entries[place % ENTRIES] = self.entries[(place - 1) % ENTRIES];
            place -= 1;
        }
        self.entries[place % ENTRIES] = entry;
    }
}

/// For walks that have to know which slot of which node a child is in.
impl Stack {
    #[inline(always)]
    pub(crate) fn length(&self) -> usize {
        self.length
    }

    /// As [`Stack::insert`].
    #[inline(always)]
    pub(crate) fn insert_from(&mut self, base: usize, entry: Entry, from: usize) {
        debug_assert!(self.length < ENTRIES, "the builder keeps trees within STACK_PER_TREE");
        let mut place = self.length;
        self.length += 1;
        while place > base && self.entries[(place - 1) % ENTRIES] < entry {
            self.entries[place % ENTRIES] = self.entries[(place - 1) % ENTRIES];
            self.from[place % ENTRIES] = self.from[(place - 1) % ENTRIES];
            place -= 1;
        }
        self.entries[place % ENTRIES] = entry;
        self.from[place % ENTRIES] = from as u32;
    }

    #[inline(always)]
    pub(crate) fn pop_from(&mut self) -> (Entry, usize) {
        let entry = self.pop();
        (entry, self.from[self.length % ENTRIES] as usize)
    }
}

/// What lies in the leaves.
pub(crate) trait Leaves {
    /// Tests a leaf's items; a hit before `best` takes its place. Whether there was one.
    fn visit(&mut self, leaf: Child, best: &mut Hit, stack: &mut Stack) -> bool;

    /// Where they are, in words as [`Child::place`] counts them; what is elsewhere may be told anywhere.
    fn words(&self) -> &[u32];
}

/// Whether anything is hit before `best`, which becomes the nearest hit; with `ANY`, the first one found.
#[inline(always)]
pub(crate) fn walk<K: Kernel, const ANY: bool>(
    nodes: &[Node],
    ray: &SlabRay,
    best: &mut Hit,
    stack: &mut Stack,
    leaves: &mut impl Leaves,
) -> bool {
    let base = stack.length;
    let mut current = Child::ROOT;
    let mut found = false;
    let mut boxes = 0;
    loop {
        boxes += 1;
        if current.is_leaf() {
            // What its second line holds is wanted at once, but found only by the first.
            K::fetch(leaves.words().as_ptr().wrapping_add(current.place()).cast());
            if leaves.visit(current, best, stack) {
                found = true;
                if ANY {
                    stack.length = base;
                    stack.boxes += boxes;
                    return true;
                }
            }
        } else {
            let node = &nodes[current.node()];
            let places = [nodes.as_ptr().cast(), leaves.words().as_ptr().cast()];
            if let Some(nearest) = descend::<K, ANY>(node, ray, best.t, stack, places) {
                current = nearest;
                continue;
            }
        }
        loop {
            if stack.length == base {
                stack.boxes += boxes;
                return found;
            }
            let entry = stack.pop();
            if ANY || entry.near() <= best.t * SLAB_MARGIN {
                current = entry.child();
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
    places: [*const u8; 2],
) -> Option<Child> {
    let (mut mask, near) = K::boxes(node, ray, t_max);
    let mut waiting = mask.count_ones();
    if waiting <= 1 {
        let slot = mask.trailing_zeros() as usize;
        return (waiting == 1).then(|| node.child[slot & 7]);
    }
    // Memory is slow and several children wait: it can begin with all of them.
    if ANY {
        // Any order finds whether there is a hit; sorting would only cost.
        loop {
            let child = node.child[mask.trailing_zeros() as usize & 7];
            mask &= mask.wrapping_sub(1);
            if mask == 0 {
                return Some(child);
            }
            K::fetch(place_of(child, places));
            stack.push(Entry::new(child, 0.0));
        }
    }
    let entries = K::entries(node, near);
    let mut next = || {
        let slot = mask.trailing_zeros() as usize;
        mask &= mask.wrapping_sub(1);
        K::fetch(place_of(entries[slot & 7].child(), places));
        entries[slot & 7]
    };
    let first = next();
    let second = next();
    let (nearer, farther) = (first.min(second), first.max(second));
    if waiting == 2 {
        stack.push(farther);
        return Some(nearer.child());
    }
    let third = next();
    let base = stack.length;
    let (middle, farthest) = (farther.min(third), farther.max(third));
    let (nearest, middle) = (nearer.min(middle), nearer.max(middle));
    stack.push(farthest);
    stack.push(middle);
    if waiting == 3 {
        return Some(nearest.child());
    }
    stack.push(nearest);
    while waiting > 3 {
        stack.insert(base, next());
        waiting -= 1;
    }
    Some(stack.pop().child())
}

/// Where a child is, of nodes and leaves that begin at `places`. Which of them it is cannot be predicted; so nothing branches on it.
#[inline(always)]
pub(crate) fn place_of(child: Child, places: [*const u8; 2]) -> *const u8 {
    const NODE: u32 = size_of::<Node>().trailing_zeros();
    const WORD: u32 = size_of::<u32>().trailing_zeros();
    let (from, size) = if child.is_leaf() { (places[1], WORD) } else { (places[0], NODE) };
    from.wrapping_add(child.place() << size)
}

const _: () = assert!(size_of::<Node>().is_power_of_two());
