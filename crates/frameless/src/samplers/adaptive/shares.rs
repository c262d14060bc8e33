//! Tiles drawn in proportion to their shares, exactly on average: of every [block](super::block) of 16, and then of the tiles in it.
//!
//! ```text
//! got ← got + a · Σ w + b · Σ e     for every block, once per draw of a Σ w + b Σ e tiles
//! if got ≥ g:   that many tiles of the block are drawn, got ← 0
//! g = number of blocks / 100, in [1, 2.8]
//! ```
//!
//! So what a sweep looks at is a 16th of the tiles: in 4K that takes as long as in small pictures one over all of them. Blocks that get little are
//! left alone meanwhile, and those drawn from are looked at once for several tiles. In small pictures most blocks have a draw or two per batch
//! in any case; in large ones they wait for two or three, since each look at a block waits for memory. More at a time would be faster still, but then what
//! a block has got is shared out by weights that have changed meanwhile.

use super::block::{BLOCK, Due, push_bits, sum};
use crate::Rng;
use crate::tile::{PerTile, halves};
use crate::wide::{self, F8, Task, Unit};

/// How many blocks are swept over at a time: one for each bit of a mask.
const LANES: usize = 32;
/// The most draws that a block waits for.
const MOST_AT_ONCE: f32 = 2.8;
/// For every so many blocks (102,400 pixels) it waits for one more.
const BLOCKS_PER_DRAW: f32 = 100.0;
/// How many blocks ahead of the one at hand the next is fetched.
const AHEAD: usize = 16;

/// w of all tiles, at least 0.
pub(super) trait Weigh {
    /// Of a block's tiles, half by half; something for those that are not there.
    fn halves<U: Unit>(&self, block: usize) -> [F8<U>; 2];
    /// Begin to fetch what these are made of.
    fn prefetch(&self, block: usize);
}

impl Weigh for PerTile {
    #[inline(always)]
    fn halves<U: Unit>(&self, block: usize) -> [F8<U>; 2] {
        PerTile::halves(self, block)
    }

    #[inline(always)]
    fn prefetch(&self, block: usize) {
        PerTile::prefetch(self, block);
    }
}

