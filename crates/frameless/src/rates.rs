//! The learned rate of change of every tile.

use crate::tile::TileGrid;
use crate::{Observation, Size};

/// How fast the picture becomes wrong, tile by tile:
///
/// ```text
/// D ← ρ·D + d/3,   A ← ρ·A + age        for every sample of the tile
/// v = D / A                             mean squared error that a second of age brings, per channel
/// ```
///
/// d is the squared difference between the sample and what was predicted there, age how old the prediction was. The ratio
/// of two decaying sums weighs samples alike however often a tile is sampled.
#[derive(Clone, Debug)]
pub struct Rates {
    pub(crate) grid: TileGrid,
    change: Vec<f32>,
    age_secs: Vec<f32>,
    rate: Vec<f32>,
    mean_age_secs: Vec<f32>,
}

/// ρ: a tile forgets half of what it knew after eight samples.
const MEMORY: f32 = 0.92;
/// Shorter ages count as this long: the clock's batches are about as far apart.
const SHORTEST_AGE_SECS: f32 = 1e-3;

impl Rates {
    pub(crate) fn new(grid: TileGrid) -> Rates {
        let tiles = grid.len();
        Rates {
            grid,
            change: vec![0.0; tiles],
            age_secs: vec![SHORTEST_AGE_SECS; tiles],
            rate: vec![0.0; tiles],
            mean_age_secs: vec![0.0; tiles],
        }
    }

    /// `weight`: below 1 for samples that were not chosen evenly over the tile.
    #[inline]
    pub(crate) fn observe(&mut self, tile: usize, observed: &Observation, weight: f32) {
        let age_secs = observed.now.secs_since(observed.previous) as f32;
        let change = &mut self.change[tile];
        let sum_secs = &mut self.age_secs[tile];
        *change = MEMORY * *change + weight * observed.change * (1.0 / 3.0);
        *sum_secs = MEMORY * *sum_secs + weight * age_secs.max(SHORTEST_AGE_SECS);
        self.rate[tile] = *change / *sum_secs;
        self.mean_age_secs[tile] += 0.05 * (age_secs - self.mean_age_secs[tile]);
    }

    /// v of a tile: squared error per channel and second.
    #[inline]
    pub(crate) fn of_tile(&self, tile: usize) -> f32 {
        self.rate[tile]
    }

    pub(crate) fn all(&self) -> &[f32] {
        &self.rate
    }

    /// How old samples of the tile have been, on average, when they were replaced.
    #[inline]
    pub(crate) fn mean_age_secs(&self, tile: usize) -> f32 {
        self.mean_age_secs[tile]
    }

    /// Of the picture whose tiles these are.
    pub fn size(&self) -> Size {
        self.grid.size
    }

    /// v where a pixel is: squared error per channel and second.
    pub fn of_pixel(&self, pixel: u32) -> f32 {
        self.rate[self.grid.tile_of(pixel)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Time;

    #[test]
    fn a_steady_change_is_learned_and_forgotten() {
        let mut rates = Rates::new(TileGrid::new(Size::new(8, 8), 8));
        let mut observe = |change: f32| {
            let (now, previous) = (Time::from_secs(1.0), Time::from_secs(0.9));
            let observed =
                Observation { pixel: 0, now, previous, known: true, change, refinement: None };
            rates.observe(0, &observed, 1.0);
            rates.of_pixel(63)
        };
        // Σ d/3 over Σ age: 0.01 per 0.1 s.
        let learned = (0..200).map(|_| observe(0.03)).last().expect("a rate");
        assert!((learned - 0.1).abs() < 1e-3, "{learned}");
        let after_eight = (0..8).map(|_| observe(0.0)).last().expect("a rate");
        assert!((after_eight / learned - 0.92f32.powi(8)).abs() < 0.01, "{after_eight}");
    }
}
