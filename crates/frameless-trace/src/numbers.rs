//! The random numbers of a path: pairs that fill the square evenly, another shuffled sequence of them for every decision.
//!
//! ```text
//! x(i) = scramble( Sobol₀ (shuffle(i)) )        y(i) = scramble'( Sobol₁ (shuffle(i)) )
//! ```
//!
//! The first two dimensions of Sobol's sequence are a (0, 2)-sequence: of every 2ᵏ points in a row, from a multiple of 2ᵏ on, one lies in
//! each box of 2⁻ʲ by 2ʲ⁻ᵏ. Owen's scrambling keeps that, and so does shuffling the points in the same manner (Burley 2020, "Practical
//! Hash-based Owen Scrambling", JCGT 9(4), whose "padding" this is: pairs of one path do not know of each other). Where a decision needs a
//! choice and a pair, the choice is made by the first number, and what is left of it is used again.
//!
//! The request's number in its pixel's sequence is i: the same request has the same numbers. The sequence has 2¹⁶ points; then another begins.

use frameless::Request;

use crate::holes::Chance;

/// Decisions per surface that have pairs of their own.
const DECISIONS: u32 = 3;
/// For the lens: a surface that no path reaches.
const LENS: u32 = u32::MAX;

/// The random numbers of one request.
#[derive(Clone, Copy)]
pub(crate) struct Numbers {
    /// i, its bits in reversed order.
    index_reversed: u32,
    seed: u32,
}

impl Numbers {
    #[inline(always)]
    pub(crate) fn of(request: &Request) -> Numbers {
        let (index, turn) = (request.sample_index & 0xffff, request.sample_index >> 16);
        Numbers { index_reversed: index.reverse_bits(), seed: mixed(mixed(request.pixel) ^ turn) }
    }

    /// For the surface that a path meets after `depth` others: for the direction that it takes from there, and for a point of what shines.
    #[inline(always)]
    pub(crate) fn at_surface(&self, depth: u32) -> [[f32; 2]; 2] {
        let first = depth.wrapping_mul(DECISIONS);
        self.pairs([first, first.wrapping_add(1)])
    }

    /// For a direction of the environment there.
    #[inline]
    pub(crate) fn sky(&self, depth: u32) -> [f32; 2] {
        let decision = depth.wrapping_mul(DECISIONS).wrapping_add(2);
        self.pairs([decision; 2])[0]
    }

    /// For the place on the lens.
    #[inline]
    pub(crate) fn lens(&self) -> [f32; 2] {
        self.pairs([LENS; 2])[0]
    }

    /// For roulette, in [0, 1): of no sequence, since few paths that a pixel sees together meet it in the same place.
    #[inline(always)]
    pub(crate) fn roulette(&self, depth: u32) -> f32 {
        unit(mixed(self.seed ^ mixed(self.index_reversed ^ depth)))
    }

    /// For the light that is asked there for others, likewise.
    pub(crate) fn light(&self, depth: u32) -> f32 {
        unit(mixed(self.seed ^ mixed(!self.index_reversed ^ depth)))
    }

    /// For the ray that goes there: whether what blends is there.
    #[inline(always)]
    pub(crate) fn chance(&self, depth: u32) -> Chance {
        Chance::By(mixed(!self.seed ^ mixed(self.index_reversed ^ depth)))
    }

    /// Of two decisions at once: for one it would cost nearly as much.
    #[inline(always)]
    fn pairs(&self, decisions: [u32; 2]) -> [[f32; 2]; 2] {
        // Neighbours in no sense: an odd step about 2³² / golden ratio apart.
        const STEP: u32 = 0x9e37_79b9;
        let keys = decisions.map(|decision| mixed(self.seed ^ decision.wrapping_mul(STEP)));
        let [[a, b], [c, d]] = keys.map(|key| sobol(scrambled(self.index_reversed, key)));
        let seeds = [keys[0], !keys[0], keys[1], !keys[1]].map(mixed);
        let [mut reversed, mut numbers] = [[a, b, c, d], [0; 4]];
        for lane in 0..4 {
            reversed[lane] = scrambled(reversed[lane], seeds[lane]);
            numbers[lane] = reversed[lane].reverse_bits();
        }
        let [a, b, c, d] = numbers.map(unit);
        [[a, b], [c, d]]
    }
}

/// In [0, 1), by the upper 24 bits.
#[inline(always)]
pub(crate) fn unit(bits: u32) -> f32 {
    const PART: f32 = 1.0 / (1 << 24) as f32;
    (bits >> 8) as i32 as f32 * PART
}

/// Every bit of the result depends on every bit of the number ("lowbias32", Wellons 2018).
#[inline(always)]
pub(crate) fn mixed(mut x: u32) -> u32 {
    x ^= x >> 16;
    x = x.wrapping_mul(0x7feb_352d);
    x ^= x >> 15;
    x = x.wrapping_mul(0x846c_a68b);
    x ^ (x >> 16)
}

/// Owen's scrambling of a number whose bits are in reversed order: every bit is flipped or not by a hash of those below it (Laine and
/// Karras 2011; this hash is that of Vegdahl 2021, "Building a Better LK Hash").
#[inline(always)]
fn scrambled(mut reversed: u32, seed: u32) -> u32 {
    reversed ^= reversed.wrapping_mul(0x3d20_adea);
    reversed = reversed.wrapping_add(seed);
    reversed = reversed.wrapping_mul((seed >> 16) | 1);
    reversed ^= reversed.wrapping_mul(0x0552_6c56);
    reversed ^ reversed.wrapping_mul(0x53a2_2864)
}

