//! The learned rate of change of every tile.

use crate::Size;
use crate::tile::{PerTile, TileGrid};

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
    /// v.
    tiles: PerTile,
}

/// What a tile's rate is learned from.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Evidence {
    /// D.
    change: f32,
    /// A.
    age_secs: f32,
}

/// ρ: a tile forgets half of what it knew after eight samples.
const MEMORY: f32 = 0.92;
/// Shorter ages count as this long: the clock's batches are about as far apart.
const SHORTEST_AGE_SECS: f32 = 1e-3;

impl Default for Evidence {
    fn default() -> Evidence {
        Evidence { change: 0.0, age_secs: SHORTEST_AGE_SECS }
    }
}

impl Evidence {
    /// Of a change, d, of what was `age_secs` old. `weight`: below 1 for samples that were not chosen evenly over the tile. Returns v.
    #[inline(always)]
    pub(crate) fn observe(&mut self, change: f32, age_secs: f32, weight: f32) -> f32 {
        self.change = MEMORY * self.change + weight * change * (1.0 / 3.0);
        self.age_secs = MEMORY * self.age_secs + weight * age_secs.max(SHORTEST_AGE_SECS);
        self.change / self.age_secs
    }
}

impl Rates {
    pub(crate) fn new(grid: TileGrid) -> Rates {
        let tiles = PerTile::new(grid.len());
        Rates { grid, tiles }
    }

    /// v of a tile is another one now. Returns what it was.
    #[inline(always)]
    pub(crate) fn set(&mut self, tile: usize, rate: f32) -> f32 {
        std::mem::replace(self.tiles.of_mut(tile), rate)
    }

    /// v of a tile: squared error per channel and second.
    #[inline(always)]
    pub(crate) fn of_tile(&self, tile: usize) -> f32 {
        self.tiles.of(tile)
    }

    /// v of all tiles; 0 behind the last.
    #[inline(always)]
    pub(crate) fn of_tiles(&self) -> &PerTile {
        &self.tiles
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

    #[test]
    fn a_steady_change_is_learned_and_forgotten() {
        let mut evidence = Evidence::default();
        let mut observe = |change: f32| evidence.observe(change, 0.1, 1.0);
        // Σ d/3 over Σ age: 0.01 per 0.1 s.
        let learned = (0..200).map(|_| observe(0.03)).last().expect("a rate");
        assert!((learned - 0.1).abs() < 1e-3, "{learned}");
        let after_eight = (0..8).map(|_| observe(0.0)).last().expect("a rate");
        assert!((after_eight / learned - 0.92f32.powi(8)).abs() < 0.01, "{after_eight}");
    }
}
