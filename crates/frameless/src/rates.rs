//! The learned rate of change of every tile.

use crate::tile::TileGrid;
use crate::{Observation, Size, wide};

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
    tiles: Vec<TileRate>,
}

/// All of a tile in one place: they are looked up together, at random.
#[derive(Clone, Copy, Debug)]
struct TileRate {
    /// D.
    change: f32,
    /// A.
    age_secs: f32,
    /// v.
    rate: f32,
    mean_age_secs: f32,
}

/// ρ: a tile forgets half of what it knew after eight samples.
const MEMORY: f32 = 0.92;
/// Shorter ages count as this long: the clock's batches are about as far apart.
const SHORTEST_AGE_SECS: f32 = 1e-3;

impl Rates {
    pub(crate) fn new(grid: TileGrid) -> Rates {
        let unknown =
            TileRate { change: 0.0, age_secs: SHORTEST_AGE_SECS, rate: 0.0, mean_age_secs: 0.0 };
        let tiles = vec![unknown; grid.len()];
        Rates { grid, tiles }
    }

    /// `weight`: below 1 for samples that were not chosen evenly over the tile. Returns v before and after.
    #[inline]
    pub(crate) fn observe(
        &mut self,
        tile: usize,
        observed: &Observation,
        weight: f32,
    ) -> (f32, f32) {
        let age_secs = observed.now.secs_since(observed.previous) as f32;
        let tile = &mut self.tiles[tile];
        let before = tile.rate;
        tile.change = MEMORY * tile.change + weight * observed.change * (1.0 / 3.0);
        tile.age_secs = MEMORY * tile.age_secs + weight * age_secs.max(SHORTEST_AGE_SECS);
        tile.rate = tile.change / tile.age_secs;
        tile.mean_age_secs += 0.05 * (age_secs - tile.mean_age_secs);
        (before, tile.rate)
    }

    /// v of a tile: squared error per channel and second.
    #[inline]
    pub(crate) fn of_tile(&self, tile: usize) -> f32 {
        self.tiles[tile].rate
    }

    /// How old samples of the tile have been, on average, when they were replaced.
    #[inline]
    pub(crate) fn mean_age_secs(&self, tile: usize) -> f32 {
        self.tiles[tile].mean_age_secs
    }

    /// Begin to fetch what is known of a tile.
    #[inline]
    pub(crate) fn prefetch(&self, tile: usize) {
        wide::prefetch(&self.tiles, tile);
    }

    /// Of the picture whose tiles these are.
    pub fn size(&self) -> Size {
        self.grid.size
    }

    /// v where a pixel is: squared error per channel and second.
    pub fn of_pixel(&self, pixel: u32) -> f32 {
        self.of_tile(self.grid.tile_of(pixel))
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
