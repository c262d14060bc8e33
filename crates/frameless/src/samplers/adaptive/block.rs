//! A block of tiles, of which one is drawn at a time: in proportion to their shares, without chance.
//!
//! ```text
//! c_i ← c_i + n · q_i / Σ q       for every tile of the block, before n draws
//! n times:   the tile whose c is largest is drawn, c ← c − 1
//! ```
//!
//! That is the weighted round robin with which servers are balanced; Σ c stays as it is.

/// Tiles in a block; 16 numbers are a line of the cache.
pub(super) const BLOCK: usize = 16;
/// Added to credits before they are compared, so that they are above 0. While all tiles of a block have shares none is below −1; where
/// they have them by turns it may be a little less.
const ABOVE_ZERO: f32 = 8.0;

/// Consecutive tiles; of the last block some may not be there, and have no share.
#[derive(Clone, Copy, Default)]
#[repr(align(64))]
pub(super) struct Block {
    /// c.
    pub(super) credit: [f32; BLOCK],
    /// w.
    pub(super) weight: [f32; BLOCK],
    /// e.
    pub(super) even: [f32; BLOCK],
}

impl Block {
    /// Σ w and Σ e.
    pub(super) fn sums(&self) -> (f32, f32) {
        (sum(&self.weight), sum(&self.even))
    }

    /// Calls `take` with the tiles that are drawn; nobody if none has a share.
    #[inline]
    pub(super) fn draw(&mut self, a: f32, b: f32, draws: u32, mut take: impl FnMut(usize)) {
        let mut q = [0.0; BLOCK];
        for (q, (weight, even)) in q.iter_mut().zip(self.weight.iter().zip(&self.even)) {
            *q = a * weight + b * even;
        }
        let part = draws as f32 / sum(&q).max(f32::MIN_POSITIVE);
        let mut compared = [0.0; BLOCK];
        for ((compared, credit), q) in compared.iter_mut().zip(&mut self.credit).zip(&q) {
            *credit += q * part;
            // Who has no share stays at 0.
            *compared = f32::from(u8::from(*q > 0.0)) * (*credit + ABOVE_ZERO);
        }
        for _ in 0..draws {
            let tile = largest(&compared);
            if compared[tile] > 0.0 {
                self.credit[tile] -= 1.0;
                compared[tile] -= 1.0;
                take(tile);
            }
        }
    }
}

/// In pairs, which a processor adds side by side.
#[inline]
fn sum(numbers: &[f32; BLOCK]) -> f32 {
    let mut fours = [0.0; 4];
    for numbers in numbers.as_chunks::<4>().0 {
        fours.iter_mut().zip(numbers).for_each(|(sum, number)| *sum += number);
    }
    (fours[0] + fours[2]) + (fours[1] + fours[3])
}

/// Where the largest of some numbers is that are not negative, to four bits less than they have.
///
/// Positive floats are in the order of their bits, so the place is written into the lowest of these and the largest carries it along:
/// no branch that depends on the numbers.
#[inline]
fn largest(numbers: &[f32; BLOCK]) -> usize {
    const PLACE: u32 = BLOCK as u32 - 1;
    let mut numbered = [0.0; BLOCK];
    for (i, (numbered, number)) in (0..).zip(numbered.iter_mut().zip(numbers)) {
        *numbered = f32::from_bits(number.to_bits() & !PLACE | i);
    }
    let mut fours = [0.0f32; 4];
    for numbered in numbered.as_chunks::<4>().0 {
        for (four, &number) in fours.iter_mut().zip(numbered) {
            *four = if number > *four { number } else { *four };
        }
    }
    let largest = fours.into_iter().fold(0.0, |a, b| if b > a { b } else { a });
    (largest.to_bits() & PLACE) as usize
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Rng;

    #[test]
    fn the_largest_is_found_wherever_it_is() {
        let mut rng = Rng::new(13);
        for place in 0..BLOCK {
            let mut numbers: [f32; BLOCK] = std::array::from_fn(|_| 8.0 * rng.unit_f32());
            numbers[place] = 9.0;
            assert_eq!(largest(&numbers), place);
        }
    }

    #[test]
    fn shares_by_turns_do_not_let_credits_sink_to_nothing() {
        let mut block = Block { weight: [1.0; BLOCK], ..Block::default() };
        for turn in 0..10_000 {
            let has = |i: usize| i % 7 == turn % 7 || i == turn % 16;
            block.weight = std::array::from_fn(|i| if has(i) { 1.0 } else { 0.0 });
            let mut drawn = 0;
            block.draw(1.0, 0.0, 3, |tile| {
                assert!(has(tile));
                drawn += 1;
            });
            assert_eq!(drawn, 3);
        }
        assert!(block.credit.iter().all(|credit| credit.abs() < 0.5 * ABOVE_ZERO));
    }
}