/// Shares and credits of all tiles.
pub(super) struct Shares {
    tiles: usize,
    /// c.
    credit: PerTile,
    /// e; no lines: all are 1.
    evens: PerTile,
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
    /// Blocks of which a weight is another one now, room for all, and how many there are.
    touched: Vec<u32>,
    count_touched: usize,
    is_touched: Vec<bool>,
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
        let mut credit = PerTile::new(tiles);
        credit.all_mut().for_each(|credit| *credit = f32::NEG_INFINITY);
        (0..tiles).for_each(|tile| *credit.of_mut(tile) = rng.unit_f32());
        let nothing = vec![0.0; credit.lines().next_multiple_of(LANES)];
        let at_once = (credit.lines() as f32 / BLOCKS_PER_DRAW).clamp(1.0, MOST_AT_ONCE);
        let mut got = nothing.clone();
        got[..credit.lines()].fill_with(|| at_once * rng.unit_f32());
        let (weight, even) = (nothing.clone(), nothing);
        let in_last = tiles - tiles.saturating_sub(1) / BLOCK * BLOCK;
        let last = std::array::from_fn(|i| if i < in_last { 1.0 } else { 0.0 });
        let blocks = credit.lines();
        Shares {
            tiles,
            credit,
            evens: PerTile::default(),
            last,
            got,
            weight,
            even,
            even_sum: 0.0,
            at_once,
            due: Vec::new(),
            touched: vec![0; blocks + 1],
            count_touched: 0,
            is_touched: vec![false; blocks],
        }
    }

    /// 1 for the tiles of a block that are there.
    #[inline(always)]
    fn there(&self, block: usize) -> &[f32; BLOCK] {
        if block + 1 < self.credit.lines() { &[1.0; BLOCK] } else { &self.last }
    }

    /// e of a block's tiles.
    #[inline(always)]
    fn even_of(&self, block: usize) -> &[f32; BLOCK] {
        if self.evens.lines() == 0 { self.there(block) } else { self.evens.line(block) }
    }

    /// w of a block's tiles.
    #[inline(always)]
    fn weights_of<U: Unit>(&self, block: usize, weights: &impl Weigh) -> [F8<U>; 2] {
        let ([there_left, there_right], [left, right]) =
            (halves(self.there(block)), weights.halves(block));
        [left * there_left, right * there_right]
    }

    /// Over all tiles.
    pub(super) fn sums(&self) -> Sums {
        // Side by side, and in an order that is always the same.
        let mut lanes = [0.0f32; LANES];
        for chunk in self.weight.as_chunks::<LANES>().0 {
            lanes.iter_mut().zip(chunk).for_each(|(sum, weight)| *sum += weight);
        }
        let weight = lanes.iter().map(|&weight| f64::from(weight)).sum();
        Sums { weight, even: self.even_sum }
    }

    /// All weights are others now.
    pub(super) fn weigh_all(&mut self, weights: &impl Weigh) {
        struct SumAll<'a, W>(&'a mut Shares, &'a W);
        impl<W: Weigh> Task for SumAll<'_, W> {
            #[inline(always)]
            fn run<U: Unit>(self) {
                let SumAll(shares, weights) = self;
                for block in 0..shares.credit.lines() {
                    shares.weight[block] = sum(shares.weights_of::<U>(block, weights));
                    shares.even[block] = sum(halves::<U>(shares.even_of(block)));
                }
            }
        }
        wide::run(SumAll(self, weights));
        self.even_sum = self.even.iter().map(|&even| f64::from(even)).sum();
    }

    /// e of all tiles are others now, at least 0; [`Shares::weigh_all`] is to be called next.
    pub(super) fn set_evens(&mut self, even: impl Fn(usize) -> f32) {
        if self.evens.lines() == 0 {
            self.evens = PerTile::new(self.tiles);
        }
        (0..self.tiles).for_each(|tile| *self.evens.of_mut(tile) = even(tile));
    }

    /// w of a tile is another one now; [`Shares::renew`] is to be called before anything is drawn.
    #[inline(always)]
    pub(super) fn touch(&mut self, tile: usize) {
        let block = tile / BLOCK;
        // Written in any case, so that nobody has to guess whether it has been already.
        self.touched[self.count_touched] = block as u32;
        self.count_touched += usize::from(!std::mem::replace(&mut self.is_touched[block], true));
    }

    /// Adds up the weights of the blocks that were touched.
    pub(super) fn renew(&mut self, weights: &impl Weigh) {
        struct Renew<'a, W>(&'a mut Shares, &'a W);
        impl<W: Weigh> Task for Renew<'_, W> {
            #[inline(always)]
            fn run<U: Unit>(self) {
                let Renew(shares, weights) = self;
                for i in 0..std::mem::take(&mut shares.count_touched) {
                    let block = shares.touched[i] as usize;
                    shares.is_touched[block] = false;
                    shares.weight[block] = sum(shares.weights_of::<U>(block, weights));
                }
            }
        }
        wide::run(Renew(self, weights));
    }

    /// q of every tile.
    pub(super) fn all(&self, a: f32, b: f32, weights: &impl Weigh) -> Vec<f32> {
        struct All<'a, W>(&'a Shares, [f32; 2], &'a W, &'a mut Vec<f32>);
        impl<W: Weigh> Task for All<'_, W> {
            #[inline(always)]
            fn run<U: Unit>(self) {
                let All(shares, [a, b], weights, all) = self;
                for block in 0..shares.credit.lines() {
                    let weights = shares.weights_of::<U>(block, weights);
                    for (weight, even) in weights.into_iter().zip(halves(shares.even_of(block))) {
                        all.extend((F8::splat(a) * weight + F8::splat(b) * even).lanes());
                    }
                }
            }
        }
        let mut all = Vec::new();
        wide::run(All(self, [a, b], weights, &mut all));
        all.truncate(self.tiles);
        all
    }

    /// Appends the tiles that are drawn: a Σ w + b Σ e of them on average.
    pub(super) fn draw(&mut self, a: f32, b: f32, weights: &impl Weigh, tiles: &mut Vec<u32>) {
        wide::run(Draw { shares: self, a, b, weights, tiles });
    }
}

/// See [`Shares::draw`].
struct Draw<'a, W> {
    shares: &'a mut Shares,
    a: f32,
    b: f32,
    weights: &'a W,
    tiles: &'a mut Vec<u32>,
}

