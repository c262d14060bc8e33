//! 256-bit registers.

use core::arch::x86_64::*;

use super::Unit;

/// Processors with AVX2. Its methods must only run inside [`super::run`], which asks for it.
#[derive(Clone, Copy)]
pub(crate) struct Avx2;

// SAFETY of all that follows: the processor has AVX2; where memory is read or written, arrays of eight are.
impl Unit for Avx2 {
    type F = __m256;
    type M = __m256i;

    #[inline(always)]
    fn splat_f(x: f32) -> __m256 {
        unsafe { _mm256_set1_ps(x) }
    }

    #[inline(always)]
    fn load_f(lanes: &[f32; 8]) -> __m256 {
        unsafe { _mm256_loadu_ps(lanes.as_ptr()) }
    }

    #[inline(always)]
    fn store_f(a: __m256, lanes: &mut [f32; 8]) {
        unsafe { _mm256_storeu_ps(lanes.as_mut_ptr(), a) }
    }

    #[inline(always)]
    fn four_columns(rows: [&[f32; 4]; 8]) -> [__m256; 4] {
        unsafe { columns(rows, 0) }
    }

    #[inline(always)]
    fn six_columns(rows: [&[f32; 6]; 8]) -> [__m256; 6] {
        unsafe {
            let [a, b, _, _] = columns(rows, 0);
            let [c, d, e, f] = columns(rows, 2);
            [a, b, c, d, e, f]
        }
    }

    #[inline(always)]
    fn triples([a, b, c]: [__m256; 3]) -> [[f32; 3]; 8] {
        let mut triples = [[0.0; 3]; 8];
        unsafe {
            // By halves: a0 a2 b0 b2; b1 b3 c1 c3; c0 c2 a1 a3.
            let ab = _mm256_shuffle_ps::<0b10_00_10_00>(a, b);
            let bc = _mm256_shuffle_ps::<0b11_01_11_01>(b, c);
            let ca = _mm256_shuffle_ps::<0b11_01_10_00>(c, a);
            let parts = [
                _mm256_shuffle_ps::<0b10_00_10_00>(ab, ca),
                _mm256_shuffle_ps::<0b11_01_10_00>(bc, ab),
                _mm256_shuffle_ps::<0b11_01_11_01>(ca, bc),
            ];
            let to = triples.as_mut_ptr().cast::<f32>();
            for (k, part) in parts.into_iter().enumerate() {
                _mm_storeu_ps(to.add(4 * k), _mm256_castps256_ps128(part));
                _mm_storeu_ps(to.add(12 + 4 * k), _mm256_extractf128_ps::<1>(part));
            }
        }
        triples
    }

    #[inline(always)]
    fn of_triples(triples: &[[f32; 3]; 8]) -> [__m256; 3] {
        let from = triples.as_ptr().cast::<f32>();
        unsafe {
            // By halves: x0 y0 z0 x1; y1 z1 x2 y2; z2 x3 y3 z3.
            let part = |k: usize| {
                let low = _mm256_castps128_ps256(_mm_loadu_ps(from.add(4 * k)));
                _mm256_insertf128_ps::<1>(low, _mm_loadu_ps(from.add(12 + 4 * k)))
            };
            let (first, second, third) = (part(0), part(1), part(2));
            // x2 y2 x3 y3; y0 z0 y1 z1.
            let xy = _mm256_shuffle_ps::<0b10_01_11_10>(second, third);
            let yz = _mm256_shuffle_ps::<0b01_00_10_01>(first, second);
            [
                _mm256_shuffle_ps::<0b10_00_11_00>(first, xy),
                _mm256_shuffle_ps::<0b11_01_10_00>(yz, xy),
                _mm256_shuffle_ps::<0b11_00_11_01>(yz, third),
            ]
        }
    }

    #[inline(always)]
    fn to_bits(a: __m256) -> __m256i {
        unsafe { _mm256_castps_si256(a) }
    }

    #[inline(always)]
    fn from_bits(a: __m256i) -> __m256 {
        unsafe { _mm256_castsi256_ps(a) }
    }

    #[inline(always)]
    fn add_f(a: __m256, b: __m256) -> __m256 {
        unsafe { _mm256_add_ps(a, b) }
    }

    #[inline(always)]
    fn sub_f(a: __m256, b: __m256) -> __m256 {
        unsafe { _mm256_sub_ps(a, b) }
    }

    #[inline(always)]
    fn mul_f(a: __m256, b: __m256) -> __m256 {
        unsafe { _mm256_mul_ps(a, b) }
    }

    #[inline(always)]
    fn div_f(a: __m256, b: __m256) -> __m256 {
        unsafe { _mm256_div_ps(a, b) }
    }

    #[inline(always)]
    fn sqrt_f(a: __m256) -> __m256 {
        unsafe { _mm256_sqrt_ps(a) }
    }

