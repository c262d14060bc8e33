//! Tiles drawn in proportion to their shares, exactly on average: of every [block](super::block) of 16, and then of the tiles in it.
//!
//! ```text
//! got ← got + a · Σ w + b · Σ e     for every block, once per draw of a Σ w + b Σ e tiles
//! if got ≥ g:   that many tiles of the block are drawn, got ← 0
//! g = number of blocks / 100, in [1, 2]
//! ```
//!
//! So what a sweep looks at is a 16th of the tiles: in 4K that takes as long as in small pictures one over all of them. Blocks that get little are
//! left alone meanwhile, and those drawn from are looked at once for several tiles. In small pictures most blocks have a draw or two per batch
//! in any case; in large ones they wait for two, since each look at a block waits for memory. More at a time would be faster still, but then what
//! a block has got is shared out by weights that have changed meanwhile.

use super::block::{BLOCK, Block, sum};
use crate::Rng;
use crate::wide::{self, F8, Task, Unit};

/// How many blocks are worked on at a time.
const LANES: usize = 8;
/// The most draws that a block waits for.
const MOST_AT_ONCE: f32 = 2.0;
/// For every so many blocks (102,400 pixels) it waits for one more.
const BLOCKS_PER_DRAW: f32 = 100.0;
/// How many blocks ahead of the one at hand the next is fetched.
const AHEAD: usize = 8;

/// Shares and credits of all tiles.
pub(super) struct Shares {
    tiles: usize,
    blocks: Vec<Block>,
    /// e of the blocks' tiles; empty: all are 1.
    evens: Vec<[f32; BLOCK]>,
    /// 1 for the tiles of the last block that are there.
    last: [f32; BLOCK],
    /// Of every block, and of some that are not there and have nothing.
    got: Vec<f32>,
    /// Σ w.
    weight: Vec<f32>,
    /// Σ e.
    even: Vec<f32>,
    /// Over all tiles.
    even_sum: f64,
    /// g.
    at_once: f32,
    /// Blocks that are drawn from.
    due: Vec<u32>,
}

/// Over all tiles.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Sums {
    /// Σ w.
    pub(super) weight: f64,
    /// Σ e.
    pub(super) even: f64,
}

impl Shares {
    /// Nobody has a share yet. How soon tiles are drawn first is random.
    pub(super) fn new(tiles: usize, rng: &mut Rng) -> Shares {
        let mut blocks = vec![Block::default(); tiles.div_ceil(BLOCK)];
        for tile in 0..tiles {
            blocks[tile / BLOCK].credit[tile % BLOCK] = rng.unit_f32();
        }
        let nothing = vec![0.0; blocks.len().next_multiple_of(LANES)];
        let at_once = (blocks.len() as f32 / BLOCKS_PER_DRAW).clamp(1.0, MOST_AT_ONCE);
        let got = blocks.iter().map(|_| at_once * rng.unit_f32());
        let mut got: Vec<f32> = got.collect();
        got.resize(nothing.len(), 0.0);
        let (weight, even) = (nothing.clone(), nothing);
        let in_last = tiles - tiles.saturating_sub(1) / BLOCK * BLOCK;
        let last = std::array::from_fn(|i| if i < in_last { 1.0 } else { 0.0 });
        let (evens, due) = (Vec::new(), Vec::new());
        Shares { tiles, blocks, evens, last, got, weight, even, even_sum: 0.0, at_once, due }
    }

    /// e of a block's tiles.
    #[inline(always)]
    fn even_of(&self, block: usize) -> &[f32; BLOCK] {
        match self.evens.get(block) {
            Some(even) => even,
            None if block + 1 < self.blocks.len() => &[1.0; BLOCK],
            None => &self.last,
        }
    }

    /// Over all tiles.
    pub(super) fn sums(&self) -> Sums {
        // Side by side, and in an order that is always the same.
        let mut lanes = [0.0f32; 4 * LANES];
        let (chunks, rest) = self.weight.as_chunks::<{ 4 * LANES }>();
        for chunk in chunks {
            lanes.iter_mut().zip(chunk).for_each(|(sum, weight)| *sum += weight);
        }
        let weight = lanes.iter().chain(rest).map(|&weight| f64::from(weight)).sum();
        Sums { weight, even: self.even_sum }
    }

    /// w and e of all tiles are others now, all at least 0.
    pub(super) fn set_all(&mut self, share: impl Fn(usize) -> (f32, f32)) {
        self.evens.resize(self.blocks.len(), [0.0; BLOCK]);
        for tile in 0..self.tiles {
            let (block, i) = (tile / BLOCK, tile % BLOCK);
            (self.blocks[block].weight[i], self.evens[block][i]) = share(tile);
        }
        self.sum_all();
    }

