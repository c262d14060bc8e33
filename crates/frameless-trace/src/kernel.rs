//! The two inner tests: a ray against eight boxes, a ray against a leaf's triangles.
//!
//! Written twice, portably and with AVX2 intrinsics, operation for operation the same and without fused multiply-adds but where products
//! are exact, so that both give the same bits. Everything above them is written once.

#[cfg(target_arch = "x86_64")]
pub(crate) mod avx2;
#[cfg(target_arch = "x86_64")]
pub(crate) mod avx512;
pub(crate) mod turns;

use glam::{Vec3, Vec3A};

use crate::leaf::{Leaf, MOST_TRIANGLES};
use crate::ray::{Hit, Ray};
use crate::traverse::Entry;
use crate::wide::Node;

/// A box's far side counts as this much farther away, so that rounding never loses a box that the ray touches
/// (Ize 2013, "Robust BVH Ray Traversal", JCGT 2(2)): entry and exit each carry four roundings, together 8 · 2⁻²⁴ = 4.8e-7.
pub(crate) const SLAB_MARGIN: f32 = 1.000_001;
/// The same in units of a float's last place, which are between 6e-8 and 1.2e-7 of it: floats that are not negative are in the order of
/// their bits, and every negative one is before them.
pub(crate) const SLAB_MARGIN_ULPS: i32 = 16;

/// A ray that is parallel to a pair of sides leaves them no later than this, and its distances are no NaN.
const LARGEST_RECIPROCAL: f32 = 1e30;

/// Which instructions the tests use.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Isa {
    /// Any processor.
    #[cfg_attr(
        target_arch = "x86_64",
        allow(dead_code, reason = "the fallback, and the tests' reference")
    )]
    Portable,
    /// x86-64 with AVX2, FMA, BMI1 and POPCNT, found at run time. Only [`Isa::detect`] makes it.
    #[cfg(target_arch = "x86_64")]
    Avx2(avx2::Detected),
}

impl Isa {
    /// The fastest that this machine has.
    pub(crate) fn detect() -> Isa {
        #[cfg(target_arch = "x86_64")]
        if let Some(detected) = avx2::Detected::new() {
            return Isa::Avx2(detected);
        }
        Isa::Portable
    }
}

#[cfg(test)]
impl Isa {
    /// All that this machine has.
    pub(crate) fn all() -> Vec<Isa> {
        let mut all = vec![Isa::Portable];
        #[cfg(target_arch = "x86_64")]
        if let Some(detected) = avx2::Detected::new() {
            all.extend([detected.without_wider(), detected].map(Isa::Avx2));
        }
        all
    }
}

/// Eight numbers at once. Comparisons answer with a bit per lane; none holds of NaN.
pub(crate) trait Eight: Copy {
    fn splat(x: f32) -> Self;
    fn load(from: &[f32; 8]) -> Self;
    fn store(self) -> [f32; 8];
    fn add(self, other: Self) -> Self;
    fn sub(self, other: Self) -> Self;
    fn mul(self, other: Self) -> Self;
    fn div(self, other: Self) -> Self;
    /// The other if one is NaN, as `minps`.
    fn min(self, other: Self) -> Self;
    /// The other if one is NaN, as `maxps`.
    fn max(self, other: Self) -> Self;
    /// self ≤ other.
    fn at_most(self, other: Self) -> u32;
    fn equals(self, other: Self) -> u32;
}

/// The two tests. Implementors differ in speed only.
pub(crate) trait Kernel {
    type Eight: Eight;

    /// Bit i: the ray meets box i at some t in [0, t_max]; and where each is entered.
    fn boxes(node: &Node, ray: &SlabRay, t_max: f32) -> (u32, Self::Eight);

    /// Each child with where its box is entered.
    fn entries(node: &Node, near: Self::Eight) -> [Entry; 8];

    /// A plane of each child's box: see [`Node::plane`].
    fn planes(node: &Node, row: usize) -> Self::Eight;

    /// Asks for the memory of two lines of the cache to be brought near the processor, if it can be asked.
    fn fetch(place: *const u8);

    /// The triangles that the ray meets at 0 < t ≤ t_max < ∞.
    fn triangles(leaf: Leaf<'_>, ray: &ShearRay, t_max: f32) -> Lanes;
}

/// What the triangles of a leaf answer; lanes whose bit is not in `mask` hold nothing of meaning.
#[derive(Clone, Copy)]
pub(crate) struct Lanes {
    pub(crate) mask: u32,
    pub(crate) t: [f32; MOST_TRIANGLES],
    /// Barycentric weight of the second vertex.
    pub(crate) v: [f32; MOST_TRIANGLES],
    /// Barycentric weight of the third vertex.
    pub(crate) w: [f32; MOST_TRIANGLES],
}

impl Lanes {
    const NONE: Lanes = {
        let zero = [0.0; MOST_TRIANGLES];
        Lanes { mask: 0, t: zero, v: zero, w: zero }
    };

