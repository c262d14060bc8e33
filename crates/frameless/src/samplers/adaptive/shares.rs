//! Tiles drawn in proportion to their shares, exactly on average, by [turns](super::turns): of every tile, or if there are many, of every
//! [block](super::block) of 16 and then of the tiles in it.
//!
//! A round looks at everybody who may have a turn. For the 3072 tiles of 512×384 that takes less time than draws from blocks would; for
//! the 130,000 of 3840×2160 many times as much.

use super::block::{BLOCK, Block};
use super::turns::{Sums, Turns};
use crate::{Rng, wide};

/// With more tiles there are blocks: about where both ways take the same time. By profile a round takes 0.9 ns per tile, and a draw from
/// a block 50 to 100 ns, of which a batch wants some 400 (the others are holes and fronts).
const MOST_WITHOUT_BLOCKS: usize = 20_000;

/// Shares and credits of all tiles.
pub(super) struct Shares {
    tiles: usize,
    /// Of the tiles, or of the blocks.
    turns: Turns,
    /// Empty: every tile has turns of its own.
    blocks: Vec<Block>,
    /// Blocks that have turns, and how many.
    due: Vec<(u32, u32)>,
}

impl Shares {
    /// Nobody has a share yet. How soon tiles are drawn first is random.
    pub(super) fn new(tiles: usize, rng: &mut Rng) -> Shares {
        Shares::with_blocks(tiles, tiles > MOST_WITHOUT_BLOCKS, rng)
    }

    fn with_blocks(tiles: usize, with_blocks: bool, rng: &mut Rng) -> Shares {
        let credit: Vec<f32> = (0..tiles).map(|_| rng.unit_f32()).collect();
        if !with_blocks {
            return Shares {
                tiles,
                turns: Turns::new(credit),
                blocks: Vec::new(),
                due: Vec::new(),
            };
        }
        let blocks = credit.chunks(BLOCK).map(|credits| {
            let mut block = Block::default();
            block.credit[..credits.len()].copy_from_slice(credits);
            block
        });
        let turns = credit.chunks(BLOCK).map(|credits| credits.iter().sum::<f32>().fract());
        let (blocks, turns) = (blocks.collect(), Turns::new(turns.collect()));
        Shares { tiles, turns, blocks, due: Vec::new() }
    }

    /// Over all tiles.
    pub(super) fn sums(&self) -> Sums {
        self.turns.sums()
    }

    /// w and e of all tiles are others now, all at least 0.
    pub(super) fn set_all(&mut self, share: impl Fn(usize) -> (f32, f32)) {
        if self.blocks.is_empty() {
            return self.turns.set_all((0..self.tiles).map(share));
        }
        for tile in 0..self.tiles {
            let (block, i) = (&mut self.blocks[tile / BLOCK], tile % BLOCK);
            (block.weight[i], block.even[i]) = share(tile);
        }
        self.turns.set_all(self.blocks.iter().map(Block::sums));
    }

    /// w of a tile is another one now, at least 0.
    #[inline]
    pub(super) fn set(&mut self, tile: usize, weight: f32) {
        if self.blocks.is_empty() {
            return self.turns.set(tile, weight);
        }
        let (block, i) = (tile / BLOCK, tile % BLOCK);
        let old = std::mem::replace(&mut self.blocks[block].weight[i], weight);
        // Roundings last until the block is drawn from.
        self.turns.set(block, (self.turns.weights()[block] + (weight - old)).max(0.0));
    }

    /// Begin to fetch what [`Shares::set`] changes.
    #[inline]
    pub(super) fn prefetch(&self, tile: usize) {
        match self.blocks.get(tile / BLOCK) {
            Some(block) => wide::prefetch(&block.weight, 0),
            None => wide::prefetch(self.turns.weights(), tile),
        }
    }

    /// q of every tile.
    pub(super) fn all(&self, a: f32, b: f32) -> Vec<f32> {
        if self.blocks.is_empty() {
            return self.turns.all(a, b).collect();
        }
        let q = |tile: usize| {
            let (block, i) = (&self.blocks[tile / BLOCK], tile % BLOCK);
            a * block.weight[i] + b * block.even[i]
        };
        (0..self.tiles).map(q).collect()
    }

