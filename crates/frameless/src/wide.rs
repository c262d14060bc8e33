//! Loops over plain numbers, compiled for the vector unit of the processor at hand. The one place of this crate with `unsafe` code.
//!
//! The results do not depend on it: every lane does the same IEEE operations, and nothing is contracted.
#![allow(unsafe_code)]
// A lane is an index: what the compiler turns into one instruction reads like one.
#![allow(clippy::needless_range_loop)]

/// A loop to be compiled twice.
pub(crate) trait Task {
    /// Must be `inline(always)`, and so must what its inner loop calls.
    fn run(self);
}

/// Runs `task`, with AVX2 where the processor has it.
pub(crate) fn run(task: impl Task) {
    #[cfg(target_arch = "x86_64")]
    if is_x86_feature_detected!("avx2") {
        #[target_feature(enable = "avx2")]
        fn run_avx2(task: impl Task) {
            task.run()
        }
        // SAFETY: the processor has just been asked.
        return unsafe { run_avx2(task) };
    }
    task.run()
}

/// Eight numbers at a time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct F8(pub(crate) [f32; 8]);

impl F8 {
    #[inline(always)]
    pub(crate) fn splat(x: f32) -> F8 {
        F8([x; 8])
    }

    /// The eight from `start` on.
    #[inline(always)]
    pub(crate) fn load(plane: &[f32], start: usize) -> F8 {
        F8(plane[start..start + 8].try_into().expect("eight"))
    }

    #[inline(always)]
    fn with(self, other: F8, f: impl Fn(f32, f32) -> f32) -> F8 {
        let mut result = [0.0; 8];
        for lane in 0..8 {
            result[lane] = f(self.0[lane], other.0[lane]);
        }
        F8(result)
    }

    /// `self` where the mask is set, `other` elsewhere.
    #[inline(always)]
    pub(crate) fn or(self, mask: M8, other: F8) -> F8 {
        let mut result = [0.0; 8];
        for lane in 0..8 {
            let (a, b) = (self.0[lane].to_bits(), other.0[lane].to_bits());
            result[lane] = f32::from_bits((a & mask.0[lane]) | (b & !mask.0[lane]));
        }
        F8(result)
    }

    #[inline(always)]
    pub(crate) fn less_than(self, other: F8) -> M8 {
        let mut mask = [0; 8];
        for lane in 0..8 {
            mask[lane] = u32::from(self.0[lane] < other.0[lane]).wrapping_neg();
        }
        M8(mask)
    }

    #[inline(always)]
    pub(crate) fn store(self, plane: &mut [f32], start: usize) {
        plane[start..start + 8].copy_from_slice(&self.0);
    }

    /// Towards zero. Numbers that are not in 0..2³¹ give something.
    #[inline(always)]
    pub(crate) fn truncated(self) -> M8 {
        let mut result = [0; 8];
        for lane in 0..8 {
            result[lane] = self.0[lane] as i32 as u32;
        }
        M8(result)
    }
}

macro_rules! lane_by_lane {
    ($($trait:ident $method:ident $op:tt),*) => {$(
        impl std::ops::$trait for F8 {
            type Output = F8;
            #[inline(always)]
            fn $method(self, other: F8) -> F8 {
                self.with(other, |a, b| a $op b)
            }
        }
    )*};
}
lane_by_lane!(Add add +, Sub sub -, Mul mul *, Div div /);

/// Eight whole numbers at a time; as a mask, all bits of a lane are set or none.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct M8(pub(crate) [u32; 8]);

impl M8 {
    /// The eight from `start` on.
    #[inline(always)]
    pub(crate) fn load(plane: &[u32], start: usize) -> M8 {
        M8(plane[start..start + 8].try_into().expect("eight"))
    }

    #[inline(always)]
    pub(crate) fn splat(x: u32) -> M8 {
        M8([x; 8])
    }

    #[inline(always)]
    pub(crate) fn store(self, plane: &mut [u32], start: usize) {
        plane[start..start + 8].copy_from_slice(&self.0);
    }

    #[inline(always)]
    fn with(self, other: M8, f: impl Fn(u32, u32) -> u32) -> M8 {
        let mut result = [0; 8];
        for lane in 0..8 {
            result[lane] = f(self.0[lane], other.0[lane]);
        }
        M8(result)
    }

