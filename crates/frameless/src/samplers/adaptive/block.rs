//! A block of tiles that gets draws together: what it has got is shared out among its tiles, without chance.
//!
//! ```text
//! c_i ← c_i + n · q_i / Σ q,   q_i = a · w_i + b · e_i      for every tile of the block, when it has got n draws
//! while c_i ≥ 1:   c_i ← c_i − 1, and tile i is drawn
//! ```

use crate::tile::LINE;
use crate::wide::{F8, Unit};

/// Consecutive tiles: those whose numbers are in one line of the cache.
pub(super) const BLOCK: usize = LINE;

/// What a block has to share out: `got` draws among shares of `sum` together.
#[derive(Clone, Copy)]
pub(super) struct Due<U: Unit> {
    pub(super) got: f32,
    /// q, half by half.
    pub(super) shares: [F8<U>; 2],
    /// Σ q.
    pub(super) sum: f32,
    /// The number of the first tile.
    pub(super) first: u32,
}

impl<U: Unit> Due<U> {
    /// Appends the tiles that are drawn; nobody if none has a share. `credits`: c.
    #[inline(always)]
    pub(super) fn draw(self, credits: &mut [f32; BLOCK], drawn: &mut Vec<u32>) {
        let Due { got, shares, sum, first } = self;
        let part = got / sum;
        // Nor where shares are too small for numbers: nobody is drawn without end.
        if !part.is_finite() {
            return;
        }
        let part = F8::<U>::splat(part);
        let (mut once, mut twice) = (0, 0);
        for (half, shares) in [0, BLOCK / 2].into_iter().zip(shares) {
            let credit = F8::load(credits, half) + part * shares;
            let is_drawn = credit.less_than(F8::splat(1.0)).not();
            let left = (credit - F8::splat(1.0)).or(is_drawn, credit);
            left.store(credits, half);
            once |= is_drawn.bits() << half;
            twice |= left.less_than(F8::splat(1.0)).not().bits() << half;
        }
        if twice == 0 {
            push_bits(drawn, first, once);
            return;
        }
        while once != 0 {
            let tile = once.trailing_zeros();
            once &= once - 1;
            let credit = &mut credits[tile as usize];
            let more = *credit as u32;
            *credit -= more as f32;
            drawn.extend((0..=more).map(|_| first + tile));
        }
    }
}

/// Appends the numbers of the bits that are set, counted from `first` on. Four at a time are written in any case, so that nobody has to guess
/// how many there are.
#[inline(always)]
pub(super) fn push_bits(numbers: &mut Vec<u32>, first: u32, mut bits: u32) {
    let end = numbers.len() + bits.count_ones() as usize;
    loop {
        let mut four = [0; 4];
        for number in &mut four {
            *number = first + bits.trailing_zeros();
            bits &= bits.wrapping_sub(1);
        }
        numbers.extend_from_slice(&four);
        if bits == 0 {
            break;
        }
    }
    numbers.truncate(end);
}

/// Of both halves of a block, in pairs, which a processor adds side by side.
#[inline(always)]
pub(super) fn sum<U: Unit>([left, right]: [F8<U>; 2]) -> f32 {
    let mut fours = [0.0; 4];
    let eight = (left + right).lanes();
    for (sum, pair) in fours.iter_mut().zip(0..4) {
        *sum = eight[pair] + eight[pair + 4];
    }
    (fours[0] + fours[2]) + (fours[1] + fours[3])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wide::{self, Task};

    /// A block with weights and even parts.
    #[derive(Default)]
    struct Block {
        credit: [f32; BLOCK],
        weight: [f32; BLOCK],
    }

    /// What one block draws by turns.
    struct Turns<'a>(&'a mut Block, &'a [f32; BLOCK], f32, &'a mut Vec<u32>);

    impl Task for Turns<'_> {
        #[inline(always)]
        fn run<U: Unit>(self) {
            let Turns(block, even, got, drawn) = self;
            let q: [f32; BLOCK] = std::array::from_fn(|i| 2.0 * block.weight[i] + 0.25 * even[i]);
            let shares = [F8::<U>::load(&q, 0), F8::load(&q, BLOCK / 2)];
            Due { got, shares, sum: sum(shares), first: 0 }.draw(&mut block.credit, drawn);
        }
    }

    #[test]
    fn a_block_is_known_by_thought() {
        // q = 2, 0.75 and 0.25 of 3.
        let mut block = Block::default();
        [block.weight[0], block.weight[3]] = [1.0, 0.25];
        let mut even = [0.0; BLOCK];
        [even[3], even[9]] = [1.0, 1.0];
        block.credit[9] = 0.75;
        let mut draw = |got: f32| {
            let mut drawn = Vec::new();
            wide::run(Turns(&mut block, &even, got, &mut drawn));
            drawn
        };
        assert_eq!(draw(1.5), [0], "1, 0.375 and 0.875");
        assert_eq!(draw(3.0), [0, 0, 3, 9], "2, 0.375 + 0.75 and 0.875 + 0.25");
        assert_eq!(draw(0.0), []);
        block = Block::default();
        let nothing = &[0.0; BLOCK];
        wide::run(Turns(&mut block, nothing, 5.0, &mut Vec::new()));
        assert_eq!(block.credit, [0.0; BLOCK], "nobody has a share");
        block.weight[5] = f32::from_bits(1);
        wide::run(Turns(&mut block, nothing, 5.0, &mut Vec::new()));
        assert_eq!(block.credit, [0.0; BLOCK], "shares so small that a draw of them is infinite");
    }
}
