//! The tiles' share: by what is learned of their change, with an even part for all.
//!
//! ```text
//! share of tile i of N = (1 − ε) m_i √v_i / Σ m√v + ε / N
//! ```
//!
//! However much of a batch goes to refinement, the even part is 3 % of what holes, fronts and late looks leave: no pixel is
//! older than N pixels · 1.5 / (samples per second · 0.6 · 0.4 · 0.6 · 0.03), and that only while all three take all they may.
//!
//! The square root is the optimum for jump-like change: a pixel traced f times a second with an error that grows like v · age is
//! off by v / 2f on average, and Σ v_i / f_i at given Σ f_i is least for f_i ∝ √v_i. m_i is how much the tile counts
//! ([`weights`](super::weights)); the even part is not weighted.

use super::AdaptiveStage;
use super::block::BLOCK;
use super::order::Order;
use super::shares::{Shares, Sums, Weigh};
use super::tiles::{Tile, Tiles};
use super::why::Why;
use crate::rates::Rates;
use crate::tile::TileGrid;
use crate::traced::{Place, TILE_PIXELS};
use crate::wide::{self, F8, Task, Unit};
use crate::{Request, Rng};

/// ε: the part of the samples that is spread evenly over the picture, so that every pixel has a floor frequency.
const EVENLY: f32 = 0.2;
/// Added to v: so that a picture at rest is refined evenly.
const LEAST_RATE: f32 = 1e-7;

/// How many tiles ahead of the one at hand the next is fetched.
const AHEAD: usize = 96;

/// Whose turn it is, among the tiles and in each of them.
pub(crate) struct Credit {
    shares: Shares,
    order: Order,
    /// Whether all tiles have the same share.
    evenly: bool,
    /// Of the draw at hand.
    drawn: Vec<u32>,
}

/// m √v of all tiles.
pub(super) struct ByRate<'a> {
    pub(super) rates: &'a Rates,
    /// m; empty: all are 1.
    pub(super) m: &'a [f32],
}

impl Weigh for ByRate<'_> {
    #[inline(always)]
    fn halves<U: Unit>(&self, block: usize) -> [F8<U>; 2] {
        let [left, right] = self.rates.of_tiles().halves(block);
        let least = F8::splat(LEAST_RATE);
        let roots = [(left + least).sqrt(), (right + least).sqrt()];
        if self.m.is_empty() {
            return roots;
        }
        let (rest, mut m) = (&self.m[block * BLOCK..], [0.0; BLOCK]);
        let tiles = rest.len().min(BLOCK);
        m[..tiles].copy_from_slice(&rest[..tiles]);
        [F8::load(&m, 0) * roots[0], F8::load(&m, BLOCK / 2) * roots[1]]
    }

    #[inline(always)]
    fn prefetch(&self, block: usize) {
        self.rates.of_tiles().prefetch(block);
    }
}

impl Credit {
    pub(crate) fn new(
        tiles: &mut Tiles,
        count: usize,
        without: Option<AdaptiveStage>,
        rng: &mut Rng,
    ) -> Credit {
        let shares = Shares::new(count, rng);
        let mut order = Order::new();
        tiles.all_mut().for_each(|tile| tile.turn = Order::begin(rng));
        if without == Some(AdaptiveStage::Bayer) {
            order.forget(Rng::new(u64::from(rng.next_u32())));
        }
        let evenly = without == Some(AdaptiveStage::Rates);
        Credit { shares, order, evenly, drawn: Vec::new() }
    }

    /// What tiles count has changed, all at once.
    pub(crate) fn weigh_all(&mut self, weights: &ByRate) {
        self.shares.weigh_all(weights);
    }

    /// A tile's v has changed.
    #[inline(always)]
    pub(crate) fn touch(&mut self, tile: usize) {
        self.shares.touch(tile);
    }

    /// (a, b) of [`Shares::draw`] for a number of samples, of which `least_even` are spread evenly at the least.
    fn scale(&self, sums: Sums, [count, least_even]: [f32; 2]) -> (f32, f32) {
        let is_even = self.evenly || sums.weight <= 0.0;
        let evenly = if is_even { 1.0 } else { EVENLY.max(least_even / count).min(1.0) };
        let per_weight = f64::from((1.0 - evenly) * count) / sums.weight.max(f64::MIN_POSITIVE);
        (per_weight as f32, evenly * count / sums.even as f32)
    }

    /// The part of the samples that each tile gets, of those that holes and fronts leave.
    pub(crate) fn shares(&self, weights: &ByRate) -> Vec<f32> {
        // Of the rates as they are now: sums are as they were when tiles were drawn last.
        let sum = |numbers: Vec<f32>| numbers.into_iter().map(f64::from).sum();
        let weight = sum(self.shares.all(1.0, 0.0, weights));
        let even = sum(self.shares.all(0.0, 1.0, weights));
        let (a, b) = self.scale(Sums { weight, even }, [1.0, 0.0]);
        self.shares.all(a, b, weights)
    }

    /// Gives out about as many samples as the first of `counts`, exactly on average; the second of them are spread evenly, if they are as many.
    pub(crate) fn draw(
        &mut self,
        weights: &ByRate,
        tiles: &mut Tiles,
        counts: [f32; 2],
        requests: &mut Vec<Request>,
    ) {
        self.shares.renew(weights);
        let (a, b) = self.scale(self.shares.sums(), counts);
        self.drawn.clear();
        self.shares.draw(a, b, weights, &mut self.drawn);
        let Credit { order, drawn, .. } = self;
        wide::run(Look { order, drawn, grid: &weights.rates.grid, tiles, requests });
    }
}

/// Looks for the next pixel of every tile that is drawn.
struct Look<'a> {
    order: &'a mut Order,
    drawn: &'a [u32],
    grid: &'a TileGrid,
    tiles: &'a mut Tiles,
    requests: &'a mut Vec<Request>,
}

impl Task for Look<'_> {
    #[inline(always)]
    fn run<U: Unit>(self) {
        let Look { order, drawn, grid, tiles, requests } = self;
        // What is looked at lies all over the picture: it is fetched before.
        let first = &drawn[..drawn.len().min(AHEAD)];
        first.iter().for_each(|&tile| tiles.prefetch(tile as usize));
        for (i, &tile) in drawn.iter().enumerate() {
            if let Some(&later) = drawn.get(i + AHEAD) {
                tiles.prefetch(later as usize);
            }
            let tile = tile as usize;
            let pixels = grid.pixels_of(tile);
            let Tile { turn, reasons, recent, .. } = tiles.of_mut(tile);
            let within = order.next_but_recent(pixels, recent, turn);
            reasons.set(1 << within, Why::Tile);
            requests.push(Request::centre(grid.pixel(Place(TILE_PIXELS * tile + within))));
        }
    }
}