/// The first two dimensions of Sobol's sequence, in bits of reversed order, as the index is; its lower half is ignored.
#[inline(always)]
fn sobol(index_reversed: u32) -> [u32; 2] {
    let of_nibble =
        |nibble: usize| SOBOL[nibble][(index_reversed >> (28 - 4 * nibble) & 15) as usize];
    let both = of_nibble(0) ^ of_nibble(1) ^ of_nibble(2) ^ of_nibble(3);
    [both as u32, (both >> 32) as u32]
}

/// The sums of direction numbers for four bits of the index at a time, both dimensions in one number.
static SOBOL: [[u64; 16]; 4] = {
    // Dimension 0: the index itself, turned round. Dimension 1: rows of Pascal's triangle, v_k = v_{k−1} ⊕ v_{k−1} / 2 (Sobol' 1967).
    let mut directions = [0u64; 16];
    let (mut k, mut v) = (0, 1u32 << 31);
    while k < 16 {
        directions[k] = 1 << k | (v.reverse_bits() as u64) << 32;
        v ^= v >> 1;
        k += 1;
    }
    let mut sums = [[0u64; 16]; 4];
    let mut i = 0;
    while i < 64 {
        let (nibble, bits) = (i / 16, i % 16);
        let mut k = 0;
        while k < 4 {
            // The uppermost bit is the index's lowest.
            if bits >> (3 - k) & 1 == 1 {
                sums[nibble][bits] ^= directions[4 * nibble + k];
            }
            k += 1;
        }
        i += 1;
    }
    sums
};

#[cfg(test)]
mod tests {
    use super::*;

    fn numbers(pixel: u32, sample_index: u32) -> Numbers {
        Numbers::of(&Request { sample_index, ..Request::centre(pixel) })
    }

    #[test]
    fn unscrambled_they_are_sobols_sequence() {
        for index in 0..1u32 << 16 {
            let reversed = index.reverse_bits();
            let want = [0, 1].map(|dimension| sobol_burley::parts::sobol_rev(reversed, dimension));
            assert_eq!(sobol(reversed), want, "{index}");
        }
    }

    /// The definition of a (0, 2)-sequence, for every run of 2ᵏ points that begins at a multiple of 2ᵏ.
    #[test]
    fn every_box_of_every_shape_has_one_point_of_each_run() {
        for (pixel, depth, begin) in [(0, 0, 0), (7, 3, 1024), (9_999, 1, 0xfe00)] {
            let points = |run: u32, length: u32| {
                (0..length).map(move |i| numbers(pixel, begin + run * length + i).at_surface(depth))
            };
            for k in 0..=9 {
                for run in 0..512 >> k {
                    for j in 0..=k {
                        let mut found = vec![[0; 2]; 1 << k];
                        for pairs in points(run, 1 << k) {
                            for (pair, [x, y]) in pairs.into_iter().enumerate() {
                                let [column, row] =
                                    [x * f32::exp2(j as f32), y * f32::exp2((k - j) as f32)];
                                found[((row as usize) << j) + column as usize][pair] += 1;
                            }
                        }
                        assert!(
                            found.iter().all(|&count| count == [1, 1]),
                            "2^{k} points, 2^{j} columns"
                        );
                    }
                }
            }
        }
    }

    /// χ² of 64 cells of two numbers from different decisions, surfaces or pixels: 63 on average, 11 the standard deviation.
    #[test]
    fn pairs_of_different_decisions_know_nothing_of_each_other() {
        let first = |numbers: Numbers, depth| numbers.at_surface(depth)[0];
        type Pair = fn(u32) -> [f32; 2];
        let others: [(&str, Pair); 5] = [
            ("light", |i| numbers(5, i).at_surface(1)[1]),
            ("next surface", |i| numbers(5, i).at_surface(2)[0]),
            ("sky", |i| numbers(5, i).sky(1)),
            ("lens", |i| numbers(5, i).lens()),
            ("next pixel", |i| numbers(6, i).at_surface(1)[0]),
        ];
        for (name, other) in others {
            for (one, two) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                let mut cells = [0.0f64; 64];
                for i in 0..1 << 14 {
                    let [x, y] = [first(numbers(5, i), 1)[one], other(i)[two]];
                    cells[(8.0 * x) as usize * 8 + (8.0 * y) as usize] += 1.0;
                }
                let expected = f64::from(1 << 14) / 64.0;
                let chi2: f64 = cells.iter().map(|n| (n - expected).powi(2) / expected).sum();
                assert!(chi2 < 63.0 + 5.0 * 11.3, "{name} {one}{two}: {chi2}");
            }
        }
    }

    #[test]
    fn roulette_is_even_and_no_number_reaches_one() {
        let counts = (0..1 << 14).fold([0; 8], |mut counts, i| {
            counts[(8.0 * numbers(3, i).roulette(4)) as usize] += 1;
            counts
        });
        // 2048 each, standard deviation 42.
        assert!(counts.iter().all(|&n: &i32| (n - 2048).abs() < 5 * 42), "{counts:?}");
        assert_eq!((unit(0), unit(u32::MAX)), (0.0, 1.0 - f32::EPSILON / 2.0));
    }

    /// When they change, pictures of paths do: then the changelog says so.
    #[test]
    fn first_numbers_are_pinned() {
        let first = numbers(1, 0);
        assert_eq!(
            first.at_surface(0),
            [[0.711_272_5, 0.134_570_06], [0.768_224_66, 0.165_501_95]]
        );
        assert_eq!(first.sky(0), [0.843_054_9, 0.606_924_95]);
        assert_eq!(first.lens(), [0.138_071_78, 0.722_807_94]);
        assert_eq!(first.roulette(0), 0.140_634_3);
        let later = numbers(1, 70_000).at_surface(2);
        assert_eq!(later, [[0.575_738_2, 0.623_270_3], [0.141_179_86, 0.352_139_12]]);
    }
}