    #[inline(always)]
    fn less_than_f(a: __m256, b: __m256) -> __m256i {
        unsafe { _mm256_castps_si256(_mm256_cmp_ps::<_CMP_LT_OQ>(a, b)) }
    }

    #[inline(always)]
    fn select_f(mask: __m256i, a: __m256, b: __m256) -> __m256 {
        unsafe { _mm256_blendv_ps(b, a, _mm256_castsi256_ps(mask)) }
    }

    #[inline(always)]
    fn truncated(a: __m256) -> __m256i {
        unsafe { _mm256_cvttps_epi32(a) }
    }

    #[inline(always)]
    fn splat_m(x: u32) -> __m256i {
        unsafe { _mm256_set1_epi32(x as i32) }
    }

    #[inline(always)]
    fn load_m(lanes: &[u32; 8]) -> __m256i {
        unsafe { _mm256_loadu_si256(lanes.as_ptr().cast()) }
    }

    #[inline(always)]
    fn store_m(a: __m256i, lanes: &mut [u32; 8]) {
        unsafe { _mm256_storeu_si256(lanes.as_mut_ptr().cast(), a) }
    }

    #[inline(always)]
    fn equals(a: __m256i, b: __m256i) -> __m256i {
        unsafe { _mm256_cmpeq_epi32(a, b) }
    }

    #[inline(always)]
    fn less_than_m(a: __m256i, b: __m256i) -> __m256i {
        unsafe { _mm256_cmpgt_epi32(b, a) }
    }

    #[inline(always)]
    fn select_m(mask: __m256i, a: __m256i, b: __m256i) -> __m256i {
        unsafe { _mm256_blendv_epi8(b, a, mask) }
    }

    #[inline(always)]
    fn not(a: __m256i) -> __m256i {
        unsafe { _mm256_xor_si256(a, _mm256_set1_epi32(-1)) }
    }

    #[inline(always)]
    fn and(a: __m256i, b: __m256i) -> __m256i {
        unsafe { _mm256_and_si256(a, b) }
    }

    #[inline(always)]
    fn either(a: __m256i, b: __m256i) -> __m256i {
        unsafe { _mm256_or_si256(a, b) }
    }

    #[inline(always)]
    fn plus(a: __m256i, b: __m256i) -> __m256i {
        unsafe { _mm256_add_epi32(a, b) }
    }

    #[inline(always)]
    fn minus(a: __m256i, b: __m256i) -> __m256i {
        unsafe { _mm256_sub_epi32(a, b) }
    }

    #[inline(always)]
    fn times(a: __m256i, b: __m256i) -> __m256i {
        unsafe { _mm256_mullo_epi32(a, b) }
    }

    #[inline(always)]
    fn shifted_left<const BITS: i32>(a: __m256i) -> __m256i {
        unsafe { _mm256_slli_epi32::<BITS>(a) }
    }

    #[inline(always)]
    fn shifted_right<const BITS: i32>(a: __m256i) -> __m256i {
        unsafe { _mm256_srai_epi32::<BITS>(a) }
    }

    #[inline(always)]
    fn to_f32(a: __m256i) -> __m256 {
        unsafe { _mm256_cvtepi32_ps(a) }
    }

    #[inline(always)]
    fn bits(a: __m256i) -> u32 {
        unsafe { _mm256_movemask_ps(_mm256_castsi256_ps(a)) as u32 }
    }
}

/// Columns `first` to `first` + 3, half by half, since 256-bit shuffles do not cross the middle.
///
/// # Safety
/// The processor has AVX2, and there are as many columns.
#[inline(always)]
unsafe fn columns<const N: usize>(rows: [&[f32; N]; 8], first: usize) -> [__m256; 4] {
    unsafe {
        let [a, b, c, d, e, f, g, h] = rows;
        let pair = |low: &[f32; N], high: &[f32; N]| {
            let low = _mm256_castps128_ps256(_mm_loadu_ps(low.as_ptr().add(first)));
            _mm256_insertf128_ps::<1>(low, _mm_loadu_ps(high.as_ptr().add(first)))
        };
        let (ae, bf, cg, dh) = (pair(a, e), pair(b, f), pair(c, g), pair(d, h));
        let (ab_low, cd_low) = (_mm256_unpacklo_ps(ae, bf), _mm256_unpacklo_ps(cg, dh));
        let (ab_high, cd_high) = (_mm256_unpackhi_ps(ae, bf), _mm256_unpackhi_ps(cg, dh));
        [
            _mm256_shuffle_ps::<0b01_00_01_00>(ab_low, cd_low),
            _mm256_shuffle_ps::<0b11_10_11_10>(ab_low, cd_low),
            _mm256_shuffle_ps::<0b01_00_01_00>(ab_high, cd_high),
            _mm256_shuffle_ps::<0b11_10_11_10>(ab_high, cd_high),
        ]
    }
}
