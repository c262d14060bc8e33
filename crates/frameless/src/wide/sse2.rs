//! Four lanes in a register that every x86-64 processor has.

use core::arch::x86_64::*;

#[derive(Clone, Copy, Debug)]
pub(super) struct F4(__m128);

#[derive(Clone, Copy, Debug)]
pub(super) struct M4(__m128i);

// SAFETY of all that follows: every x86-64 processor has SSE2; where memory is read or written, arrays of four are.
impl F4 {
    #[inline(always)]
    pub(super) fn splat(x: f32) -> F4 {
        unsafe { F4(_mm_set1_ps(x)) }
    }

    #[inline(always)]
    pub(super) fn new([a, b, c, d]: [f32; 4]) -> F4 {
        unsafe { F4(_mm_setr_ps(a, b, c, d)) }
    }

    #[inline(always)]
    pub(super) fn load(lanes: &[f32; 4]) -> F4 {
        F4(unsafe { _mm_loadu_ps(lanes.as_ptr()) })
    }

    #[inline(always)]
    pub(super) fn transposed(rows: [&[f32; 4]; 4]) -> [F4; 4] {
        let [a, b, c, d] = rows.map(|row| F4::load(row).0);
        unsafe {
            let (ab01, cd01) = (_mm_unpacklo_ps(a, b), _mm_unpacklo_ps(c, d));
            let (ab23, cd23) = (_mm_unpackhi_ps(a, b), _mm_unpackhi_ps(c, d));
            [
                _mm_movelh_ps(ab01, cd01),
                _mm_movehl_ps(cd01, ab01),
                _mm_movelh_ps(ab23, cd23),
                _mm_movehl_ps(cd23, ab23),
            ]
            .map(F4)
        }
    }

    #[inline(always)]
    pub(super) fn lanes(self) -> [f32; 4] {
        let mut lanes = [0.0; 4];
        unsafe { _mm_storeu_ps(lanes.as_mut_ptr(), self.0) };
        lanes
    }

    #[inline(always)]
    pub(super) fn less_than(self, other: F4) -> M4 {
        unsafe { M4(_mm_castps_si128(_mm_cmplt_ps(self.0, other.0))) }
    }

    #[inline(always)]
    pub(super) fn truncated(self) -> M4 {
        unsafe { M4(_mm_cvttps_epi32(self.0)) }
    }

    #[inline(always)]
    pub(super) fn or(self, mask: M4, other: F4) -> F4 {
        unsafe {
            let mask = _mm_castsi128_ps(mask.0);
            F4(_mm_or_ps(_mm_and_ps(mask, self.0), _mm_andnot_ps(mask, other.0)))
        }
    }

    #[inline(always)]
    pub(super) fn add(self, other: F4) -> F4 {
        unsafe { F4(_mm_add_ps(self.0, other.0)) }
    }

    #[inline(always)]
    pub(super) fn sub(self, other: F4) -> F4 {
        unsafe { F4(_mm_sub_ps(self.0, other.0)) }
    }

    #[inline(always)]
    pub(super) fn mul(self, other: F4) -> F4 {
        unsafe { F4(_mm_mul_ps(self.0, other.0)) }
    }

    #[inline(always)]
    pub(super) fn div(self, other: F4) -> F4 {
        unsafe { F4(_mm_div_ps(self.0, other.0)) }
    }
}

impl M4 {
    #[inline(always)]
    pub(super) fn splat(x: u32) -> M4 {
        unsafe { M4(_mm_set1_epi32(x as i32)) }
    }

    #[inline(always)]
    pub(super) fn load(lanes: &[u32; 4]) -> M4 {
        M4(unsafe { _mm_loadu_si128(lanes.as_ptr().cast()) })
    }

    #[inline(always)]
    pub(super) fn lanes(self) -> [u32; 4] {
        let mut lanes = [0; 4];
        unsafe { _mm_storeu_si128(lanes.as_mut_ptr().cast(), self.0) };
        lanes
    }

    #[inline(always)]
    pub(super) fn equals(self, other: M4) -> M4 {
        unsafe { M4(_mm_cmpeq_epi32(self.0, other.0)) }
    }

    #[inline(always)]
    pub(super) fn less_than(self, other: M4) -> M4 {
        unsafe { M4(_mm_cmplt_epi32(self.0, other.0)) }
    }

    #[inline(always)]
    pub(super) fn and(self, other: M4) -> M4 {
        unsafe { M4(_mm_and_si128(self.0, other.0)) }
    }

    #[inline(always)]
    pub(super) fn either(self, other: M4) -> M4 {
        unsafe { M4(_mm_or_si128(self.0, other.0)) }
    }

    #[inline(always)]
    pub(super) fn plus(self, other: M4) -> M4 {
        unsafe { M4(_mm_add_epi32(self.0, other.0)) }
    }

    #[inline(always)]
    pub(super) fn minus(self, other: M4) -> M4 {
        unsafe { M4(_mm_sub_epi32(self.0, other.0)) }
    }

    /// The even lanes' products and the odd ones', put together again.
    #[inline(always)]
    pub(super) fn times(self, other: M4) -> M4 {
        unsafe {
            let even = _mm_mul_epu32(self.0, other.0);
            let odd = _mm_mul_epu32(_mm_srli_epi64::<32>(self.0), _mm_srli_epi64::<32>(other.0));
            M4(_mm_unpacklo_epi32(
                _mm_shuffle_epi32::<0b00_00_10_00>(even),
                _mm_shuffle_epi32::<0b00_00_10_00>(odd),
            ))
        }
    }

    #[inline(always)]
    pub(super) fn to_f32(self) -> F4 {
        unsafe { F4(_mm_cvtepi32_ps(self.0)) }
    }

    #[inline(always)]
    pub(super) fn bits(self) -> u32 {
        unsafe { _mm_movemask_ps(_mm_castsi128_ps(self.0)) as u32 }
    }
}
