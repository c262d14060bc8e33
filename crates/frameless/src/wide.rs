//! Loops over plain numbers, eight at a time, compiled for the vector unit of the processor at hand. The one place of this
//! crate with `unsafe` code, but for [`pages`](crate::pages).
//!
//! The results do not depend on it: every lane does the same IEEE operations, and nothing is contracted.
#![allow(unsafe_code)]

#[cfg(target_arch = "x86_64")]
mod avx2;
mod portable;

/// A loop to be compiled for every unit.
pub(crate) trait Task {
    /// Must be `inline(always)`, and so must what its inner loop calls: code that stays a function of its own, like the closures
    /// given to `array::map`, is compiled for no unit in particular.
    fn run<U: Unit>(self);
}

/// Runs `task`, with AVX2 where the processor has it, and with the registers and masks of AVX-512 where it has these.
pub(crate) fn run(task: impl Task) {
    #[cfg(target_arch = "x86_64")]
    if has_avx2() && has_avx512() {
        #[target_feature(enable = "avx2,bmi1,bmi2,lzcnt,popcnt,avx512f,avx512vl,avx512bw,avx512dq")]
        fn run_avx512(task: impl Task) {
            task.run::<avx2::Avx2>()
        }
        // SAFETY: the processor has just been asked.
        return unsafe { run_avx512(task) };
    }
    #[cfg(target_arch = "x86_64")]
    if has_avx2() {
        #[target_feature(enable = "avx2,bmi1,bmi2,lzcnt,popcnt")]
        fn run_avx2(task: impl Task) {
            task.run::<avx2::Avx2>()
        }
        // SAFETY: the processor has just been asked.
        return unsafe { run_avx2(task) };
    }
    task.run::<portable::Portable>()
}

/// AVX2, and what counts and shifts bits, as every processor with AVX2 has it.
#[cfg(target_arch = "x86_64")]
fn has_avx2() -> bool {
    is_x86_feature_detected!("avx2")
        && is_x86_feature_detected!("bmi1")
        && is_x86_feature_detected!("bmi2")
        && is_x86_feature_detected!("lzcnt")
        && is_x86_feature_detected!("popcnt")
}

#[cfg(target_arch = "x86_64")]
fn has_avx512() -> bool {
    is_x86_feature_detected!("avx512f")
        && is_x86_feature_detected!("avx512vl")
        && is_x86_feature_detected!("avx512bw")
        && is_x86_feature_detected!("avx512dq")
}

/// What a vector unit does with eight numbers, `F`, or eight whole numbers or masks, `M`; see [`F8`] and [`M8`].
pub(crate) trait Unit: Copy {
    type F: Copy;
    type M: Copy;
    fn splat_f(x: f32) -> Self::F;
    fn load_f(lanes: &[f32; 8]) -> Self::F;
    fn store_f(a: Self::F, lanes: &mut [f32; 8]);
    fn four_columns(rows: [&[f32; 4]; 8]) -> [Self::F; 4];
    fn six_columns(rows: [&[f32; 6]; 8]) -> [Self::F; 6];
    fn triples(columns: [Self::F; 3]) -> [[f32; 3]; 8];
    fn of_triples(triples: &[[f32; 3]; 8]) -> [Self::F; 3];
    fn to_bits(a: Self::F) -> Self::M;
    fn from_bits(a: Self::M) -> Self::F;
    fn add_f(a: Self::F, b: Self::F) -> Self::F;
    fn sub_f(a: Self::F, b: Self::F) -> Self::F;
    fn mul_f(a: Self::F, b: Self::F) -> Self::F;
    fn div_f(a: Self::F, b: Self::F) -> Self::F;
    fn sqrt_f(a: Self::F) -> Self::F;
    fn less_than_f(a: Self::F, b: Self::F) -> Self::M;
    fn select_f(mask: Self::M, a: Self::F, b: Self::F) -> Self::F;
    fn truncated(a: Self::F) -> Self::M;
    fn splat_m(x: u32) -> Self::M;
    fn load_m(lanes: &[u32; 8]) -> Self::M;
    fn store_m(a: Self::M, lanes: &mut [u32; 8]);
    fn equals(a: Self::M, b: Self::M) -> Self::M;
    fn less_than_m(a: Self::M, b: Self::M) -> Self::M;
    fn select_m(mask: Self::M, a: Self::M, b: Self::M) -> Self::M;
    fn not(a: Self::M) -> Self::M;
    fn and(a: Self::M, b: Self::M) -> Self::M;
    fn either(a: Self::M, b: Self::M) -> Self::M;
    fn plus(a: Self::M, b: Self::M) -> Self::M;
    fn minus(a: Self::M, b: Self::M) -> Self::M;
    fn times(a: Self::M, b: Self::M) -> Self::M;
    fn shifted_left<const BITS: i32>(a: Self::M) -> Self::M;
    fn shifted_right<const BITS: i32>(a: Self::M) -> Self::M;
    fn to_f32(a: Self::M) -> Self::F;
    fn bits(a: Self::M) -> u32;
}

