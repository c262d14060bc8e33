//! The two inner tests, and the steps of rays by turns, with AVX2 intrinsics.
//!
//! SAFETY, once for all: every intrinsic needs the processor to have AVX2. The methods of [`Avx2`] are reached only from
//! [`with`], whose caller holds a [`Detected`], and only [`Detected::new`] makes one, after asking the processor. Loads read
//! whole rows of [`Node`] (8 bytes; and its children, 4 bytes each, aligned to 32) and, of the [`LONGEST`] words of a [`Leaf`], the first and
//! the 32 bits from byte 2 on, and eight numbers from x, y and z of its first vertex on: at most from word 6 + 2 · 8 on, by how its methods
//! mask what they read; of a node also two rows at once, of a [`BoxRay`], which is aligned to 64, four numbers and sixteen bytes. Eight
//! [`Entry`] are eight numbers of 64 bits. Stores for rays by turns write arrays of eight.
//! The methods are `inline(always)` so that they end up inside [`with`], where these instructions may be emitted.
#![allow(unsafe_code)]

use std::arch::x86_64::*;

use super::turns::{BoxRay, Turns, Waiting, keep_one_by_one};
use super::{Eight, Kernel, Lanes, Portable, SLAB_MARGIN_ULPS, ShearRay, SlabRay, avx512};
#[cfg(doc)]
use crate::leaf::LONGEST;
use crate::leaf::Leaf;
use crate::traverse::Entry;
use crate::wide::Node;

/// Proof that the processor has what [`Avx2`] needs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Detected {
    /// What rays that are walked by turns take instead.
    pub(crate) wider: Option<avx512::Detected>,
}

impl Detected {
    pub(crate) fn new() -> Option<Detected> {
        let has_all = is_x86_feature_detected!("avx2")
            && is_x86_feature_detected!("fma")
            && is_x86_feature_detected!("bmi1")
            && is_x86_feature_detected!("popcnt");
        has_all.then(|| Detected { wider: avx512::Detected::new() })
    }
}

