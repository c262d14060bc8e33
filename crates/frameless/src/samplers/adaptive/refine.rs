//! What is at rest is refined: more samples for pixels that show the mean of a few.
//!
//! ```text
//! share of tile i = u_i m_i σ_i / Σ u m σ
//! ```
//!
//! σ²_i is the variance of a pixel's samples in the tile, by noise or because the pixel is not all one colour, and u_i the part of its
//! pixels that are at rest and have not enough samples yet, m_i how much the tile counts ([`weights`](super::weights)). Samples in proportion to σ make Σ σ²/n least (Neyman 1934); some are
//! given out as if all tiles were alike, since σ itself is only an estimate.
//!
//! How many samples go to change and how many to refinement follows from what is to be gained, and from the control τ:
//!
//! ```text
//! E_t = mean of v_i · age_i / 2            squared error by change since the samples were taken
//! E_s = mean of u_i · σ²_i / n_i           squared error of means of n_i samples
//! temporal part = τ √E_t / (τ √E_t + (1 − τ) √E_s), at least ε
//! ```

use super::order::Order;
use super::shares::Shares;
use crate::rates::Rates;
use crate::tile::{TileGrid, TileRect};
use crate::{Canvas, Refinement, Request, Rng, wide};

/// ε: the least part of the samples that look for change, however still the picture is.
const LEAST_TEMPORAL: f32 = super::LEAST_EVEN;
/// Variance of tiles of which nothing is known yet (Σ over the channels).
const FIRST_VARIANCE: f32 = 1e-3;
/// A tile's variance is the mean over its last samples: about so many.
const MEMORY: u16 = 256;
/// Samples that the first guess of a tile's variance counts for.
const FIRST_SAMPLES: u16 = 4;
/// The part of √(mean σ²) that is added to every tile's σ.
const EVENLY: f32 = 0.25;

/// Variances of all tiles, and whose turn it is.
pub(crate) struct Refine {
    tiles: Vec<TileNoise>,
    /// Σ σ².
    variance_sum: f64,
    /// By u m σ, with u as the even part.
    shares: Shares,
    order: Order,
    /// Per pixel the number of its last sample.
    index: Vec<u32>,
    /// √E_s.
    spatial_error: f32,
    /// √E_t.
    temporal_error: f32,
    drawn: Vec<u32>,
}

/// What is known of a tile.
#[derive(Clone, Copy)]
struct TileNoise {
    /// σ².
    variance: f32,
    /// How many samples the variance is the mean of.
    samples: u16,
    /// u.
    unfinished: f32,
}

impl TileNoise {
    /// u m σ.
    fn weight(&self, m: f32) -> f32 {
        self.unfinished * m * self.variance.sqrt()
    }
}

/// Pixels of a whole tile, from left to right.
const SIDE: usize = 1 << super::TILE_BITS;

/// Pixels of a tile that want samples.
#[derive(Clone, Copy, Default)]
struct Unfinished {
    pixels: u32,
    /// That they have already.
    samples: u32,
}

impl Unfinished {
    fn of(canvas: &Canvas, rect: &TileRect) -> Unfinished {
        // Column by column, so that eight are added side by side.
        let (mut pixels, mut samples) = ([0; SIDE], [0; SIDE]);
        let wanted = canvas.samples_wanted();
        let mut add = |row: &[u16]| {
            for ((pixels, samples), &n) in pixels.iter_mut().zip(&mut samples).zip(row) {
                let counts = u32::from(n.wrapping_sub(1) < wanted - 1);
                *pixels += counts;
                *samples += counts * u32::from(n);
            }
        };
        for y in rect.y0..rect.y1 {
            let begin = canvas.size().index(rect.x0, y) as usize;
            let row = &canvas.samples()[begin..begin + (rect.x1 - rect.x0) as usize];
            match row.first_chunk::<SIDE>() {
                Some(row) => add(row),
                None => add(row),
            }
        }
        Unfinished { pixels: pixels.iter().sum(), samples: samples.iter().sum() }
    }
}

impl Refine {
    pub(crate) fn new(grid: &TileGrid, side_bits: u32, rng: &mut Rng) -> Refine {
        let tiles = grid.len();
        let unknown =
            TileNoise { variance: FIRST_VARIANCE, samples: FIRST_SAMPLES, unfinished: 0.0 };
        Refine {
            tiles: vec![unknown; tiles],
            variance_sum: f64::from(FIRST_VARIANCE) * tiles as f64,
            shares: Shares::new(tiles, rng),
            order: Order::new(tiles, side_bits, rng),
            index: vec![0; grid.size.pixels()],
            spatial_error: 0.0,
            temporal_error: 0.0,
            drawn: Vec::new(),
        }
    }