/// Eight numbers at a time.
#[derive(Clone, Copy)]
pub(crate) struct F8<U: Unit>(U::F);

/// Eight whole numbers at a time; as a mask, all bits of a lane are set or none.
#[derive(Clone, Copy)]
pub(crate) struct M8<U: Unit>(U::M);

/// The bit of a number's sign.
const SIGN: u32 = 1 << 31;

impl<U: Unit> F8<U> {
    #[inline(always)]
    pub(crate) fn splat(x: f32) -> Self {
        F8(U::splat_f(x))
    }

    #[inline(always)]
    pub(crate) fn new(lanes: [f32; 8]) -> Self {
        F8(U::load_f(&lanes))
    }

    #[inline(always)]
    pub(crate) fn lanes(self) -> [f32; 8] {
        let mut lanes = [0.0; 8];
        U::store_f(self.0, &mut lanes);
        lanes
    }

    /// The eight from `start` on.
    #[inline(always)]
    pub(crate) fn load(plane: &[f32], start: usize) -> Self {
        F8(U::load_f(&plane[start..start + 8].as_chunks().0[0]))
    }

    #[inline(always)]
    pub(crate) fn store(self, plane: &mut [f32], start: usize) {
        U::store_f(self.0, &mut plane[start..start + 8].as_chunks_mut().0[0]);
    }

    /// `self` where the mask is set, `other` elsewhere.
    #[inline(always)]
    pub(crate) fn or(self, mask: M8<U>, other: Self) -> Self {
        F8(U::select_f(mask.0, self.0, other.0))
    }

    /// [`F8::or`] of several.
    #[inline(always)]
    pub(crate) fn all_or<const N: usize>(
        mut some: [Self; N],
        mask: M8<U>,
        others: [Self; N],
    ) -> [Self; N] {
        for (some, other) in some.iter_mut().zip(others) {
            *some = some.or(mask, other);
        }
        some
    }

    #[inline(always)]
    pub(crate) fn sqrt(self) -> Self {
        F8(U::sqrt_f(self.0))
    }

    #[inline(always)]
    pub(crate) fn abs(self) -> Self {
        self.to_bits().and(M8::splat(!SIGN)).as_f32()
    }

    /// Of the absolute value.
    #[inline(always)]
    pub(crate) fn with_sign_of(self, other: Self) -> Self {
        self.abs().to_bits().either(other.to_bits().and(M8::splat(SIGN))).as_f32()
    }

    /// `least` where there is less, or no number.
    #[inline(always)]
    pub(crate) fn at_least(self, least: Self) -> Self {
        self.or(least.less_than(self), least)
    }

    /// `most` where there is more.
    #[inline(always)]
    pub(crate) fn at_most(self, most: Self) -> Self {
        most.or(most.less_than(self), self)
    }

    /// To [0, 1].
    #[inline(always)]
    pub(crate) fn clamped(self) -> Self {
        let (zero, one) = (F8::splat(0.0), F8::splat(1.0));
        let least = zero.or(self.less_than(zero), self);
        one.or(one.less_than(self), least)
    }

