//! The two inner tests: a ray against eight boxes, a ray against four triangles.
//!
//! Written twice, portably and with AVX2 intrinsics, operation for operation the same and without fused multiply-adds, so
//! that both give the same bits. Everything above them is written once.

#[cfg(target_arch = "x86_64")]
pub(crate) mod avx2;

use std::ops::Range;

use glam::Vec3A;

use crate::ray::Ray;
use crate::traverse::Entry;
use crate::wide::Node;

/// A box's far side counts as this much farther away, so that rounding never loses a box that the ray touches
/// (Ize 2013, "Robust BVH Ray Traversal", JCGT 2(2)): entry and exit each carry three roundings, together 6 · 2⁻²⁴ = 3.6e-7.
pub(crate) const SLAB_MARGIN: f32 = 1.000_000_5;

/// Which instructions the tests use.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Isa {
    /// Any processor.
    #[cfg_attr(
        target_arch = "x86_64",
        allow(dead_code, reason = "the fallback, and the tests' reference")
    )]
    Portable,
    /// x86-64 with AVX2, BMI1 and POPCNT, found at run time. Only [`Isa::detect`] makes it.
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

    /// Bit i: the ray meets box i at some t in [0, t_max]; and each child with where its box is entered.
    fn boxes(node: &Node, ray: &SlabRay, t_max: f32) -> (u32, [Entry; 8]);

    /// Asks for these items to be brought near the processor, if it can be asked.
    fn fetch<T>(items: &[T], range: Range<usize>);

    /// The triangles that the ray meets at 0 < t ≤ t_max < ∞.
    fn triangles(pack: &Pack, ray: &ShearRay, t_max: f32) -> Lanes;
}

/// Four triangles: `vertex[corner][axis][lane]`. Unused lanes repeat a used one.
#[repr(C, align(16))]
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pack {
    pub(crate) vertex: [[[f32; 4]; 3]; 3],
    pub(crate) primitive: [u32; 4],
}

/// What four triangles answer; lanes whose bit is not in `mask` hold nothing of meaning.
#[derive(Clone, Copy)]
pub(crate) struct Lanes {
    pub(crate) mask: u32,
    pub(crate) t: [f32; 4],
    /// Barycentric weight of the second vertex.
    pub(crate) v: [f32; 4],
    /// Barycentric weight of the third vertex.
    pub(crate) w: [f32; 4],
}

/// A ray prepared for boxes.
#[derive(Clone, Copy)]
pub(crate) struct SlabRay {
    pub(crate) origin: [f32; 3],
    /// 1 / direction; ±∞ where the ray is parallel to a pair of sides. In the plane of one of them its entry is 0 · ∞ = NaN,
    /// which the minima and maxima of the box test leave out.
    pub(crate) reciprocal: [f32; 3],
    /// Per axis: 1 if the ray runs downwards and enters through the high side.
    pub(crate) entry: [usize; 3],
}

impl SlabRay {
    #[inline(always)]
    pub(crate) fn new(ray: &Ray) -> SlabRay {
        let reciprocal = ray.direction.recip().to_array();
        SlabRay {
            origin: ray.origin.to_array(),
            reciprocal,
            entry: reciprocal.map(|r| usize::from(r < 0.0)),
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
        let d = ray.direction.to_array();
        let size = d.map(f32::abs);
        // Which it is cannot be predicted; so nothing branches on it.
        let (x_or_y, larger) = if size[0] > size[1] { (0, size[0]) } else { (1, size[1]) };
        let z = if larger > size[2] { x_or_y } else { 2 };
        let axes = [[1, 2, 0], [2, 0, 1], [0, 1, 2]][z];
        let shear = Vec3A::new(d[axes[0]], d[axes[1]], 1.0) / d[z];
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

    #[inline(always)]
    fn boxes(node: &Node, ray: &SlabRay, t_max: f32) -> (u32, [Entry; 8]) {
        let plane = |axis: usize, far: usize, lane: usize| {
            let side = node.bounds[2 * axis + (ray.entry[axis] ^ far)][lane];
            (side - ray.origin[axis]) * ray.reciprocal[axis]
        };
        let mut near = [0.0; 8];
        let mut far = [0.0; 8];
        for lane in 0..8 {
            let (near, far) = (&mut near[lane], &mut far[lane]);
            *far = t_max;
            for axis in 0..3 {
                *near = max(plane(axis, 0, lane), *near);
                *far = min(plane(axis, 1, lane), *far);
            }
        }
        let mask =
            (0..8).map(|lane| u32::from(near[lane] <= far[lane] * SLAB_MARGIN) << lane).sum();
        (mask, std::array::from_fn(|slot| Entry::new(node.child[slot], near[slot])))
    }

    #[inline(always)]
    fn fetch<T>(_items: &[T], _range: Range<usize>) {}

    /// With A, B, C the vertices in the ray's sheared space, seen along the ray:
    ///
    /// U = Cx·By − Cy·Bx, V = Ax·Cy − Ay·Cx, W = Bx·Ay − By·Ax; inside if no two have opposite signs;
    /// t = (U·Az + V·Bz + W·Cz) / (U + V + W).
    ///
    /// Rounding is monotonic, so a difference of two rounded products has the exact sign or is zero. Where it is zero, double
    /// precision, which holds the products exactly, decides; what is zero then counts as inside for both triangles at
    /// the edge. Hence no ray slips between triangles that share vertices.
    #[inline(always)]
    fn triangles(pack: &Pack, ray: &ShearRay, t_max: f32) -> Lanes {
        let [kx, ky, kz] = ray.axes;
        let [sx, sy, sz] = ray.shear;
        let mut lanes = Lanes { mask: 0, t: [0.0; 4], v: [0.0; 4], w: [0.0; 4] };
        for lane in 0..4 {
            let sheared = |corner: usize| {
                let from_origin = |axis: usize| pack.vertex[corner][axis][lane] - ray.origin[axis];
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
