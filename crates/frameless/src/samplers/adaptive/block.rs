//! A block of tiles that gets draws together: what it has got is shared out among its tiles, without chance.
//!
//! ```text
//! c_i ← c_i + n · q_i / Σ q,   q_i = a · w_i + b · e_i      for every tile of the block, when it has got n draws
//! while c_i ≥ 1:   c_i ← c_i − 1, and tile i is drawn
//! ```

use crate::wide::{F8, Unit};

/// Tiles in a block; 16 numbers are a line of the cache.
pub(super) const BLOCK: usize = 16;

/// Consecutive tiles; of the last block some may not be there, and have no share.
#[derive(Clone, Copy, Debug, Default)]
#[repr(align(64))]
pub(super) struct Block {
    /// c.
    pub(super) credit: [f32; BLOCK],
    /// w.
    pub(super) weight: [f32; BLOCK],
}

impl Block {
    /// Calls `take` with the tiles that are drawn, when the block has got `got` draws; nobody if none has a share. `even`: e.
    #[inline(always)]
    pub(super) fn draw<U: Unit>(
        &mut self,
        [a, b]: [f32; 2],
        even: &[f32; BLOCK],
        got: f32,
        mut take: impl FnMut(usize),
    ) {
        let (a, b) = (F8::<U>::splat(a), F8::splat(b));
        let mut q = [0.0; BLOCK];
        for half in [0, BLOCK / 2] {
            let eight = a * F8::load(&self.weight, half) + b * F8::load(even, half);
            q[half..half + BLOCK / 2].copy_from_slice(&eight.lanes());
        }
        let shares = sum(&q);
        let part = got / shares;
        // Nor where shares are too small for numbers: nobody is drawn without end.
        if shares <= 0.0 || !part.is_finite() {
            return;
        }
        let part = F8::<U>::splat(part);
        let mut ripe = 0;
        for half in [0, BLOCK / 2] {
            let credit = F8::load(&self.credit, half) + part * F8::load(&q, half);
            self.credit[half..half + BLOCK / 2].copy_from_slice(&credit.lanes());
            ripe |= (!credit.less_than(F8::splat(1.0)).bits() & 255) << half;
        }
        while ripe != 0 {
            let tile = ripe.trailing_zeros() as usize;
            ripe &= ripe - 1;
            let draws = self.credit[tile] as u32;
            self.credit[tile] -= draws as f32;
            (0..draws).for_each(|_| take(tile));
        }
    }
}

/// In pairs, which a processor adds side by side.
#[inline(always)]
pub(super) fn sum(numbers: &[f32; BLOCK]) -> f32 {
    let mut fours = [0.0; 4];
    for numbers in numbers.as_chunks::<4>().0 {
        for (sum, number) in fours.iter_mut().zip(numbers) {
            *sum += number;
        }
    }
    (fours[0] + fours[2]) + (fours[1] + fours[3])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wide::{self, Task};

    /// What one block draws by turns.
    struct Turns<'a>(&'a mut Block, &'a [f32; BLOCK], f32, &'a mut Vec<usize>);

    impl Task for Turns<'_> {
        #[inline(always)]
        fn run<U: Unit>(self) {
            let Turns(block, even, got, drawn) = self;
            block.draw::<U>([2.0, 0.25], even, got, |tile| drawn.push(tile));
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