    /// The triangles of the leaf that were hit, one after the other. `place`: instance and triangle of what is in the leaf.
    #[inline(always)]
    pub(crate) fn hits(
        &self,
        leaf: Leaf<'_>,
        place: impl Fn(u32) -> (u32, u32),
    ) -> impl Iterator<Item = Hit> {
        let mut mask = self.mask;
        std::iter::from_fn(move || {
            if mask == 0 {
                return None;
            }
            let lane = mask.trailing_zeros() as usize & 3;
            mask &= mask - 1;
            let (instance, primitive) = place(leaf.triangle(lane));
            let barycentric = [self.v[lane], self.w[lane]];
            Some(Hit { t: self.t[lane], barycentric, primitive, instance })
        })
    }
}

/// A ray prepared for boxes.
#[derive(Clone, Copy)]
pub(crate) struct SlabRay {
    pub(crate) origin: Vec3A,
    /// 1 / direction, at most [`LARGEST_RECIPROCAL`] in size.
    pub(crate) reciprocal: Vec3A,
    /// Per axis: 1 if the ray runs downwards and enters through the high side.
    pub(crate) entry: [usize; 3],
}

impl SlabRay {
    #[inline(always)]
    pub(crate) fn new(ray: &Ray) -> SlabRay {
        let most = Vec3A::splat(LARGEST_RECIPROCAL);
        let reciprocal = ray.direction.recip().clamp(-most, most);
        SlabRay {
            origin: ray.origin,
            reciprocal,
            entry: reciprocal.to_array().map(|r| usize::from(r < 0.0)),
        }
    }
}

/// A ray prepared for triangles: the shear that makes it the +z axis (Woop, Benthin & Wald 2013, "Watertight
/// Ray/Triangle Intersection", JCGT 2(1)).
#[derive(Clone, Copy)]
pub(crate) struct ShearRay {
    pub(crate) origin: [f32; 3],
    /// Axes x, y, z of the sheared space; z is where the direction is largest.
    pub(crate) axes: [usize; 3],
    /// dx/dz, dy/dz, 1/dz.
    pub(crate) shear: [f32; 3],
}

impl ShearRay {
    #[inline(always)]
    pub(crate) fn new(ray: &Ray) -> ShearRay {
        const AXES: [[usize; 3]; 4] = [[1, 2, 0], [2, 0, 1], [0, 1, 2], [0, 1, 2]];
        let size = ray.direction.abs().to_array();
        // Which it is cannot be predicted; so nothing branches on it.
        let (x_or_y, larger) = if size[0] > size[1] { (0, size[0]) } else { (1, size[1]) };
        let z = if larger > size[2] { x_or_y } else { 2 };
        // Four, so that an index can be kept inside without asking.
        let axes = AXES[z & 3];
        let Vec3 { x: dx, y: dy, z: dz } = ray.direction.into();
        let d = [dx, dy, dz, dz];
        let shear = Vec3A::new(d[axes[0] & 3], d[axes[1] & 3], 1.0) / d[z & 3];
        let shear = shear.to_array();
        ShearRay { origin: ray.origin.to_array(), axes, shear }
    }
}

/// For every processor; compilers vectorise it well.
pub(crate) struct Portable;

/// What `minps` computes: the second if one is NaN.
#[inline(always)]
fn min(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

/// What `maxps` computes: the second if one is NaN.
#[inline(always)]
fn max(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

/// Whether no two have opposite signs.
#[inline(always)]
fn is_inside(u: f32, v: f32, w: f32) -> bool {
    min(u, min(v, w)) >= 0.0 || max(u, max(v, w)) <= 0.0
}

/// Eight numbers for every processor.
#[derive(Clone, Copy)]
pub(crate) struct PortableEight([f32; 8]);

impl PortableEight {
    #[inline(always)]
    fn zip(self, other: Self, op: impl Fn(f32, f32) -> f32) -> Self {
        PortableEight(std::array::from_fn(|lane| op(self.0[lane], other.0[lane])))
    }

    #[inline(always)]
    fn compare(self, other: Self, op: impl Fn(&f32, &f32) -> bool) -> u32 {
        (0..8).map(|lane| u32::from(op(&self.0[lane], &other.0[lane])) << lane).sum()
    }
}

impl Eight for PortableEight {
    #[inline(always)]
    fn splat(x: f32) -> Self {
        PortableEight([x; 8])
    }
    #[inline(always)]
    fn load(from: &[f32; 8]) -> Self {
        PortableEight(*from)
    }
    #[inline(always)]
    fn store(self) -> [f32; 8] {
        self.0
    }
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        self.zip(other, |a, b| a + b)
    }
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self.zip(other, |a, b| a - b)
    }
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        self.zip(other, |a, b| a * b)
    }
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        self.zip(other, |a, b| a / b)
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        self.zip(other, min)
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        self.zip(other, max)
    }
    #[inline(always)]
    fn at_most(self, other: Self) -> u32 {
        self.compare(other, f32::le)
    }
    #[inline(always)]
    fn equals(self, other: Self) -> u32 {
        self.compare(other, f32::eq)
    }
}

