//! The even share of the tiles: a deterministic draw by credit, and Bayer's order inside a tile.
//!
//! ```text
//! c_i ← c_i + n · ((1 − ε) m_i √v_i / Σ m√v + ε / N)    for every tile i of N, n samples to be given out
//! while c_i ≥ 1:  c_i ← c_i − 1, draw tile i
//! ```
//!
//! The square root is the optimum for jump-like change: a pixel traced f times a second with an error that grows like v · age is
//! off by v / 2f on average, and Σ v_i / f_i at given Σ f_i is least for f_i ∝ √v_i. m_i is how much the tile counts
//! ([`weights`](super::weights)); the even part is not weighted.

use super::AdaptiveStage;
use crate::bayer;
use crate::rates::Rates;
use crate::{Canvas, Rng, Time, wide};

/// ε: the part of the samples that is spread evenly over the picture, so that every pixel has a floor frequency.
const EVENLY: f32 = 0.2;
/// Added to v: so that a picture at rest is refined evenly.
const LEAST_RATE: f32 = 1e-7;
/// Pixels looked at before one is taken that is younger than half the mean age of its tile.
const TRIES: u32 = 4;

/// Credits and places in the order, per tile.
pub(crate) struct Credit {
    credit: Vec<f32>,
    place: Vec<u32>,
    weight: Vec<f32>,
    /// Tiles that have a whole credit.
    rich: Vec<u32>,
    /// Pixels of a tile in their order, relative to its corner.
    order: Vec<(u32, u32)>,
    /// Draws places instead of the order, if that is left out.
    random: Option<Rng>,
    /// Whether all tiles weigh the same.
    evenly: bool,
}

/// m √v of every tile; without `weights` all m are 1.
fn weigh(rates: &[f32], weights: &[f32], weighed: &mut [f32]) {
    // Flat loops, one thing each: the compiler makes vectors of them.
    for (weighed, rate) in weighed.iter_mut().zip(rates) {
        *weighed = (rate + LEAST_RATE).sqrt();
    }
    for (weighed, m) in weighed.iter_mut().zip(weights) {
        *weighed *= m;
    }
}

impl Credit {
    pub(crate) fn new(
        tiles: usize,
        side_bits: u32,
        without: Option<AdaptiveStage>,
        rng: &mut Rng,
    ) -> Credit {
        Credit {
            credit: (0..tiles).map(|_| rng.unit_f32()).collect(),
            place: (0..tiles).map(|_| rng.next_u32()).collect(),
            weight: vec![0.0; tiles],
            rich: Vec::new(),
            order: bayer::order(side_bits),
            random: (without == Some(AdaptiveStage::Bayer))
                .then(|| Rng::new(u64::from(rng.next_u32()))),
            evenly: without == Some(AdaptiveStage::Rates),
        }
    }

    /// The part of the samples that each tile gets, of those that holes and fronts leave.
    pub(crate) fn shares(&self, rates: &[f32], weights: &[f32]) -> Vec<f32> {
        let evenly = 1.0 / rates.len() as f32;
        if self.evenly {
            return vec![evenly; rates.len()];
        }
        let mut shares = vec![0.0; rates.len()];
        weigh(rates, weights, &mut shares);
        let sum: f32 = shares.iter().sum();
        shares
            .iter_mut()
            .for_each(|share| *share = (1.0 - EVENLY) * *share / sum + EVENLY * evenly);
        shares
    }

    /// Gives out about `count` samples; exactly on average.
    pub(crate) fn draw(
        &mut self,
        now: Time,
        canvas: &Canvas,
        (rates, weights): (&Rates, &[f32]),
        count: f32,
        mut take: impl FnMut(u32),
    ) {
        let tiles = self.credit.len();
        weigh(rates.all(), weights, &mut self.weight);
        if self.evenly {
            self.weight.fill(1.0);
        }
        let sum: f32 = self.weight.iter().sum();
        let (per_weight, evenly) = ((1.0 - EVENLY) * count / sum, EVENLY * count / tiles as f32);
        for (credit, weight) in self.credit.iter_mut().zip(&self.weight) {
            *credit += per_weight * weight + evenly;
        }
        self.rich.clear();
        let rich = (0..).zip(&self.credit).filter(|(_, credit)| **credit >= 1.0);
        self.rich.extend(rich.map(|(tile, _)| tile));
        // What is looked at lies all over the picture: fetched many at a time instead of one after the other.
        for &tile in &self.rich {
            let rect = rates.grid.rect(tile as usize);
            let (dx, dy) = self.order[self.place[tile as usize] as usize & (self.order.len() - 1)];
            let i = canvas
                .size()
                .index((rect.x0 + dx).min(rect.x1 - 1), (rect.y0 + dy).min(rect.y1 - 1))
                as usize;
            wide::prefetch(canvas.known(), i);
            wide::prefetch(canvas.time(), i);
        }
        for i in 0..self.rich.len() {
            let tile = self.rich[i] as usize;
            while self.credit[tile] >= 1.0 {
                self.credit[tile] -= 1.0;
                take(self.pixel(now, canvas, rates, tile));
            }
        }
    }

    fn pixel(&mut self, now: Time, canvas: &Canvas, rates: &Rates, tile: usize) -> u32 {
        let rect = rates.grid.rect(tile);
        let (mut oldest, mut oldest_secs) = (canvas.size().index(rect.x0, rect.y0), -1.0);
        let enough_secs = 0.5 * rates.mean_age_secs(tile);
        let mut tries = 0;
        while tries < TRIES {
            // As many as a power of two.
            let (dx, dy) = self.order[self.place[tile] as usize & (self.order.len() - 1)];
            self.place[tile] = match &mut self.random {
                Some(rng) => rng.next_u32(),
                None => self.place[tile].wrapping_add(1),
            };
            let (x, y) = (rect.x0 + dx, rect.y0 + dy);
            if x >= rect.x1 || y >= rect.y1 {
                continue;
            }
            tries += 1;
            let pixel = canvas.size().index(x, y);
            let i = pixel as usize;
            let age_secs =
                if canvas.known()[i] { now.secs_since(canvas.time()[i]) as f32 } else { f32::MAX };
            if age_secs > oldest_secs {
                (oldest, oldest_secs) = (pixel, age_secs);
            }
            if age_secs > enough_secs {
                break;
            }
        }
        oldest
    }
}
