//! A node of the 8-wide bounding volume hierarchy: small, so that a tree of a million triangles stays in the caches.
//!
//! Boxes are stored in steps from the low corner o of the box around all eight children (Ylitie, Karras & Laine 2017, "Efficient
//! Incoherent Ray Traversal on GPUs Through Compressed Wide BVHs", §3.2):
//!
//! ```text
//! plane = o + q s        q: 0 to 255; s: per axis, a little more than a 255th of the way to the far side
//! ```
//!
//! Every box is stored [`ROOM`] steps larger than it is at least, for what a ray loses by rounding on its way to it.

use glam::Vec3A;

/// Eight children: their boxes and where they are. Two lines of the cache.
#[repr(C, align(64))]
#[derive(Clone, Copy, Debug)]
pub(crate) struct Node {
    pub(crate) child: [Child; 8],
    /// q, in rows: low x, high x, low y, high y, low z, high z.
    counts: [[u8; 8]; 6],
    /// o; the fourth number is 0, as of the steps.
    origin: [f32; 4],
    step: [f32; 4],
    /// Bit i: slot i has a child.
    used: u32,
}

/// A ray with origin a and reciprocal direction r meets a plane at q (s r) + (o − a) r. Four roundings, 2⁻²⁴ each, of these two parts make
/// it as wrong as a plane 4 · 2⁻²⁴ (q s + |o − a|) away, and |o − a| is at most |plane − a| + q s. Of that, 4 · 2⁻²⁴ |plane − a| is a part of
/// the distance, for which [`crate::kernel::SLAB_MARGIN`] makes room, and the rest at most 8 · 2⁻²⁴ · 255 s = 1.3e-4 s.
const ROOM: f32 = 1.0 / 4096.0;

/// Far below what a mesh's details are, and far enough above 1.2e-38: products with less are denormal, which makes every visit several times
/// as long.
const LEAST_STEP: f32 = 1e-30;

/// A box as its low and its high corner.
pub(crate) type Bounds = [Vec3A; 2];

/// The box around nothing.
pub(crate) const NOTHING: Bounds = [Vec3A::INFINITY, Vec3A::NEG_INFINITY];

/// The box around both.
#[inline(always)]
pub(crate) fn union(a: Bounds, b: Bounds) -> Bounds {
    [a[0].min(b[0]), a[1].max(b[1])]
}

/// 2²³: numbers from there on are whole, and their last bits count.
const WHOLE: f32 = 8_388_608.0;

/// A number in [0, 255], or the nearest that there is, and 0 for NaN; and the whole number nearest to it.
#[inline(always)]
fn near(x: f32) -> [f32; 2] {
    // Not clamped: NaN would stay.
    let x = if x > 0.0 { x.min(255.0) } else { 0.0 };
    [x, (x + WHOLE) - WHOLE]
}

/// Such a number, rounded down.
#[inline(always)]
fn down(x: f32) -> u8 {
    let [x, near] = near(x);
    let whole = if near > x { near - 1.0 } else { near };
    (whole + WHOLE).to_bits() as u8
}

/// Such a number, rounded up.
#[inline(always)]
fn up(x: f32) -> u8 {
    let [x, near] = near(x);
    let whole = if near < x { near + 1.0 } else { near };
    (whole + WHOLE).to_bits() as u8
}

/// Half the surface; 0 of nothing.
#[inline(always)]
pub(crate) fn half_area([low, high]: Bounds) -> f32 {
    let d = (high - low).max(Vec3A::ZERO);
    d.x * d.y + d.y * d.z + d.z * d.x
}

impl Node {
    /// A node without children.
    pub(crate) const EMPTY: Node = Node {
        origin: [0.0; 4],
        step: [LEAST_STEP, LEAST_STEP, LEAST_STEP, 0.0],
        used: 0,
        counts: [[0; 8]; 6],
        child: [Node::UNUSED; 8],
    };
    /// The child of a slot without one.
    pub(crate) const UNUSED: Child = Child(u32::MAX);

    pub(crate) fn new(children: &[(Bounds, Child)]) -> Node {
        let (mut node, mut boxes) = (Node::EMPTY, [NOTHING; 8]);
        for (slot, (bounds, child)) in children.iter().enumerate() {
            node.child[slot] = *child;
            boxes[slot] = *bounds;
        }
        node.fit(&boxes);
        node
    }

    /// Gives each child this box; [`NOTHING`] is where no ray goes, or a point. Returns the box around all.
    pub(crate) fn fit(&mut self, boxes: &[Bounds; 8]) -> Bounds {
        let around = boxes.iter().copied().fold(NOTHING, union);
        self.used = (0..8).map(|slot| u32::from(self.child[slot] != Node::UNUSED) << slot).sum();
        for axis in 0..3 {
            /// With room on both sides, and for rounding.
            const STEPS: f32 = 255.0 - 8.0 * ROOM;
            let [low, high] = match around[0].is_finite() {
                true => around.map(|corner| corner[axis]),
                false => [0.0; 2],
            };
            let step = ((high - low.next_down()) / STEPS).max(LEAST_STEP);
            let reciprocal = 1.0 / step;
            self.step[axis] = step;
            // Rounding must not take away the room below.
            self.origin[axis] = (low - 2.0 * ROOM * step).min(low.next_down());
            // A loop of its own for each step, without casts, which the compiler makes vectors of.
            let (mut low, mut high) = ([0.0; 8], [0.0; 8]);
            for (slot, bounds) in boxes.iter().enumerate() {
                low[slot] = bounds[0][axis];
                high[slot] = bounds[1][axis];
            }
            let origin = self.origin[axis];
            let [low_counts, high_counts] = &mut self.counts.as_chunks_mut().0[axis];
            for (count, plane) in low_counts.iter_mut().zip(low) {
                *count = down((plane - origin) * reciprocal - ROOM);
            }
            for (count, plane) in high_counts.iter_mut().zip(high) {
                *count = up((plane - origin) * reciprocal + ROOM);
            }
        }
        around
    }