impl Kernel for Portable {
    type Eight = PortableEight;

    /// q (s r) + (o − a) r for each plane; see [`Node`].
    #[inline(always)]
    fn boxes(node: &Node, ray: &SlabRay, t_max: f32) -> (u32, PortableEight) {
        let (mut near, mut far) = ([0.0; 8], [t_max; 8]);
        for axis in 0..3 {
            let first = (node.origin()[axis] - ray.origin[axis]) * ray.reciprocal[axis];
            let step = node.step()[axis] * ray.reciprocal[axis];
            let enters = node.counts(2 * axis + ray.entry[axis]);
            let leaves = node.counts(2 * axis + (ray.entry[axis] ^ 1));
            for lane in 0..8 {
                near[lane] = max(f32::from(enters[lane]) * step + first, near[lane]);
                far[lane] = min(f32::from(leaves[lane]) * step + first, far[lane]);
            }
        }
        let meets = |lane: usize| {
            let [near, far] = [near[lane], far[lane]].map(|t| t.to_bits() as i32);
            near < far + SLAB_MARGIN_ULPS
        };
        let mask: u32 = (0..8).map(|lane| u32::from(meets(lane)) << lane).sum();
        (mask & node.used(), PortableEight(near))
    }

    #[inline(always)]
    fn entries(node: &Node, near: PortableEight) -> [Entry; 8] {
        std::array::from_fn(|slot| Entry::new(node.child[slot], near.0[slot]))
    }

    #[inline(always)]
    fn planes(node: &Node, row: usize) -> PortableEight {
        PortableEight(std::array::from_fn(|slot| node.plane(row, slot)))
    }

    #[inline(always)]
    fn fetch(_place: *const u8) {}

    /// With A, B, C the vertices in the ray's sheared space, seen along the ray:
    ///
    /// U = Cx·By − Cy·Bx, V = Ax·Cy − Ay·Cx, W = Bx·Ay − By·Ax; inside if no two have opposite signs;
    /// t = (U·Az + V·Bz + W·Cz) / (U + V + W).
    ///
    /// Rounding is monotonic, so a difference of two rounded products has the exact sign or is zero. Where it is zero, double
    /// precision, which holds the products exactly, decides; what is zero then counts as inside for both triangles at
    /// the edge. Hence no ray slips between triangles that share vertices.
    #[inline(always)]
    fn triangles(leaf: Leaf<'_>, ray: &ShearRay, t_max: f32) -> Lanes {
        let [kx, ky, kz] = ray.axes;
        let [sx, sy, sz] = ray.shear;
        let mut lanes = Lanes::NONE;
        for lane in 0..leaf.triangles() {
            let sheared = |corner: usize| {
                let place = leaf.corner(lane, corner);
                let from_origin = |axis: usize| place[axis] - ray.origin[axis];
                let z = from_origin(kz);
                (from_origin(kx) - sx * z, from_origin(ky) - sy * z, sz * z)
            };
            let (ax, ay, az) = sheared(0);
            let (bx, by, bz) = sheared(1);
            let (cx, cy, cz) = sheared(2);
            let edge = |x0: f32, y1: f32, y0: f32, x1: f32| x0 * y1 - y0 * x1;
            let (mut u, mut v, mut w) =
                (edge(cx, by, cy, bx), edge(ax, cy, ay, cx), edge(bx, ay, by, ax));
            if is_inside(u, v, w) && (u == 0.0 || v == 0.0 || w == 0.0) {
                let edge = |x0: f32, y1: f32, y0: f32, x1: f32| {
                    (f64::from(x0) * f64::from(y1) - f64::from(y0) * f64::from(x1)) as f32
                };
                (u, v, w) = (edge(cx, by, cy, bx), edge(ax, cy, ay, cx), edge(bx, ay, by, ax));
            }
            let inside = is_inside(u, v, w);
            let determinant = u + v + w;
            let inverse = 1.0 / determinant;
            let t = (u * az + v * bz + w * cz) * inverse;
            let hit = inside && determinant != 0.0 && t > 0.0 && t <= t_max;
            lanes.mask |= u32::from(hit) << lane;
            lanes.t[lane] = t;
            lanes.v[lane] = v * inverse;
            lanes.w[lane] = w * inverse;
        }
        lanes
    }
}