    #[inline(always)]
    pub(crate) fn less_than(self, other: Self) -> M8<U> {
        M8(U::less_than_f(self.0, other.0))
    }

    /// The columns of eight rows.
    #[inline(always)]
    pub(crate) fn four_columns(rows: [&[f32; 4]; 8]) -> [Self; 4] {
        let [a, b, c, d] = U::four_columns(rows);
        [F8(a), F8(b), F8(c), F8(d)]
    }

    /// The same of six.
    #[inline(always)]
    pub(crate) fn six_columns(rows: [&[f32; 6]; 8]) -> [Self; 6] {
        let [a, b, c, d, e, f] = U::six_columns(rows);
        [F8(a), F8(b), F8(c), F8(d), F8(e), F8(f)]
    }

    /// Lane by lane one of each.
    #[inline(always)]
    pub(crate) fn triples([a, b, c]: [Self; 3]) -> [[f32; 3]; 8] {
        U::triples([a.0, b.0, c.0])
    }

    /// The inverse of [`F8::triples`].
    #[inline(always)]
    pub(crate) fn of_triples(triples: &[[f32; 3]; 8]) -> [Self; 3] {
        let [a, b, c] = U::of_triples(triples);
        [F8(a), F8(b), F8(c)]
    }

    /// Lane by lane as in [`f32::to_bits`].
    #[inline(always)]
    pub(crate) fn to_bits(self) -> M8<U> {
        M8(U::to_bits(self.0))
    }

    /// Towards zero. Numbers that are not in 0..2³¹ give something.
    #[inline(always)]
    pub(crate) fn truncated(self) -> M8<U> {
        M8(U::truncated(self.0))
    }
}

macro_rules! lane_by_lane {
    ($($trait:ident $method:ident $operation:ident),*) => {$(
        impl<U: Unit> std::ops::$trait for F8<U> {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                F8(U::$operation(self.0, other.0))
            }
        }
    )*};
}
lane_by_lane!(Add add add_f, Sub sub sub_f, Mul mul mul_f, Div div div_f);