#[cfg(test)]
impl Detected {
    pub(crate) fn without_wider(self) -> Detected {
        Detected { wider: None }
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
    #[target_feature(enable = "avx2,fma,bmi1,popcnt")]
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
    fn boxes(node: &Node, ray: &SlabRay, t_max: f32) -> (u32, Avx2Eight) {
        // SAFETY: see the module.
        unsafe {
            let reciprocal = ray.reciprocal.into();
            let step = _mm_mul_ps(_mm_loadu_ps(node.step().as_ptr()), reciprocal);
            let origin = _mm_loadu_ps(node.origin().as_ptr());
            let first = _mm_mul_ps(_mm_sub_ps(origin, ray.origin.into()), reciprocal);
            let (mut near, mut far) = (_mm256_setzero_ps(), _mm256_set1_ps(t_max));
            for axis in 0..3 {
                let (step, first) = (splat_axis(step, axis), splat_axis(first, axis));
                // Masked, so that the compiler knows that the rows are there.
                let enters = counts(node, 2 * axis + (ray.entry[axis] & 1));
                let leaves = counts(node, 2 * axis + (ray.entry[axis] & 1 ^ 1));
                near = _mm256_max_ps(_mm256_fmadd_ps(enters, step, first), near);
                far = _mm256_min_ps(_mm256_fmadd_ps(leaves, step, first), far);
            }
            let [near_bits, far_bits] = [near, far].map(|t| _mm256_castps_si256(t));
            let far_bits = _mm256_add_epi32(far_bits, _mm256_set1_epi32(SLAB_MARGIN_ULPS));
            let meets = _mm256_castsi256_ps(_mm256_cmpgt_epi32(far_bits, near_bits));
            (_mm256_movemask_ps(meets) as u32 & node.used(), Avx2Eight(near))
        }
    }

    #[inline(always)]
    fn entries(node: &Node, near: Avx2Eight) -> [Entry; 8] {
        // SAFETY: see the module.
        unsafe {
            // Pairs of slots in the order 0 2 1 3, so that interleaving within halves gives all in order.
            const IN_HALVES: i32 = 0b11_01_10_00;
            let child = _mm256_load_si256(node.child.as_ptr().cast());
            let child = _mm256_permute4x64_epi64::<IN_HALVES>(child);
            let near = _mm256_permute4x64_epi64::<IN_HALVES>(_mm256_castps_si256(near.0));
            let mut entries = [Entry::ROOT; 8];
            let to = entries.as_mut_ptr().cast::<__m256i>();
            _mm256_storeu_si256(to, _mm256_unpacklo_epi32(child, near));
            _mm256_storeu_si256(to.add(1), _mm256_unpackhi_epi32(child, near));
            entries
        }
    }

    #[inline(always)]
    fn planes(node: &Node, row: usize) -> Avx2Eight {
        // SAFETY: see the module.
        Avx2Eight(unsafe {
            let axis = row / 2 % 3;
            let step = _mm256_set1_ps(node.step()[axis]);
            let from_origin = _mm256_mul_ps(counts(node, row), step);
            _mm256_add_ps(_mm256_set1_ps(node.origin()[axis]), from_origin)
        })
    }

    #[inline(always)]
    fn fetch(place: *const u8) {
        /// Bytes that come at once.
        const LINE: usize = 64;
        // SAFETY: see the module; a hint about any address is harmless.
        unsafe {
            _mm_prefetch::<_MM_HINT_T0>(place.cast());
            _mm_prefetch::<_MM_HINT_T0>(place.wrapping_add(LINE).cast());
        }
    }

    #[inline(always)]
    fn triangles(leaf: Leaf<'_>, ray: &ShearRay, t_max: f32) -> Lanes {
        triangles::<true>(leaf, ray, t_max)
    }
}

impl Turns for Avx2 {
    #[inline(always)]
    fn descend<const ANY: bool>(node: &Node, ray: &BoxRay, t_max: f32, waiting: &mut Waiting) {
        // SAFETY: see the module.
        unsafe {
            let reciprocal = _mm_load_ps(ray.reciprocal.as_ptr());
            let from_ray = _mm_loadu_ps(node.origin().as_ptr());
            let from_ray = _mm_sub_ps(from_ray, _mm_load_ps(ray.origin.as_ptr()));
            let first = _mm_mul_ps(from_ray, reciprocal);
            let step = _mm_mul_ps(_mm_loadu_ps(node.step().as_ptr()), reciprocal);
            let (mut near, mut far) = (_mm256_setzero_ps(), _mm256_set1_ps(t_max));
            for axis in 0..3 {
                let (step, first) = (splat_axis(step, axis), splat_axis(first, axis));
                let rows = _mm_loadu_si128(ray.rows[axis].as_ptr().cast());
                let counts = _mm_loadu_si128(node.counts_of(axis).as_ptr().cast());
                let enters = _mm_shuffle_epi8(counts, rows);
                let leaves = _mm_unpackhi_epi64(enters, enters);
                let enters = _mm256_cvtepi32_ps(_mm256_cvtepu8_epi32(enters));
                let leaves = _mm256_cvtepi32_ps(_mm256_cvtepu8_epi32(leaves));
                near = _mm256_max_ps(_mm256_fmadd_ps(enters, step, first), near);
                far = _mm256_min_ps(_mm256_fmadd_ps(leaves, step, first), far);
            }
            let [near, far] = [near, far].map(|t| _mm256_castps_si256(t));
            let far = _mm256_add_epi32(far, _mm256_set1_epi32(SLAB_MARGIN_ULPS));
            let child = _mm256_load_si256(node.child.as_ptr().cast());
            let unused = _mm256_set1_epi32(Node::UNUSED.bits() as i32);
            let misses = _mm256_cmpeq_epi32(child, unused);
            let meets = _mm256_andnot_si256(misses, _mm256_cmpgt_epi32(far, near));
            let count = _mm256_movemask_ps(_mm256_castsi256_ps(meets)).count_ones() as usize;
            let slot = _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7);
            let key = _mm256_or_si256(_mm256_andnot_si256(_mm256_set1_epi32(7), near), slot);
            // The least are those that are not met.
            let least = _mm256_set1_epi32(-1);
            let key = sorted(_mm256_blendv_epi8(least, key, meets));
            let (near_to, child_to) = waiting.free();
            _mm256_storeu_si256(near_to.as_mut_ptr().cast(), key);
            let child = _mm256_permutevar8x32_epi32(child, key);
            _mm256_storeu_si256(child_to.as_mut_ptr().cast(), child);
            waiting.set_length(waiting.length() + count);
        }
    }

