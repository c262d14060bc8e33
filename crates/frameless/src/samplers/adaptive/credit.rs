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
use super::order::{self, Order};
use super::shares::Shares;
use crate::rates::Rates;
use crate::traced::{Mark, Place};
use crate::{Canvas, Rng, Time};

/// ε: the part of the samples that is spread evenly over the picture, so that every pixel has a floor frequency.
const EVENLY: f32 = 0.2;
/// Added to v: so that a picture at rest is refined evenly.
const LEAST_RATE: f32 = 1e-7;

/// Whose turn it is, among the tiles and in each of them.
pub(crate) struct Credit {
    shares: Shares,
    order: Order,
    /// Whether all tiles have the same share.
    evenly: bool,
    tiles: Vec<u32>,
    /// The first pixel of each.
    first: Vec<Place>,
}

/// m √v.
#[inline]
fn weight(m: f32, rate: f32) -> f32 {
    m * (rate + LEAST_RATE).sqrt()
}

impl Credit {
    pub(crate) fn new(tiles: usize, without: Option<AdaptiveStage>, rng: &mut Rng) -> Credit {
        let shares = Shares::new(tiles, rng);
        let mut order = Order::new(tiles, rng);
        if without == Some(AdaptiveStage::Bayer) {
            order.forget(Rng::new(u64::from(rng.next_u32())));
        }
        let evenly = without == Some(AdaptiveStage::Rates);
        Credit { shares, order, evenly, tiles: Vec::new(), first: Vec::new() }
    }

    /// What tiles count has changed, all at once.
    pub(crate) fn weigh_all(&mut self, rates: &Rates, m: impl Fn(usize) -> f32) {
        self.shares.set_all(|tile| (weight(m(tile), rates.of_tile(tile)), 1.0));
    }

    /// A tile's v has changed.
    #[inline]
    pub(crate) fn weigh(&mut self, tile: usize, m: f32, rate: f32) {
        self.shares.set(tile, weight(m, rate));
    }

    /// Begin to fetch what [`Credit::weigh`] changes.
    #[inline]
    pub(crate) fn prefetch(&self, tile: usize) {
        self.shares.prefetch(tile);
    }

    /// (a, b) of [`Shares::draw`] for a number of samples, of which `least_even` are spread evenly at the least.
    fn scale(&self, count: f32, least_even: f32) -> (f32, f32) {
        let sums = self.shares.sums();
        let is_even = self.evenly || sums.weight <= 0.0;
        let evenly = if is_even { 1.0 } else { EVENLY.max(least_even / count).min(1.0) };
        let per_weight = f64::from((1.0 - evenly) * count) / sums.weight.max(f64::MIN_POSITIVE);
        (per_weight as f32, evenly * count / sums.even as f32)
    }

    /// The part of the samples that each tile gets, of those that holes and fronts leave.
    pub(crate) fn shares(&self) -> Vec<f32> {
        let (a, b) = self.scale(1.0, 0.0);
        self.shares.all(a, b)
    }

    /// Gives out about `count` samples, exactly on average; `least_even` of them are spread evenly, if they are as many.
    pub(crate) fn draw(
        &mut self,
        now: Time,
        canvas: &Canvas,
        rates: &Rates,
        [count, least_even]: [f32; 2],
        mut take: impl FnMut(Place),
    ) {
        let (a, b) = self.scale(count, least_even);
        self.tiles.clear();
        self.shares.draw(a, b, &mut self.tiles);
        // What is looked at lies all over the picture. In a loop so short many places are fetched at once.
        let traced = canvas.traced();
        self.first.clear();
        for &tile in &self.tiles {
            rates.prefetch(tile as usize);
            let place = self.order.next(&rates.grid, tile as usize);
            traced.prefetch(place);
            self.first.push(place);
        }
        let now = Mark::at(now);
        for &first in &self.first {
            let (age, enough) = (traced.mark(first).age(now), order::enough(rates, first.tile()));
            take(self.order.old_enough(now, traced, enough, (first, age)));
        }
    }
}