    /// Looks at the canvas anew, after a reconstruction has said what its pixels show.
    pub(crate) fn look(&mut self, canvas: &Canvas, rates: &Rates, m: impl Fn(usize) -> f32) {
        (self.spatial_error, self.temporal_error) = (0.0, 0.0);
        // Nothing is drawn then.
        if canvas.samples_wanted() == 0 {
            return;
        }
        // Who has begun anew begins the sequence anew.
        for (index, n) in self.index.iter_mut().zip(canvas.samples()) {
            *index = if *n > 1 { *index } else { 0 };
        }
        let (mut spatial, mut temporal) = (0.0, 0.0);
        for tile in 0..self.tiles.len() {
            let rect = rates.grid.rect(tile);
            let unfinished = Unfinished::of(canvas, &rect);
            let noise = &mut self.tiles[tile];
            noise.unfinished = unfinished.pixels as f32 / rect.pixels() as f32;
            if unfinished.pixels > 0 {
                let per_pixel = unfinished.samples as f32 / unfinished.pixels as f32;
                spatial += noise.unfinished * noise.variance / per_pixel;
            }
            temporal += rates.of_tile(tile) * rates.mean_age_secs(tile) * 0.5;
        }
        let per_tile = 1.0 / self.tiles.len() as f32;
        self.spatial_error = (spatial * per_tile * (1.0 / 3.0)).sqrt();
        self.temporal_error = (temporal * per_tile).sqrt();
        self.variance_sum = self.tiles.iter().map(|noise| f64::from(noise.variance)).sum();
        self.weigh_all(m);
    }

    /// What tiles count has changed.
    pub(crate) fn weigh_all(&mut self, m: impl Fn(usize) -> f32) {
        let share = |tile: usize| (self.tiles[tile].weight(m(tile)), self.tiles[tile].unfinished);
        self.shares.set_all(share);
    }

    /// The part of the samples that look for change.
    pub(crate) fn temporal_part(&self, temporal: f32) -> f32 {
        if self.spatial_error == 0.0 {
            return 1.0;
        }
        let (change, rest) =
            (temporal * self.temporal_error, (1.0 - temporal) * self.spatial_error);
        (change / (change + rest).max(f32::MIN_POSITIVE)).max(LEAST_TEMPORAL)
    }

    /// `m`: how much the tile counts.
    pub(crate) fn observe(&mut self, tile: usize, refinement: &Refinement, m: f32) {
        let noise = &mut self.tiles[tile];
        noise.samples = (noise.samples + 1).min(MEMORY);
        let part = 1.0 / f32::from(noise.samples);
        let change = part * (refinement.deviation - noise.variance);
        noise.variance += change;
        self.variance_sum += f64::from(change);
        let weight = noise.weight(m);
        self.shares.set(tile, weight);
    }

    /// Begin to fetch what [`Refine::observe`] changes.
    #[inline]
    pub(crate) fn prefetch(&self, tile: usize) {
        wide::prefetch(&self.tiles, tile);
        self.shares.prefetch(tile);
    }

    /// Gives out about `count` samples; exactly on average.
    pub(crate) fn draw(
        &mut self,
        canvas: &Canvas,
        grid: &TileGrid,
        count: f32,
        mut take: impl FnMut(Request),
    ) {
        let mean = (self.variance_sum / self.tiles.len() as f64).max(0.0) as f32;
        let evenly = EVENLY * mean.sqrt() + 1e-6;
        let sums = self.shares.sums();
        let sum = sums.weight as f32 + evenly * sums.even as f32;
        if sum <= 0.0 {
            return;
        }
        let mut drawn = std::mem::take(&mut self.drawn);
        drawn.clear();
        self.shares.draw(count / sum, evenly * count / sum, &mut drawn);
        for &tile in &drawn {
            let pixel = self.order.peek(grid, tile as usize) as usize;
            wide::prefetch(canvas.samples(), pixel);
            wide::prefetch(&self.index, pixel);
        }
        drawn.iter().filter_map(|&tile| self.next(canvas, grid, tile as usize)).for_each(&mut take);
        self.drawn = drawn;
    }

    /// The next pixel of a tile that wants a sample.
    fn next(&mut self, canvas: &Canvas, grid: &TileGrid, tile: usize) -> Option<Request> {
        for _ in 0..grid.rect(tile).pixels() {
            let pixel = self.order.next(grid, tile);
            let n = canvas.samples()[pixel as usize];
            if n > 0 && n < canvas.samples_wanted() {
                let index = &mut self.index[pixel as usize];
                *index += 1;
                return Some(Request::in_sequence(pixel, *index));
            }
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Size;

    #[test]
    fn a_part_of_the_samples_always_looks_for_change() {
        let grid = TileGrid::new(Size::new(16, 16), 8);
        let mut refine = Refine::new(&grid, 3, &mut Rng::new(1));
        assert_eq!(refine.temporal_part(0.0), 1.0, "nothing to refine");
        (refine.spatial_error, refine.temporal_error) = (1.0, 1e-9);
        assert_eq!(refine.temporal_part(0.5), LEAST_TEMPORAL);
        assert_eq!(refine.temporal_part(0.0), LEAST_TEMPORAL);
        refine.temporal_error = 1.0;
        assert_eq!(refine.temporal_part(0.5), 0.5);
    }
}
