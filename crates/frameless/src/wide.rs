//! Loops over plain numbers, compiled for the vector unit of the processor at hand. The one place of this crate with `unsafe` code.
//!
//! The results do not depend on it: every lane does the same IEEE operations, and nothing is contracted.
#![allow(unsafe_code)]

#[cfg(not(target_arch = "x86_64"))]
mod portable;
#[cfg(target_arch = "x86_64")]
mod sse2;

#[cfg(not(target_arch = "x86_64"))]
use portable::{F4, M4};
#[cfg(target_arch = "x86_64")]
use sse2::{F4, M4};

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
#[derive(Clone, Copy, Debug)]
pub(crate) struct F8([F4; 2]);

/// Eight whole numbers at a time; as a mask, all bits of a lane are set or none.
#[derive(Clone, Copy, Debug)]
pub(crate) struct M8([M4; 2]);

/// Half by half.
macro_rules! both {
    ($operation:expr, $a:expr $(, $b:expr)*) => {
        [$operation($a.0[0] $(, $b.0[0])*), $operation($a.0[1] $(, $b.0[1])*)]
    };
}

impl F8 {
    #[inline(always)]
    pub(crate) fn splat(x: f32) -> F8 {
        F8([F4::splat(x); 2])
    }

    #[inline(always)]
    pub(crate) fn new([a, b, c, d, e, f, g, h]: [f32; 8]) -> F8 {
        F8([F4::new([a, b, c, d]), F4::new([e, f, g, h])])
    }

    #[inline(always)]
    pub(crate) fn lanes(self) -> [f32; 8] {
        let mut lanes = [0.0; 8];
        self.store(&mut lanes, 0);
        lanes
    }

    /// The eight from `start` on.
    #[inline(always)]
    pub(crate) fn load(plane: &[f32], start: usize) -> F8 {
        let [low, high] = halves(&plane[start..start + 8]);
        F8([F4::load(low), F4::load(high)])
    }

    #[inline(always)]
    pub(crate) fn store(self, plane: &mut [f32], start: usize) {
        let plane = &mut plane[start..start + 8];
        plane[..4].copy_from_slice(&self.0[0].lanes());
        plane[4..].copy_from_slice(&self.0[1].lanes());
    }

    /// `self` where the mask is set, `other` elsewhere.
    #[inline(always)]
    pub(crate) fn or(self, mask: M8, other: F8) -> F8 {
        F8(both!(F4::or, self, mask, other))
    }

    #[inline(always)]
    pub(crate) fn less_than(self, other: F8) -> M8 {
        M8(both!(F4::less_than, self, other))
    }

    /// The columns of eight rows of four.
    #[inline(always)]
    pub(crate) fn columns(rows: [&[f32; 4]; 8]) -> [F8; 4] {
        let [a, b, c, d, e, f, g, h] = rows;
        let (low, high) = (F4::transposed([a, b, c, d]), F4::transposed([e, f, g, h]));
        [0, 1, 2, 3].map(|k| F8([low[k], high[k]]))
    }

    /// Towards zero. Numbers that are not in 0..2³¹ give something.
    #[inline(always)]
    pub(crate) fn truncated(self) -> M8 {
        M8(both!(F4::truncated, self))
    }
}

macro_rules! lane_by_lane {
    ($($trait:ident $method:ident),*) => {$(
        impl std::ops::$trait for F8 {
            type Output = F8;
            #[inline(always)]
            fn $method(self, other: F8) -> F8 {
                F8(both!(F4::$method, self, other))
            }
        }
    )*};
}
lane_by_lane!(Add add, Sub sub, Mul mul, Div div);