    #[inline(always)]
    pub(crate) fn equals(self, other: M8) -> M8 {
        self.with(other, |a, b| u32::from(a == b).wrapping_neg())
    }

    #[inline(always)]
    pub(crate) fn and(self, other: M8) -> M8 {
        self.with(other, |a, b| a & b)
    }

    #[inline(always)]
    pub(crate) fn not(self) -> M8 {
        self.with(self, |a, _| !a)
    }

    #[inline(always)]
    pub(crate) fn either(self, other: M8) -> M8 {
        self.with(other, |a, b| a | b)
    }

    /// A mask of the first lanes.
    #[inline(always)]
    pub(crate) fn first_lanes(lanes: usize) -> M8 {
        let mut mask = [0; 8];
        for lane in 0..8 {
            mask[lane] = u32::from(lane < lanes).wrapping_neg();
        }
        M8(mask)
    }

    /// `self` where the mask is set, `other` elsewhere.
    #[inline(always)]
    pub(crate) fn or(self, mask: M8, other: M8) -> M8 {
        let mut result = [0; 8];
        for lane in 0..8 {
            result[lane] = (self.0[lane] & mask.0[lane]) | (other.0[lane] & !mask.0[lane]);
        }
        M8(result)
    }

    /// Sum modulo 2³².
    #[inline(always)]
    pub(crate) fn plus(self, other: M8) -> M8 {
        self.with(other, u32::wrapping_add)
    }

    /// Difference modulo 2³².
    #[inline(always)]
    pub(crate) fn minus(self, other: M8) -> M8 {
        self.with(other, u32::wrapping_sub)
    }

    /// Product modulo 2³².
    #[inline(always)]
    pub(crate) fn times(self, other: M8) -> M8 {
        self.with(other, u32::wrapping_mul)
    }

    /// As signed numbers.
    #[inline(always)]
    pub(crate) fn less_than(self, other: M8) -> M8 {
        self.with(other, |a, b| u32::from((a as i32) < b as i32).wrapping_neg())
    }

    /// As signed numbers.
    #[inline(always)]
    pub(crate) fn to_f32(self) -> F8 {
        let mut result = [0.0; 8];
        for lane in 0..8 {
            result[lane] = self.0[lane] as i32 as f32;
        }
        F8(result)
    }

    /// Whether any lane of a mask is set.
    #[inline(always)]
    pub(crate) fn any(self) -> bool {
        self.0.iter().fold(0, |any, lane| any | lane) != 0
    }

    /// A bit per lane of a mask.
    #[inline(always)]
    pub(crate) fn bits(self) -> u32 {
        let mut bits = 0;
        for lane in 0..8 {
            bits |= (self.0[lane] & 1) << lane;
        }
        bits
    }

    /// The first lane of a mask that is set.
    #[inline(always)]
    pub(crate) fn first(self) -> Option<usize> {
        let bits = self.bits();
        (bits != 0).then(|| bits.trailing_zeros() as usize)
    }

    /// The lanes of a mask that are set.
    #[inline(always)]
    pub(crate) fn for_each(self, mut act: impl FnMut(usize)) {
        let mut bits = self.bits();
        while bits != 0 {
            act(bits.trailing_zeros() as usize);
            bits &= bits - 1;
        }
    }

    /// Whether all lanes of a mask are set.
    #[inline(always)]
    pub(crate) fn all(self) -> bool {
        self.0.iter().fold(u32::MAX, |all, lane| all & lane) == u32::MAX
    }
}

/// `into[k] = from[index[k]]`.
///
/// # Panics
/// If an index is not in `from`, or there are not as many as places.
#[inline(always)]
pub(crate) fn gather<T: Copy>(into: &mut [T], from: &[T], index: &[u32]) {
    assert_eq!(into.len(), index.len());
    let largest = index.iter().fold(0, |largest, &i| largest.max(i));
    assert!((largest as usize) < from.len());
    for (into, &i) in into.iter_mut().zip(index) {
        // SAFETY: no index is larger than `largest`, which has just been found to be in `from`.
        *into = unsafe { *from.get_unchecked(i as usize) };
    }
}