impl<W: Weigh> Task for Draw<'_, W> {
    #[inline(always)]
    fn run<U: Unit>(self) {
        let Draw { shares, a, b, weights, tiles } = self;
        shares.give::<U>(a, b);
        for i in 0..shares.due.len() {
            if let Some(&later) = shares.due.get(i + AHEAD) {
                shares.credit.prefetch(later as usize);
                weights.prefetch(later as usize);
                if shares.evens.lines() > 0 {
                    shares.evens.prefetch(later as usize);
                }
            }
            let block = shares.due[i] as usize;
            // Who is not there is never drawn, whatever its weight.
            let [w_left, w_right] = weights.halves::<U>(block);
            let (per_weight, per_even) = (F8::splat(a), F8::splat(b));
            let [e_left, e_right] = match shares.evens.lines() {
                0 => [per_even; 2],
                _ => {
                    let [left, right] = shares.evens.halves(block);
                    [per_even * left, per_even * right]
                }
            };
            let due = Due {
                got: std::mem::take(&mut shares.got[block]),
                shares: [per_weight * w_left + e_left, per_weight * w_right + e_right],
                sum: a * shares.weight[block] + b * shares.even[block],
                first: (block * BLOCK) as u32,
            };
            due.draw(shares.credit.line_mut(block), tiles);
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
            let mut due = 0;
            for eight in (0..LANES).step_by(8) {
                let blocks = first + eight;
                let gets = a * F8::load(&self.weight, blocks) + b * F8::load(&self.even, blocks);
                let got = F8::load(&self.got, blocks) + gets;
                got.store(&mut self.got, blocks);
                due |= got.less_than(at_once).not().bits() << eight;
            }
            push_bits(&mut self.due, first as u32, due);
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

    /// Shares, and weights of their own.
    struct Weighed(Shares, PerTile);

    impl Weighed {
        fn new(tiles: usize, rng: &mut Rng) -> Weighed {
            Weighed(Shares::new(tiles, rng), PerTile::new(tiles))
        }

        fn set_all(&mut self, share: impl Fn(usize) -> (f32, f32)) {
            let Weighed(shares, weights) = self;
            (0..shares.tiles).for_each(|tile| *weights.of_mut(tile) = share(tile).0);
            shares.set_evens(|tile| share(tile).1);
            shares.weigh_all(weights);
        }

        fn set(&mut self, tile: usize, weight: f32) {
            *self.1.of_mut(tile) = weight;
            self.0.touch(tile);
        }

        fn all(&self, a: f32, b: f32) -> Vec<f32> {
            self.0.all(a, b, &self.1)
        }
    }

    fn drawn(
        Weighed(shares, weights): &mut Weighed,
        (a, b): (f32, f32),
        counts: &mut [f64],
    ) -> usize {
        let mut tiles = Vec::new();
        shares.draw(a, b, weights, &mut tiles);
        tiles.iter().for_each(|&tile| counts[tile as usize] += 1.0);
        tiles.len()
    }

    /// (a, b) for so many draws, a fifth of them even.
    fn scale(Weighed(shares, weights): &mut Weighed, count: f64) -> (f32, f32) {
        shares.renew(weights);
        let sums = shares.sums();
        ((0.8 * count / sums.weight) as f32, (0.2 * count / sums.even) as f32)
    }

    #[test]
    fn everybody_is_drawn_as_often_as_their_share_says_within_two() {
        let mut rng = Rng::new(5);
        let sizes = [1, 7, 16, 100, 3072];
        for tiles in sizes {
            let mut shares = Weighed::new(tiles, &mut rng);
            let weights: Vec<f32> = (0..tiles).map(|_| weight(&mut rng)).collect();
            shares.set_all(|tile| (weights[tile], 1.0));
            let (scale, mut counts) = (scale(&mut shares, 500.0), vec![0.0; tiles]);
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
        let mut shares = Weighed::new(tiles, &mut rng);
        shares.set_all(|_| (3e-4, 1.0));
        let (mut counts, mut wanted) = (vec![0.0; tiles], vec![0.0; tiles]);
        for _ in 0..200 {
            for _ in 0..938 {
                // A tenth of the tiles changes.
                let tile = rng.below(tiles as u32 / 10) as usize;
                shares.set(tile, weight(&mut rng));
            }
            let scale = scale(&mut shares, 9380.0);
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
        let mut shares = Weighed::new(1000, &mut rng);
        shares.set_all(|tile| (0.1, (tile % 3) as f32));
        let mut counts = vec![0.0; 1000];
        for _ in 0..3000 {
            for _ in 0..50 {
                shares.set(rng.below(1000) as usize, weight(&mut rng));
            }
            let scale = scale(&mut shares, 50.0);
            drawn(&mut shares, scale, &mut counts);
        }
        let Weighed(shares, weights) = shares;
        let scratch: f64 = (0..1000).map(|tile| f64::from(weights.of(tile))).sum();
        assert!((shares.sums().weight / scratch - 1.0).abs() < 1e-6, "{scratch}");
        for (block, kept) in shares.weight[..weights.lines()].iter().enumerate() {
            let sum: f32 = weights.line(block).iter().sum();
            assert!((kept - sum).abs() < 1e-5, "{kept}, not {sum}");
        }
    }

    #[test]
    fn who_has_no_share_is_never_drawn() {
        let mut rng = Rng::new(11);
        let mut shares = Weighed::new(37, &mut rng);
        let mut counts = vec![0.0; 37];
        assert_eq!(drawn(&mut shares, (1.0, 1.0), &mut counts), 0, "nobody has");
        shares.set_all(|tile| (if tile % 5 == 0 { 1.0 } else { 0.0 }, 0.0));
        (0..100).for_each(|_| _ = drawn(&mut shares, (1.0, 1.0), &mut counts));
        for (tile, &count) in counts.iter().enumerate() {
            assert_eq!(count > 0.0, tile % 5 == 0, "{tile}: {count}");
        }
    }
}