macro_rules! whole_lane_by_lane {
    ($($(#[$doc:meta])* $method:ident),* $(,)?) => {$(
        $(#[$doc])*
        #[inline(always)]
        pub(crate) fn $method(self, other: M8) -> M8 {
            M8(both!(M4::$method, self, other))
        }
    )*};
}

impl M8 {
    #[inline(always)]
    pub(crate) fn splat(x: u32) -> M8 {
        M8([M4::splat(x); 2])
    }

    #[inline(always)]
    pub(crate) fn new(lanes: [u32; 8]) -> M8 {
        M8::load(&lanes, 0)
    }

    #[inline(always)]
    pub(crate) fn lanes(self) -> [u32; 8] {
        let mut lanes = [0; 8];
        self.store(&mut lanes, 0);
        lanes
    }

    /// The eight from `start` on.
    #[inline(always)]
    pub(crate) fn load(plane: &[u32], start: usize) -> M8 {
        let [low, high] = halves(&plane[start..start + 8]);
        M8([M4::load(low), M4::load(high)])
    }

    #[inline(always)]
    pub(crate) fn store(self, plane: &mut [u32], start: usize) {
        let plane = &mut plane[start..start + 8];
        plane[..4].copy_from_slice(&self.0[0].lanes());
        plane[4..].copy_from_slice(&self.0[1].lanes());
    }

    whole_lane_by_lane!(
        equals,
        /// As signed numbers.
        less_than,
        and,
        either,
        /// Sum modulo 2³².
        plus,
        /// Difference modulo 2³².
        minus,
        /// Product modulo 2³².
        times,
    );

    #[inline(always)]
    pub(crate) fn not(self) -> M8 {
        self.equals(M8::splat(0))
    }

    /// As signed numbers.
    #[inline(always)]
    pub(crate) fn to_f32(self) -> F8 {
        F8(both!(M4::to_f32, self))
    }

    /// `self` where the mask is set, `other` elsewhere.
    #[inline(always)]
    pub(crate) fn or(self, mask: M8, other: M8) -> M8 {
        self.and(mask).either(mask.not().and(other))
    }

    /// A mask of the first lanes.
    #[inline(always)]
    pub(crate) fn first_lanes(lanes: usize) -> M8 {
        M8::new([0, 1, 2, 3, 4, 5, 6, 7]).less_than(M8::splat(lanes as u32))
    }

    /// A bit per lane of a mask.
    #[inline(always)]
    pub(crate) fn bits(self) -> u32 {
        self.0[0].bits() | self.0[1].bits() << 4
    }

    /// Whether all lanes of a mask are set.
    #[inline(always)]
    pub(crate) fn all(self) -> bool {
        self.bits() == 255
    }

    /// Whether any lane of a mask is set.
    #[inline(always)]
    pub(crate) fn any(self) -> bool {
        self.bits() != 0
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
}

#[inline(always)]
fn halves<T>(eight: &[T]) -> [&[T; 4]; 2] {
    let (halves, _) = eight.as_chunks::<4>();
    [&halves[0], &halves[1]]
}

/// Planes of equal length, of which eight numbers at a time are read from the same place: one check for all.
#[derive(Clone, Copy)]
pub(crate) struct Planes<'a, T, const N: usize> {
    planes: [&'a [T]; N],
    len: usize,
}

impl<'a, T, const N: usize> Planes<'a, T, N> {
    pub(crate) fn new(planes: [&'a [T]; N]) -> Planes<'a, T, N> {
        let len = planes.iter().map(|plane| plane.len()).min().unwrap_or(0);
        Planes { planes, len }
    }

    #[inline(always)]
    fn eights(&self, start: usize) -> [&'a [T]; N] {
        assert!(start < self.len && self.len - start >= 8);
        // SAFETY: no plane is shorter than `len`, and eight numbers from `start` on are within it.
        std::array::from_fn(|k| unsafe { self.planes[k].get_unchecked(start..start + 8) })
    }
}

impl<const N: usize> Planes<'_, f32, N> {
    /// The eight from `start` on, of every plane.
    #[inline(always)]
    pub(crate) fn load(&self, start: usize) -> [F8; N] {
        self.eights(start).map(|eight| F8::load(eight, 0))
    }
}

impl<const N: usize> Planes<'_, u32, N> {
    /// The eight from `start` on, of every plane.
    #[inline(always)]
    pub(crate) fn load(&self, start: usize) -> [M8; N] {
        self.eights(start).map(|eight| M8::load(eight, 0))
    }
}

/// Begin to fetch `plane[i]` from memory, if there is such; it will be read soon.
#[inline(always)]
pub(crate) fn prefetch<T>(plane: &[T], i: usize) {
    #[cfg(target_arch = "x86_64")]
    if let Some(place) = plane.get(i) {
        use core::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        // SAFETY: every x86-64 processor has SSE, and prefetching changes nothing.
        unsafe { _mm_prefetch::<_MM_HINT_T0>(std::ptr::from_ref(place).cast()) };
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = (plane, i);
}