macro_rules! whole_lane_by_lane {
    ($($(#[$doc:meta])* $method:ident $operation:ident),* $(,)?) => {$(
        $(#[$doc])*
        #[inline(always)]
        pub(crate) fn $method(self, other: Self) -> Self {
            M8(U::$operation(self.0, other.0))
        }
    )*};
}

impl<U: Unit> M8<U> {
    #[inline(always)]
    pub(crate) fn splat(x: u32) -> Self {
        M8(U::splat_m(x))
    }

    #[inline(always)]
    pub(crate) fn new(lanes: [u32; 8]) -> Self {
        M8(U::load_m(&lanes))
    }

    #[inline(always)]
    pub(crate) fn lanes(self) -> [u32; 8] {
        let mut lanes = [0; 8];
        U::store_m(self.0, &mut lanes);
        lanes
    }

    /// The eight from `start` on.
    #[inline(always)]
    pub(crate) fn load(plane: &[u32], start: usize) -> Self {
        M8(U::load_m(&plane[start..start + 8].as_chunks().0[0]))
    }

    #[inline(always)]
    pub(crate) fn store(self, plane: &mut [u32], start: usize) {
        U::store_m(self.0, &mut plane[start..start + 8].as_chunks_mut().0[0]);
    }

    whole_lane_by_lane!(
        equals equals,
        /// As signed numbers.
        less_than less_than_m,
        and and,
        either either,
        /// Sum modulo 2³².
        plus plus,
        /// Difference modulo 2³².
        minus minus,
        /// Product modulo 2³².
        times times,
    );

    /// All bits the other way.
    #[inline(always)]
    pub(crate) fn not(self) -> Self {
        M8(U::not(self.0))
    }

    /// Lane by lane as in [`f32::from_bits`].
    #[inline(always)]
    pub(crate) fn as_f32(self) -> F8<U> {
        F8(U::from_bits(self.0))
    }

    #[inline(always)]
    pub(crate) fn shifted_left<const BITS: i32>(self) -> Self {
        M8(U::shifted_left::<BITS>(self.0))
    }

    /// As signed numbers.
    #[inline(always)]
    pub(crate) fn shifted_right<const BITS: i32>(self) -> Self {
        M8(U::shifted_right::<BITS>(self.0))
    }

    /// As signed numbers.
    #[inline(always)]
    pub(crate) fn to_f32(self) -> F8<U> {
        F8(U::to_f32(self.0))
    }

    /// `self` where the mask is set, `other` elsewhere.
    #[inline(always)]
    pub(crate) fn or(self, mask: Self, other: Self) -> Self {
        M8(U::select_m(mask.0, self.0, other.0))
    }

    /// A mask of the first lanes.
    #[inline(always)]
    pub(crate) fn first_lanes(lanes: usize) -> Self {
        M8::new([0, 1, 2, 3, 4, 5, 6, 7]).less_than(M8::splat(lanes as u32))
    }

    /// A bit per lane of a mask.
    #[inline(always)]
    pub(crate) fn bits(self) -> u32 {
        U::bits(self.0)
    }

    /// A bit per lane, set where it is negative as a signed number.
    #[inline(always)]
    pub(crate) fn signs(self) -> u32 {
        U::bits(self.0)
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

/// Places to be read around a place, as offsets from it.
pub(crate) struct Offsets {
    offsets: Vec<isize>,
    least: isize,
    most: isize,
}

impl Offsets {
    pub(crate) fn new(offsets: impl IntoIterator<Item = isize>) -> Offsets {
        let offsets: Vec<isize> = offsets.into_iter().collect();
        let least = offsets.iter().copied().min().unwrap_or(0);
        let most = offsets.iter().copied().max().unwrap_or(0);
        Offsets { offsets, least, most }
    }
}

/// Planes of equal length, of which eight numbers at a time are read from the same places.
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

    /// The places around `start`: one check for all.
    #[inline(always)]
    pub(crate) fn around(self, start: usize, offsets: &'a Offsets) -> Around<'a, T, N> {
        let first = start.checked_add_signed(offsets.least);
        let last = start.checked_add_signed(offsets.most).and_then(|last| last.checked_add(8));
        assert!(first.is_some() && last.is_some_and(|last| last <= self.len));
        Around { planes: self.planes, start, offsets: &offsets.offsets }
    }
}

impl<const N: usize> Planes<'_, f32, N> {
    /// The eight from `start` on, of every plane.
    #[inline(always)]
    pub(crate) fn load<U: Unit>(&self, start: usize) -> [F8<U>; N] {
        assert!(start < self.len && self.len - start >= 8);
        let mut loaded = [F8::splat(0.0); N];
        for (loaded, plane) in loaded.iter_mut().zip(&self.planes) {
            // SAFETY: no plane is shorter than `len`, and eight numbers from `start` on are within it.
            *loaded = F8::load(unsafe { plane.get_unchecked(start..start + 8) }, 0);
        }
        loaded
    }
}

/// Places in planes; all have eight numbers.
pub(crate) struct Around<'a, T, const N: usize> {
    planes: [&'a [T]; N],
    start: usize,
    offsets: &'a [isize],
}

impl<'a, T, const N: usize> Around<'a, T, N> {
    #[inline(always)]
    pub(crate) fn len(&self) -> usize {
        self.offsets.len()
    }

    /// Of every plane the eight from place `k` on.
    #[inline(always)]
    fn eights(&self, k: usize) -> [&'a [T]; N] {
        let first = self.start.wrapping_add_signed(self.offsets[k]);
        let mut eights = self.planes;
        for eight in &mut eights {
            // SAFETY: `Planes::around` has seen that the eight numbers from every place on are within every plane.
            *eight = unsafe { eight.get_unchecked(first..first + 8) };
        }
        eights
    }
}

impl<const N: usize> Around<'_, u32, N> {
    /// Of every plane the eight from place `k` on.
    #[inline(always)]
    pub(crate) fn load<U: Unit>(&self, k: usize) -> [M8<U>; N] {
        let (eights, mut loaded) = (self.eights(k), [M8::splat(0); N]);
        for (loaded, eight) in loaded.iter_mut().zip(eights) {
            *loaded = M8::load(eight, 0);
        }
        loaded
    }
}

/// Begin to fetch `plane[i]` from memory; it will be read soon. Does nothing if there is no such.
#[inline(always)]
pub(crate) fn prefetch<T>(plane: &[T], i: usize) {
    #[cfg(target_arch = "x86_64")]
    {
        use core::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        // SAFETY: every x86-64 processor has SSE; prefetching changes nothing, and never fails whatever the address.
        unsafe { _mm_prefetch::<_MM_HINT_T0>(plane.as_ptr().wrapping_add(i).cast()) };
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = (plane, i);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Rng;

    /// Everything that a unit can do with eight lanes of each kind, bit by bit.
    struct All<'a> {
        numbers: [[f32; 8]; 2],
        wholes: [[u32; 8]; 2],
        results: &'a mut Vec<[u32; 8]>,
    }

    impl Task for All<'_> {
        #[inline(always)]
        fn run<U: Unit>(self) {
            let [a, b] = self.numbers.map(F8::<U>::new);
            let [m, n] = self.wholes.map(M8::<U>::new);
            let mask = a.less_than(b);
            let numbers =
                [a + b, a - b, a * b, a / b, a.or(mask, b), m.to_f32(), m.as_f32(), a.sqrt()];
            // No two rows alike.
            let rows: [[f32; 8]; 8] = std::array::from_fn(|k| {
                std::array::from_fn(|lane| self.numbers[k % 2][lane] + k as f32)
            });
            let rows = rows.each_ref();
            let bits = |x: F8<U>| x.lanes().map(f32::to_bits);
            let six = rows.map(|row| row.first_chunk().expect("eight"));
            self.results.extend(numbers.into_iter().chain(F8::six_columns(six)).map(bits));
            self.results.extend(F8::four_columns(rows.map(|row| &row.as_chunks().0[0])).map(bits));
            let triples = F8::triples([a, b, a - b]);
            self.results.extend(F8::of_triples(&triples).map(bits));
            self.results.extend((0..3).map(|k| triples.map(|triple| triple[k].to_bits())));
            let wholes = [
                mask,
                a.truncated(),
                a.to_bits(),
                m.equals(n),
                m.less_than(n),
                m.and(n),
                m.either(n),
                m.plus(n),
                m.minus(n),
                m.times(n),
                m.or(mask, n),
                m.not(),
                M8::first_lanes(3),
                m.shifted_left::<10>(),
                m.shifted_right::<10>(),
            ];
            self.results.extend(wholes.map(M8::lanes));
            self.results.push([mask.bits(), mask.first().unwrap_or(8) as u32, 0, 0, 0, 0, 0, 0]);
        }
    }

    #[test]
    fn every_unit_has_the_same_results() {
        let mut rng = Rng::new(1);
        for _ in 0..100 {
            let mut number = || 2000.0 * rng.unit_f32();
            let numbers = [(); 2].map(|()| std::array::from_fn(|_| number()));
            // Half of them alike in both.
            let mut whole = |k: u32| if k < 4 { k } else { rng.next_u32() };
            let wholes = [(); 2].map(|()| std::array::from_fn(|k| whole(k as u32)));
            let (mut portable, mut here) = (Vec::new(), Vec::new());
            All { numbers, wholes, results: &mut portable }.run::<portable::Portable>();
            run(All { numbers, wholes, results: &mut here });
            assert_eq!(portable, here);
            // By hand, so that not both are wrong alike.
            assert_eq!(f32::from_bits(here[0][3]), numbers[0][3] + numbers[1][3]);
            assert_eq!(here[21 + 1], numbers[1].map(f32::to_bits));
            assert_eq!(here[24 + 5], std::array::from_fn(|k| wholes[0][k] & wholes[1][k]));
        }
    }
}