    #[inline(always)]
    fn shorten(waiting: &mut Waiting, t_max: f32) {
        keep_one_by_one(waiting, t_max);
    }

    #[inline(always)]
    fn hits(leaf: Leaf<'_>, ray: &ShearRay, t_max: f32) -> Lanes {
        triangles::<true>(leaf, ray, t_max)
    }

    #[inline(always)]
    fn ask_for(place: *const u8) {
        Avx2::fetch(place);
    }
}

/// Eight numbers, the largest first: a bitonic network (Batcher 1968, "Sorting Networks and Their Applications"), which turns halves around
/// so that all of it sorts one way.
#[inline(always)]
pub(super) unsafe fn sorted(key: __m256i) -> __m256i {
    macro_rules! exchange {
        ($key:ident, $other:expr, $least:literal) => {{
            let other = $other;
            let (most, least) = (_mm256_max_epi32($key, other), _mm256_min_epi32($key, other));
            _mm256_blend_epi32::<$least>(most, least)
        }};
    }
    // SAFETY: see the module.
    unsafe {
        let key = exchange!(key, _mm256_shuffle_epi32::<0b10_11_00_01>(key), 0b1010_1010);
        let key = exchange!(key, _mm256_shuffle_epi32::<0b00_01_10_11>(key), 0b1100_1100);
        let key = exchange!(key, _mm256_shuffle_epi32::<0b10_11_00_01>(key), 0b1010_1010);
        let turned = _mm256_permutevar8x32_epi32(key, _mm256_setr_epi32(7, 6, 5, 4, 3, 2, 1, 0));
        let key = exchange!(key, turned, 0b1111_0000);
        let key = exchange!(key, _mm256_shuffle_epi32::<0b01_00_11_10>(key), 0b1100_1100);
        exchange!(key, _mm256_shuffle_epi32::<0b10_11_00_01>(key), 0b1010_1010)
    }
}

/// Vertices are sheared once each, eight at a time; then every triangle picks its corners. `LEAVES_EARLY`: if none is hit, which cannot be
/// predicted, but is worth it for who waits for the answer.
#[inline(always)]
pub(super) fn triangles<const LEAVES_EARLY: bool>(
    leaf: Leaf<'_>,
    ray: &ShearRay,
    t_max: f32,
) -> Lanes {
    let [kx, ky, kz] = ray.axes;
    // SAFETY: see the module.
    unsafe {
        let z = from_origin(leaf, ray, kz);
        let x = from_origin(leaf, ray, kx);
        let x = _mm256_sub_ps(x, _mm256_mul_ps(_mm256_set1_ps(ray.shear[0]), z));
        let y = from_origin(leaf, ray, ky);
        let y = _mm256_sub_ps(y, _mm256_mul_ps(_mm256_set1_ps(ray.shear[1]), z));
        let (bc, ca) = (places(leaf.second_and_third()), places(leaf.third_and_first()));
        let (x_bc, x_ca) = (pick(x, bc), pick(x, ca));
        let (y_bc, y_ca) = (pick(y, bc), pick(y, ca));
        // Cx·By − Cy·Bx and Ax·Cy − Ay·Cx.
        let uv = _mm256_sub_ps(_mm256_mul_ps(x_ca, y_bc), _mm256_mul_ps(y_ca, x_bc));
        let (u, v) = (low(uv), high(uv));
        let w = _mm_sub_ps(_mm_mul_ps(low(x_bc), high(y_ca)), _mm_mul_ps(low(y_bc), high(x_ca)));
        let zero = _mm_setzero_ps();
        let least = _mm_min_ps(u, _mm_min_ps(v, w));
        let most = _mm_max_ps(u, _mm_max_ps(v, w));
        let inside = _mm_or_ps(_mm_cmpge_ps(least, zero), _mm_cmple_ps(most, zero));
        let mut lanes = Lanes::NONE;
        if LEAVES_EARLY && _mm_movemask_ps(inside) == 0 {
            return lanes;
        }
        let on_edge = _mm_or_ps(
            _mm_cmpeq_ps(u, zero),
            _mm_or_ps(_mm_cmpeq_ps(v, zero), _mm_cmpeq_ps(w, zero)),
        );
        if _mm_movemask_ps(_mm_and_ps(inside, on_edge)) != 0 {
            // Rare, and decided in double precision.
            return Portable::triangles(leaf, ray, t_max);
        }
        let z = _mm256_mul_ps(_mm256_set1_ps(ray.shear[2]), z);
        let (z_bc, az) = (pick(z, bc), high(pick(z, ca)));
        let (bz, cz) = (low(z_bc), high(z_bc));
        let determinant = _mm_add_ps(_mm_add_ps(u, v), w);
        let inverse = _mm_div_ps(_mm_set1_ps(1.0), determinant);
        let sum = _mm_add_ps(_mm_mul_ps(u, az), _mm_mul_ps(v, bz));
        let t = _mm_mul_ps(_mm_add_ps(sum, _mm_mul_ps(w, cz)), inverse);
        let in_range = _mm_and_ps(_mm_cmpgt_ps(t, zero), _mm_cmple_ps(t, _mm_set1_ps(t_max)));
        let hit = _mm_and_ps(_mm_and_ps(inside, _mm_cmpneq_ps(determinant, zero)), in_range);
        // Lanes without a triangle repeat the last one.
        lanes.mask = _mm_movemask_ps(hit) as u32 & ((1 << leaf.triangles()) - 1);
        if lanes.mask != 0 {
            _mm_storeu_ps(lanes.t.as_mut_ptr(), t);
            _mm_storeu_ps(lanes.v.as_mut_ptr(), _mm_mul_ps(v, inverse));
            _mm_storeu_ps(lanes.w.as_mut_ptr(), _mm_mul_ps(w, inverse));
        }
        lanes
    }
}

