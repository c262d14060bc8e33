//! The two inner tests with AVX2 intrinsics. The one place of this crate with `unsafe` code.
//!
//! SAFETY, once for all: every intrinsic needs the processor to have AVX2. The methods of [`Avx2`] are reached only from
//! [`with`], whose caller holds a [`Detected`], and only [`Detected::new`] makes one, after asking the processor. Loads read
//! whole rows of `Node` (aligned to 64, rows of 32 bytes, the last of which is its children, 4 bytes each) and `Pack` (aligned to 16, rows of 16 bytes), inside the arrays; eight
//! [`Entry`] are eight numbers of 64 bits.
//! The methods are `inline(always)` so that they end up inside [`with`], where these instructions may be emitted.
#![allow(unsafe_code)]

use std::arch::x86_64::*;
use std::ops::Range;

use super::{Eight, Kernel, Lanes, Pack, Portable, SLAB_MARGIN, ShearRay, SlabRay};
use crate::traverse::Entry;
use crate::wide::Node;

/// Proof that the processor has what [`Avx2`] needs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Detected(());

impl Detected {
    pub(crate) fn new() -> Option<Detected> {
        (is_x86_feature_detected!("avx2")
            && is_x86_feature_detected!("bmi1")
            && is_x86_feature_detected!("popcnt"))
        .then_some(Detected(()))
    }
}

/// Something to be compiled for AVX2.
pub(crate) trait Task {
    type Output;
    /// Must be `inline(always)`.
    fn run(self) -> Self::Output;
}

/// Run a task with AVX2 code.
#[inline]
pub(crate) fn with<T: Task>(_proof: Detected, task: T) -> T::Output {
    #[target_feature(enable = "avx2,bmi1,popcnt")]
    fn run<T: Task>(task: T) -> T::Output {
        task.run()
    }
    // SAFETY: see the module; the proof says that the processor has the features.
    unsafe { run(task) }
}

/// Only for code that runs inside [`with`].
pub(crate) struct Avx2;

/// Eight numbers in a register.
#[derive(Clone, Copy)]
pub(crate) struct Avx2Eight(__m256);

macro_rules! eight {
    ($($name:ident: $intrinsic:ident;)*) => {$(
        #[inline(always)]
        fn $name(self, other: Self) -> Self {
            // SAFETY: see the module.
            Avx2Eight(unsafe { $intrinsic(self.0, other.0) })
        }
    )*};
}

impl Eight for Avx2Eight {
    #[inline(always)]
    fn splat(x: f32) -> Self {
        // SAFETY: see the module.
        Avx2Eight(unsafe { _mm256_set1_ps(x) })
    }

    #[inline(always)]
    fn load(from: &[f32; 8]) -> Self {
        // SAFETY: see the module.
        Avx2Eight(unsafe { _mm256_loadu_ps(from.as_ptr()) })
    }

    #[inline(always)]
    fn store(self) -> [f32; 8] {
        let mut to = [0.0; 8];
        // SAFETY: see the module.
        unsafe { _mm256_storeu_ps(to.as_mut_ptr(), self.0) };
        to
    }

    eight! {
        add: _mm256_add_ps;
        sub: _mm256_sub_ps;
        mul: _mm256_mul_ps;
        div: _mm256_div_ps;
        min: _mm256_min_ps;
        max: _mm256_max_ps;
    }

    #[inline(always)]
    fn at_most(self, other: Self) -> u32 {
        // SAFETY: see the module.
        unsafe { _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LE_OQ>(self.0, other.0)) as u32 }
    }

    #[inline(always)]
    fn equals(self, other: Self) -> u32 {
        // SAFETY: see the module.
        unsafe { _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_EQ_OQ>(self.0, other.0)) as u32 }
    }
}

impl Kernel for Avx2 {
    type Eight = Avx2Eight;