    /// The plane of a child's box, in rows: low x, high x, low y, high y, low z, high z.
    #[inline(always)]
    pub(crate) fn plane(&self, row: usize, slot: usize) -> f32 {
        let axis = row / 2 % 3;
        self.origin[axis] + f32::from(self.counts[row % 6][slot % 8]) * self.step[axis]
    }

    /// Bit i: slot i has a child.
    #[inline(always)]
    pub(crate) fn used(&self) -> u32 {
        self.used
    }

    /// o.
    #[inline(always)]
    pub(crate) fn origin(&self) -> &[f32; 4] {
        &self.origin
    }

    /// s.
    #[inline(always)]
    pub(crate) fn step(&self) -> &[f32; 4] {
        &self.step
    }

    /// q of each child, in rows as for [`Node::plane`].
    #[inline(always)]
    pub(crate) fn counts(&self, row: usize) -> &[u8; 8] {
        &self.counts[row % 6]
    }

    /// Both rows of an axis.
    #[inline(always)]
    pub(crate) fn counts_of(&self, axis: usize) -> &[[u8; 8]; 2] {
        &self.counts.as_chunks().0[axis % 3]
    }

    /// The same where what is below lies farther behind: its nodes and its leaves.
    pub(crate) fn moved(mut self, nodes: usize, leaves: usize) -> Node {
        for child in self.child.iter_mut().filter(|child| **child != Node::UNUSED) {
            *child = child.moved(nodes, leaves);
        }
        self
    }
}

/// An inner node's index, or, with bit 31 set, where a leaf is.
#[repr(transparent)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Child(u32);

impl Child {
    const LEAF: u32 = 1 << 31;
    pub(crate) const ROOT: Child = Child(0);

    pub(crate) fn leaf(place: usize) -> Child {
        assert!(place < (Self::LEAF - 1) as usize, "leaves beyond 2³¹");
        Child(Self::LEAF | place as u32)
    }

    pub(crate) fn inner(node: usize) -> Child {
        assert!(node < Self::LEAF as usize, "nodes beyond 2³¹");
        Child(node as u32)
    }

    /// The same where nodes and leaves lie farther behind.
    pub(crate) fn moved(self, nodes: usize, leaves: usize) -> Child {
        match self.is_leaf() {
            true => Child::leaf(self.place() + leaves),
            false => Child::inner(self.node() + nodes),
        }
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

    /// Where a leaf is.
    #[inline(always)]
    pub(crate) fn place(self) -> usize {
        (self.0 & !Self::LEAF) as usize
    }
}

#[cfg(test)]
mod tests {
    use frameless::Rng;

    use super::*;

    /// Boxes of all sizes, flat ones, and some so far away that there are few floats left.
    #[test]
    fn boxes_are_inside_what_is_stored_of_them_and_not_much_smaller() {
        let mut rng = Rng::new(3);
        for round in 0..10_000 {
            let size = 10f32.powi(rng.below(30) as i32 - 20);
            let far = if round % 2 == 0 { 0.0 } else { size * 10f32.powi(rng.below(9) as i32) };
            let mut point = || {
                Vec3A::from_array(std::array::from_fn(|axis| match (round + axis) % 7 {
                    0 => far,
                    _ => far + size * rng.unit_f32(),
                }))
            };
            let boxes: [Bounds; 8] = std::array::from_fn(|_| {
                let [a, b] = [point(), point()];
                [a.min(b), a.max(b)]
            });
            let node = Node::new(&boxes.map(|bounds| (bounds, Child::ROOT)));
            let [low, high] = boxes.into_iter().fold(NOTHING, union);
            for (slot, axis) in (0..8).flat_map(|slot| (0..3).map(move |axis| (slot, axis))) {
                let [least, most] = boxes[slot].map(|corner| corner[axis]);
                let stored = [node.plane(2 * axis, slot), node.plane(2 * axis + 1, slot)];
                assert!(stored[0] <= least && most <= stored[1], "{stored:?} {least} {most}");
                let close =
                    (high - low)[axis] * (1.1 / 255.0) + 4.0 * f32::EPSILON * far.max(1e-20);
                assert!(least - stored[0] <= close && stored[1] - most <= close);
            }
        }
    }

    #[test]
    fn a_child_without_a_box_leaves_the_others_theirs() {
        let bounds = [Vec3A::ONE, Vec3A::splat(2.0)];
        let node = Node::new(&[(NOTHING, Child::ROOT), (bounds, Child::ROOT)]);
        assert_eq!(node.used(), 0b11);
        assert!(node.plane(0, 1) <= 1.0 && node.plane(0, 1) > 0.99);
        let nowhere = Node::new(&[(NOTHING, Child::ROOT)]);
        assert!((0..6).all(|row| nowhere.plane(row, 0).abs() < 1e-27));
    }

    #[test]
    fn bytes_are_what_casts_make_of_numbers() {
        let mut rng = Rng::new(7);
        let some = [-0.0, 0.5, 1.0, 254.0, 255.0, 255.5, 256.0, 1e30, -1e30, f32::INFINITY];
        let more = [f32::NEG_INFINITY, f32::NAN, 254.0f32.next_up(), 3.0f32.next_down(), 2.5, 3.5];
        let any = std::iter::from_fn(|| Some(280.0 * rng.unit_f32() - 12.0)).take(10_000);
        for x in some.into_iter().chain(more).chain(any) {
            assert_eq!(down(x), x as u8, "{x}");
            assert_eq!(up(x), x.ceil() as u8, "{x}");
        }
    }
}
