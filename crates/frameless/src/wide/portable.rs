//! Four lanes as an array, for the compiler to do its best with.

#[derive(Clone, Copy, Debug)]
pub(super) struct F4([f32; 4]);

#[derive(Clone, Copy, Debug)]
pub(super) struct M4([u32; 4]);

fn mask(is_set: bool) -> u32 {
    u32::from(is_set).wrapping_neg()
}

impl F4 {
    #[inline(always)]
    pub(super) fn splat(x: f32) -> F4 {
        F4([x; 4])
    }

    #[inline(always)]
    pub(super) fn new(lanes: [f32; 4]) -> F4 {
        F4(lanes)
    }

    #[inline(always)]
    pub(super) fn load(lanes: &[f32; 4]) -> F4 {
        F4(*lanes)
    }

    #[inline(always)]
    pub(super) fn transposed(rows: [&[f32; 4]; 4]) -> [F4; 4] {
        std::array::from_fn(|k| F4(rows.map(|row| row[k])))
    }

    #[inline(always)]
    pub(super) fn lanes(self) -> [f32; 4] {
        self.0
    }

    #[inline(always)]
    pub(super) fn less_than(self, other: F4) -> M4 {
        M4(std::array::from_fn(|k| mask(self.0[k] < other.0[k])))
    }

    #[inline(always)]
    pub(super) fn truncated(self) -> M4 {
        M4(std::array::from_fn(|k| self.0[k] as i32 as u32))
    }

    #[inline(always)]
    pub(super) fn or(self, mask: M4, other: F4) -> F4 {
        F4(std::array::from_fn(|k| if mask.0[k] == 0 { other.0[k] } else { self.0[k] }))
    }

    #[inline(always)]
    pub(super) fn add(self, other: F4) -> F4 {
        F4(std::array::from_fn(|k| self.0[k] + other.0[k]))
    }

    #[inline(always)]
    pub(super) fn sub(self, other: F4) -> F4 {
        F4(std::array::from_fn(|k| self.0[k] - other.0[k]))
    }

    #[inline(always)]
    pub(super) fn mul(self, other: F4) -> F4 {
        F4(std::array::from_fn(|k| self.0[k] * other.0[k]))
    }

    #[inline(always)]
    pub(super) fn div(self, other: F4) -> F4 {
        F4(std::array::from_fn(|k| self.0[k] / other.0[k]))
    }
}

impl M4 {
    #[inline(always)]
    pub(super) fn splat(x: u32) -> M4 {
        M4([x; 4])
    }

    #[inline(always)]
    pub(super) fn load(lanes: &[u32; 4]) -> M4 {
        M4(*lanes)
    }

    #[inline(always)]
    pub(super) fn lanes(self) -> [u32; 4] {
        self.0
    }

    #[inline(always)]
    pub(super) fn equals(self, other: M4) -> M4 {
        M4(std::array::from_fn(|k| mask(self.0[k] == other.0[k])))
    }

    #[inline(always)]
    pub(super) fn less_than(self, other: M4) -> M4 {
        M4(std::array::from_fn(|k| mask((self.0[k] as i32) < other.0[k] as i32)))
    }

    #[inline(always)]
    pub(super) fn and(self, other: M4) -> M4 {
        M4(std::array::from_fn(|k| self.0[k] & other.0[k]))
    }

    #[inline(always)]
    pub(super) fn either(self, other: M4) -> M4 {
        M4(std::array::from_fn(|k| self.0[k] | other.0[k]))
    }

    #[inline(always)]
    pub(super) fn plus(self, other: M4) -> M4 {
        M4(std::array::from_fn(|k| self.0[k].wrapping_add(other.0[k])))
    }

    #[inline(always)]
    pub(super) fn minus(self, other: M4) -> M4 {
        M4(std::array::from_fn(|k| self.0[k].wrapping_sub(other.0[k])))
    }

    #[inline(always)]
    pub(super) fn times(self, other: M4) -> M4 {
        M4(std::array::from_fn(|k| self.0[k].wrapping_mul(other.0[k])))
    }

    #[inline(always)]
    pub(super) fn to_f32(self) -> F4 {
        F4(std::array::from_fn(|k| self.0[k] as i32 as f32))
    }

    #[inline(always)]
    pub(super) fn bits(self) -> u32 {
        (0..4).map(|k| (self.0[k] >> 31) << k).sum()
    }
}