    #[inline(always)]
    fn boxes(node: &Node, ray: &SlabRay, t_max: f32) -> (u32, [Entry; 8]) {
        // SAFETY: see the module.
        unsafe {
            let plane = |axis: usize, far: usize| {
                // Masked, so that the compiler knows that the row is there.
                let row = &node.bounds[2 * axis + ((ray.entry[axis] ^ far) & 1)];
                let from_origin =
                    _mm256_sub_ps(_mm256_load_ps(row.as_ptr()), _mm256_set1_ps(ray.origin[axis]));
                _mm256_mul_ps(from_origin, _mm256_set1_ps(ray.reciprocal[axis]))
            };
            let (mut near, mut far) = (_mm256_setzero_ps(), _mm256_set1_ps(t_max));
            for axis in 0..3 {
                near = _mm256_max_ps(plane(axis, 0), near);
                far = _mm256_min_ps(plane(axis, 1), far);
            }
            let far = _mm256_mul_ps(far, _mm256_set1_ps(SLAB_MARGIN));
            let mask = _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LE_OQ>(near, far)) as u32;
            // Pairs of slots in the order 0 2 1 3, so that interleaving within halves gives all in order.
            let in_halves = |row| _mm256_permute4x64_epi64::<0b11_01_10_00>(row);
            let child = in_halves(_mm256_load_si256(node.child.as_ptr().cast()));
            let near = in_halves(_mm256_castps_si256(near));
            let mut entries = [Entry::ROOT; 8];
            let to = entries.as_mut_ptr().cast::<__m256i>();
            _mm256_storeu_si256(to, _mm256_unpacklo_epi32(child, near));
            _mm256_storeu_si256(to.add(1), _mm256_unpackhi_epi32(child, near));
            (mask, entries)
        }
    }

    #[inline(always)]
    fn fetch<T>(items: &[T], range: Range<usize>) {
        /// Bytes that come at once.
        const LINE: usize = 64;
        let first = items.as_ptr().wrapping_add(range.start).cast::<i8>();
        for line in 0..(range.len() * size_of::<T>()).div_ceil(LINE) {
            // SAFETY: see the module; a hint about any address is harmless.
            unsafe { _mm_prefetch::<_MM_HINT_T0>(first.wrapping_add(line * LINE)) };
        }
    }

    #[inline(always)]
    fn triangles(pack: &Pack, ray: &ShearRay, t_max: f32) -> Lanes {
        let [kx, ky, kz] = ray.axes;
        // SAFETY: see the module.
        unsafe {
            let [sx, sy, sz] = ray.shear.map(|s| _mm_set1_ps(s));
            let sheared = |corner: usize| {
                let from_origin = |axis: usize| {
                    let row = _mm_load_ps(pack.vertex[corner][axis].as_ptr());
                    _mm_sub_ps(row, _mm_set1_ps(ray.origin[axis]))
                };
                let z = from_origin(kz);
                (
                    _mm_sub_ps(from_origin(kx), _mm_mul_ps(sx, z)),
                    _mm_sub_ps(from_origin(ky), _mm_mul_ps(sy, z)),
                    _mm_mul_ps(sz, z),
                )
            };
            let (ax, ay, az) = sheared(0);
            let (bx, by, bz) = sheared(1);
            let (cx, cy, cz) = sheared(2);
            let u = _mm_sub_ps(_mm_mul_ps(cx, by), _mm_mul_ps(cy, bx));
            let v = _mm_sub_ps(_mm_mul_ps(ax, cy), _mm_mul_ps(ay, cx));
            let w = _mm_sub_ps(_mm_mul_ps(bx, ay), _mm_mul_ps(by, ax));
            let zero = _mm_setzero_ps();
            let least = _mm_min_ps(u, _mm_min_ps(v, w));
            let most = _mm_max_ps(u, _mm_max_ps(v, w));
            let inside = _mm_or_ps(_mm_cmpge_ps(least, zero), _mm_cmple_ps(most, zero));
            let mut lanes = Lanes { mask: 0, t: [0.0; 4], v: [0.0; 4], w: [0.0; 4] };
            if _mm_movemask_ps(inside) == 0 {
                return lanes;
            }
            let on_edge = _mm_or_ps(
                _mm_cmpeq_ps(u, zero),
                _mm_or_ps(_mm_cmpeq_ps(v, zero), _mm_cmpeq_ps(w, zero)),
            );
            if _mm_movemask_ps(_mm_and_ps(inside, on_edge)) != 0 {
                // Rare, and decided in double precision.
                return Portable::triangles(pack, ray, t_max);
            }
            let determinant = _mm_add_ps(_mm_add_ps(u, v), w);
            let inverse = _mm_div_ps(_mm_set1_ps(1.0), determinant);
            let sum = _mm_add_ps(_mm_mul_ps(u, az), _mm_mul_ps(v, bz));
            let t = _mm_mul_ps(_mm_add_ps(sum, _mm_mul_ps(w, cz)), inverse);
            let in_range = _mm_and_ps(_mm_cmpgt_ps(t, zero), _mm_cmple_ps(t, _mm_set1_ps(t_max)));
            let hit = _mm_and_ps(_mm_and_ps(inside, _mm_cmpneq_ps(determinant, zero)), in_range);
            lanes.mask = _mm_movemask_ps(hit) as u32;
            if lanes.mask != 0 {
                _mm_storeu_ps(lanes.t.as_mut_ptr(), t);
                _mm_storeu_ps(lanes.v.as_mut_ptr(), _mm_mul_ps(v, inverse));
                _mm_storeu_ps(lanes.w.as_mut_ptr(), _mm_mul_ps(w, inverse));
            }
            lanes
        }
    }
}