    /// Appends the tiles that are drawn: a Σ w + b Σ e of them on average.
    pub(super) fn draw(&mut self, a: f32, b: f32, tiles: &mut Vec<u32>) {
        if self.blocks.is_empty() {
            let take = |tile, turns| (0..turns).for_each(|_| tiles.push(tile));
            return self.turns.draw(a, b, take);
        }
        self.due.clear();
        self.turns.draw(a, b, |block, turns| {
            let Block { credit, weight, even } = &self.blocks[block as usize];
            [credit, weight, even].into_iter().for_each(|numbers| wide::prefetch(numbers, 0));
            self.due.push((block, turns));
        });
        for &(number, turns) in &self.due {
            let block = &mut self.blocks[number as usize];
            block.draw(a, b, turns, |tile| tiles.push(number * BLOCK as u32 + tile as u32));
            self.turns.set(number as usize, block.sums().0);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Weights of all orders from 1 to 10⁻⁴, as those of tiles that change and tiles at rest.
    fn weight(rng: &mut Rng) -> f32 {
        10f32.powf(-4.0 * rng.unit_f32())
    }

    fn drawn(shares: &mut Shares, (a, b): (f32, f32), counts: &mut [f64]) -> usize {
        let mut tiles = Vec::new();
        shares.draw(a, b, &mut tiles);
        tiles.iter().for_each(|&tile| counts[tile as usize] += 1.0);
        tiles.len()
    }

    /// (a, b) for so many draws, a fifth of them even.
    fn scale(shares: &Shares, count: f64) -> (f32, f32) {
        let sums = shares.sums();
        ((0.8 * count / sums.weight) as f32, (0.2 * count / sums.even) as f32)
    }

    #[test]
    fn everybody_is_drawn_as_often_as_their_share_says_within_two() {
        let mut rng = Rng::new(5);
        let sizes = [1, 7, 16, 100, 3072];
        for (tiles, with_blocks) in sizes.into_iter().flat_map(|n| [(n, false), (n, true)]) {
            let mut shares = Shares::with_blocks(tiles, with_blocks, &mut rng);
            let weights: Vec<f32> = (0..tiles).map(|_| weight(&mut rng)).collect();
            shares.set_all(|tile| (weights[tile], 1.0));
            let (scale, mut counts) = (scale(&shares, 500.0), vec![0.0; tiles]);
            (0..400).for_each(|_| _ = drawn(&mut shares, scale, &mut counts));
            for (tile, want) in shares.all(scale.0, scale.1).into_iter().enumerate() {
                let off = counts[tile] - 400.0 * f64::from(want);
                assert!(off.abs() < 2.0 + 1e-4 * counts[tile], "{tile} of {tiles}: off by {off}");
            }
        }
    }

    #[test]
    fn shares_that_change_all_the_time_are_kept_on_average_in_4k() {
        let (tiles, mut rng) = (480 * 270, Rng::new(7));
        let mut shares = Shares::new(tiles, &mut rng);
        shares.set_all(|_| (3e-4, 1.0));
        let (mut counts, mut wanted) = (vec![0.0; tiles], vec![0.0; tiles]);
        for _ in 0..200 {
            for _ in 0..938 {
                // A tenth of the tiles changes.
                let tile = rng.below(tiles as u32 / 10) as usize;
                shares.set(tile, weight(&mut rng));
            }
            let scale = scale(&shares, 9380.0);
            drawn(&mut shares, scale, &mut counts);
            wanted
                .iter_mut()
                .zip(shares.all(scale.0, scale.1))
                .for_each(|(w, q)| *w += f64::from(q));
        }
        let total: f64 = counts.iter().sum();
        assert!((total - 200.0 * 9380.0).abs() < tiles as f64 / BLOCK as f64, "{total}");
        // Who is even a draw ahead of their share in the mean over many tiles would be seen here.
        for (part, tiles) in [(0..tiles / 10), (tiles / 10..tiles)].into_iter().enumerate() {
            let of = |numbers: &[f64]| numbers[tiles.clone()].iter().sum::<f64>();
            assert!((of(&counts) / of(&wanted) - 1.0).abs() < 0.01, "part {part}");
        }
        let off = counts.iter().zip(&wanted).map(|(count, wanted)| (count - wanted).abs());
        let farthest = off.fold(0.0, f64::max);
        assert!(farthest < 4.0, "a tile is {farthest} draws off");
    }

    #[test]
    fn sums_of_blocks_are_those_of_their_tiles() {
        let mut rng = Rng::new(9);
        let mut shares = Shares::with_blocks(1000, true, &mut rng);
        shares.set_all(|tile| (0.1, (tile % 3) as f32));
        let mut counts = vec![0.0; 1000];
        for _ in 0..3000 {
            for _ in 0..50 {
                shares.set(rng.below(1000) as usize, weight(&mut rng));
            }
            let scale = scale(&shares, 50.0);
            drawn(&mut shares, scale, &mut counts);
        }
        let scratch: f64 = shares.blocks.iter().flat_map(|block| block.weight).map(f64::from).sum();
        assert!((shares.sums().weight / scratch - 1.0).abs() < 1e-6, "{scratch}");
        for (kept, block) in shares.turns.weights().iter().zip(&shares.blocks) {
            assert!((kept - block.sums().0).abs() < 1e-5, "{kept}, not {}", block.sums().0);
        }
    }

    #[test]
    fn who_has_no_share_is_never_drawn() {
        let mut rng = Rng::new(11);
        for with_blocks in [false, true] {
            let mut shares = Shares::with_blocks(37, with_blocks, &mut rng);
            let mut counts = vec![0.0; 37];
            assert_eq!(drawn(&mut shares, (1.0, 1.0), &mut counts), 0, "nobody has");
            shares.set_all(|tile| (if tile % 5 == 0 { 1.0 } else { 0.0 }, 0.0));
            (0..100).for_each(|_| _ = drawn(&mut shares, (1.0, 1.0), &mut counts));
            for (tile, &count) in counts.iter().enumerate() {
                assert_eq!(count > 0.0, tile % 5 == 0, "{tile}: {count}");
            }
        }
    }
}