// Functions instead of closures: those cannot be made to be inlined.

/// A row of a node's counts.
///
/// SAFETY: see the module, as for all below.
#[inline(always)]
unsafe fn counts(node: &Node, row: usize) -> __m256 {
    // SAFETY: see the module.
    unsafe {
        let counts = _mm_loadl_epi64(node.counts(row).as_ptr().cast());
        _mm256_cvtepi32_ps(_mm256_cvtepu8_epi32(counts))
    }
}

#[inline(always)]
unsafe fn splat_axis(of: __m128, axis: usize) -> __m256 {
    // SAFETY: see the module.
    unsafe { _mm256_permutevar8x32_ps(_mm256_castps128_ps256(of), _mm256_set1_epi32(axis as i32)) }
}

/// Vertices along an axis, as seen from the ray's origin.
#[inline(always)]
unsafe fn from_origin(leaf: Leaf<'_>, ray: &ShearRay, axis: usize) -> __m256 {
    // SAFETY: see the module.
    unsafe {
        let axis = (axis & 3).min(2);
        let first = leaf.words().as_ptr().add(leaf.first_vertex() + axis * leaf.vertices());
        _mm256_sub_ps(_mm256_loadu_ps(first.cast()), _mm256_set1_ps(ray.origin[axis]))
    }
}

/// Four bits per lane that say which vertex, of which a permutation looks at the lower three.
#[inline(always)]
unsafe fn places(corners: u32) -> __m256i {
    // SAFETY: see the module.
    unsafe {
        let shift = _mm256_setr_epi32(0, 4, 8, 12, 16, 20, 24, 28);
        _mm256_srlv_epi32(_mm256_set1_epi32(corners as i32), shift)
    }
}

#[inline(always)]
unsafe fn pick(from: __m256, places: __m256i) -> __m256 {
    // SAFETY: see the module.
    unsafe { _mm256_permutevar8x32_ps(from, places) }
}

#[inline(always)]
unsafe fn low(of: __m256) -> __m128 {
    // SAFETY: see the module.
    unsafe { _mm256_castps256_ps128(of) }
}

#[inline(always)]
unsafe fn high(of: __m256) -> __m128 {
    // SAFETY: see the module.
    unsafe { _mm256_extractf128_ps::<1>(of) }
}
