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

    /// Half by half, since 256-bit shuffles do not cross the middle.
    #[inline(always)]
    fn columns([a, b, c, d, e, f, g, h]: [&[f32; 4]; 8]) -> [__m256; 4] {
        unsafe {
            let pair = |low: &[f32; 4], high: &[f32; 4]| {
                let low = _mm256_castps128_ps256(_mm_loadu_ps(low.as_ptr()));
                _mm256_insertf128_ps::<1>(low, _mm_loadu_ps(high.as_ptr()))
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
    fn to_f32(a: __m256i) -> __m256 {
        unsafe { _mm256_cvtepi32_ps(a) }
    }

    #[inline(always)]
    fn bits(a: __m256i) -> u32 {
        unsafe { _mm256_movemask_ps(_mm256_castsi256_ps(a)) as u32 }
    }
}