    /// The same where e of all tiles is 1.
    pub(super) fn set_weights(&mut self, weight: impl Fn(usize) -> f32) {
        self.evens.clear();
        for tile in 0..self.tiles {
            self.blocks[tile / BLOCK].weight[tile % BLOCK] = weight(tile);
        }
        self.sum_all();
    }

    fn sum_all(&mut self) {
        for (i, block) in self.blocks.iter().enumerate() {
            self.weight[i] = sum(&block.weight);
            self.even[i] = sum(self.even_of(i));
        }
        self.even_sum = self.even.iter().map(|&even| f64::from(even)).sum();
    }

    /// w of a tile is another one now, at least 0.
    #[inline]
    pub(super) fn set(&mut self, tile: usize, weight: f32) {
        let (block, i) = (tile / BLOCK, tile % BLOCK);
        let old = std::mem::replace(&mut self.blocks[block].weight[i], weight);
        // Roundings last until the block is drawn from.
        self.weight[block] = (self.weight[block] + (weight - old)).max(0.0);
    }

    /// Begin to fetch what [`Shares::set`] changes.
    #[inline]
    pub(super) fn prefetch(&self, tile: usize) {
        if let Some(block) = self.blocks.get(tile / BLOCK) {
            wide::prefetch(&block.weight, 0);
        }
    }

    /// q of every tile.
    pub(super) fn all(&self, a: f32, b: f32) -> Vec<f32> {
        let q = |tile: usize| {
            let (block, i) = (tile / BLOCK, tile % BLOCK);
            a * self.blocks[block].weight[i] + b * self.even_of(block)[i]
        };
        (0..self.tiles).map(q).collect()
    }

    /// Appends the tiles that are drawn: a Σ w + b Σ e of them on average.
    pub(super) fn draw(&mut self, a: f32, b: f32, tiles: &mut Vec<u32>) {
        wide::run(Draw { shares: self, a, b, tiles });
    }
}

/// See [`Shares::draw`].
struct Draw<'a> {
    shares: &'a mut Shares,
    a: f32,
    b: f32,
    tiles: &'a mut Vec<u32>,
}

impl Task for Draw<'_> {
    #[inline(always)]
    fn run<U: Unit>(self) {
        let Draw { shares, a, b, tiles } = self;
        shares.give::<U>(a, b);
        for i in 0..shares.due.len() {
            if let Some(&later) = shares.due.get(i + AHEAD) {
                let Block { credit, weight } = &shares.blocks[later as usize];
                wide::prefetch(credit, 0);
                wide::prefetch(weight, 0);
                if !shares.evens.is_empty() {
                    wide::prefetch(&shares.evens, later as usize);
                }
            }
            let number = shares.due[i];
            let (even, got) = (*shares.even_of(number as usize), &mut shares.got[number as usize]);
            let block = &mut shares.blocks[number as usize];
            let take = |tile: usize| tiles.push(number * BLOCK as u32 + tile as u32);
            block.draw::<U>([a, b], &even, std::mem::take(got), take);
            shares.weight[number as usize] = sum(&block.weight);
        }
    }
}

impl Shares {
    /// Gives all blocks what they get, and finds those that are drawn from.
    #[inline(always)]
    fn give<U: Unit>(&mut self, a: f32, b: f32) {
        let (a, b, at_once) = (F8::<U>::splat(a), F8::splat(b), F8::splat(self.at_once));
        self.due.clear();
        for first in (0..self.got.len()).step_by(LANES) {
            let gets = a * F8::load(&self.weight, first) + b * F8::load(&self.even, first);
            let got = F8::load(&self.got, first) + gets;
            self.got[first..first + LANES].copy_from_slice(&got.lanes());
            let mut due = !got.less_than(at_once).bits() & 255;
            while due != 0 {
                self.due.push(first as u32 + due.trailing_zeros());
                due &= due - 1;
            }
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
        for tiles in sizes {
            let mut shares = Shares::new(tiles, &mut rng);
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
        let mut shares = Shares::new(1000, &mut rng);
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
        for (kept, block) in shares.weight.iter().zip(&shares.blocks) {
            assert!((kept - sum(&block.weight)).abs() < 1e-5, "{kept}, not {block:?}");
        }
    }

    #[test]
    fn who_has_no_share_is_never_drawn() {
        let mut rng = Rng::new(11);
        let mut shares = Shares::new(37, &mut rng);
        let mut counts = vec![0.0; 37];
        assert_eq!(drawn(&mut shares, (1.0, 1.0), &mut counts), 0, "nobody has");
        shares.set_all(|tile| (if tile % 5 == 0 { 1.0 } else { 0.0 }, 0.0));
        (0..100).for_each(|_| _ = drawn(&mut shares, (1.0, 1.0), &mut counts));
        for (tile, &count) in counts.iter().enumerate() {
            assert_eq!(count > 0.0, tile % 5 == 0, "{tile}: {count}");
        }
    }
}
