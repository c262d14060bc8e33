//! Arrays, for the compiler to do its best with.

use super::Unit;

/// Any processor.
#[derive(Clone, Copy)]
pub(crate) struct Portable;

fn mask(is_set: bool) -> u32 {
    u32::from(is_set).wrapping_neg()
}

#[inline(always)]
fn lanes<A: Copy, B: Copy, C>(a: [A; 8], b: [B; 8], operation: impl Fn(A, B) -> C) -> [C; 8] {
    std::array::from_fn(|k| operation(a[k], b[k]))
}

impl Unit for Portable {
    type F = [f32; 8];
    type M = [u32; 8];

    #[inline(always)]
    fn splat_f(x: f32) -> [f32; 8] {
        [x; 8]
    }

    #[inline(always)]
    fn load_f(lanes: &[f32; 8]) -> [f32; 8] {
        *lanes
    }

    #[inline(always)]
    fn store_f(a: [f32; 8], lanes: &mut [f32; 8]) {
        *lanes = a;
    }

    #[inline(always)]
    fn four_columns(rows: [&[f32; 4]; 8]) -> [[f32; 8]; 4] {
        std::array::from_fn(|k| rows.map(|row| row[k]))
    }

    #[inline(always)]
    fn six_columns(rows: [&[f32; 6]; 8]) -> [[f32; 8]; 6] {
        std::array::from_fn(|k| rows.map(|row| row[k]))
    }

    #[inline(always)]
    fn triples([a, b, c]: [[f32; 8]; 3]) -> [[f32; 3]; 8] {
        std::array::from_fn(|k| [a[k], b[k], c[k]])
    }

    #[inline(always)]
    fn of_triples(triples: &[[f32; 3]; 8]) -> [[f32; 8]; 3] {
        std::array::from_fn(|k| triples.map(|triple| triple[k]))
    }

    #[inline(always)]
    fn to_bits(a: [f32; 8]) -> [u32; 8] {
        a.map(f32::to_bits)
    }

    #[inline(always)]
    fn from_bits(a: [u32; 8]) -> [f32; 8] {
        a.map(f32::from_bits)
    }

    #[inline(always)]
    fn add_f(a: [f32; 8], b: [f32; 8]) -> [f32; 8] {
        lanes(a, b, |a, b| a + b)
    }

    #[inline(always)]
    fn sub_f(a: [f32; 8], b: [f32; 8]) -> [f32; 8] {
        lanes(a, b, |a, b| a - b)
    }

    #[inline(always)]
    fn mul_f(a: [f32; 8], b: [f32; 8]) -> [f32; 8] {
        lanes(a, b, |a, b| a * b)
    }

    #[inline(always)]
    fn div_f(a: [f32; 8], b: [f32; 8]) -> [f32; 8] {
        lanes(a, b, |a, b| a / b)
    }

    #[inline(always)]
    fn sqrt_f(a: [f32; 8]) -> [f32; 8] {
        a.map(f32::sqrt)
    }

    #[inline(always)]
    fn less_than_f(a: [f32; 8], b: [f32; 8]) -> [u32; 8] {
        lanes(a, b, |a, b| mask(a < b))
    }

    #[inline(always)]
    fn select_f(mask: [u32; 8], a: [f32; 8], b: [f32; 8]) -> [f32; 8] {
        std::array::from_fn(|k| if mask[k] == 0 { b[k] } else { a[k] })
    }

    #[inline(always)]
    fn truncated(a: [f32; 8]) -> [u32; 8] {
        a.map(|a| a as i32 as u32)
    }

    #[inline(always)]
    fn splat_m(x: u32) -> [u32; 8] {
        [x; 8]
    }

    #[inline(always)]
    fn load_m(lanes: &[u32; 8]) -> [u32; 8] {
        *lanes
    }

    #[inline(always)]
    fn store_m(a: [u32; 8], lanes: &mut [u32; 8]) {
        *lanes = a;
    }

    #[inline(always)]
    fn equals(a: [u32; 8], b: [u32; 8]) -> [u32; 8] {
        lanes(a, b, |a, b| mask(a == b))
    }

    #[inline(always)]
    fn less_than_m(a: [u32; 8], b: [u32; 8]) -> [u32; 8] {
        lanes(a, b, |a, b| mask((a as i32) < b as i32))
    }

    #[inline(always)]
    fn select_m(mask: [u32; 8], a: [u32; 8], b: [u32; 8]) -> [u32; 8] {
        std::array::from_fn(|k| if mask[k] == 0 { b[k] } else { a[k] })
    }

    #[inline(always)]
    fn not(a: [u32; 8]) -> [u32; 8] {
        a.map(|a| !a)
    }

    #[inline(always)]
    fn and(a: [u32; 8], b: [u32; 8]) -> [u32; 8] {
        lanes(a, b, |a, b| a & b)
    }

    #[inline(always)]
    fn either(a: [u32; 8], b: [u32; 8]) -> [u32; 8] {
        lanes(a, b, |a, b| a | b)
    }

    #[inline(always)]
    fn plus(a: [u32; 8], b: [u32; 8]) -> [u32; 8] {
        lanes(a, b, u32::wrapping_add)
    }

    #[inline(always)]
    fn minus(a: [u32; 8], b: [u32; 8]) -> [u32; 8] {
        lanes(a, b, u32::wrapping_sub)
    }

    #[inline(always)]
    fn times(a: [u32; 8], b: [u32; 8]) -> [u32; 8] {
        lanes(a, b, u32::wrapping_mul)
    }

    #[inline(always)]
    fn shifted_left<const BITS: i32>(a: [u32; 8]) -> [u32; 8] {
        a.map(|a| a << BITS)
    }

    #[inline(always)]
    fn shifted_right<const BITS: i32>(a: [u32; 8]) -> [u32; 8] {
        a.map(|a| (a as i32 >> BITS) as u32)
    }

    #[inline(always)]
    fn to_f32(a: [u32; 8]) -> [f32; 8] {
        a.map(|a| a as i32 as f32)
    }

    #[inline(always)]
    fn bits(a: [u32; 8]) -> u32 {
        (0..8).fold(0, |bits, k| bits | (a[k] >> 31) << k)
    }
}
