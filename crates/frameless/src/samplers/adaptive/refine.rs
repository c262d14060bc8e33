//! What is at rest is refined: more samples for pixels that show the mean of a few.
//!
//! ```text
//! c_i ← c_i + n · u_i m_i σ_i / Σ u m σ   for every tile i; while c_i ≥ 1: c_i ← c_i − 1, refine a pixel of tile i
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

use crate::bayer;
use crate::rates::Rates;
use crate::tile::TileGrid;
use crate::{Canvas, Refinement, Request, Rng};

/// ε: the least part of the samples that look for change, however still the picture is.
const LEAST_TEMPORAL: f32 = 0.03;
/// Variance of tiles of which nothing is known yet (Σ over the channels).
const FIRST_VARIANCE: f32 = 1e-3;
/// A tile's variance is the mean over its last samples: about so many.
const MEMORY: u16 = 256;
/// Samples that the first guess of a tile's variance counts for.
const FIRST_SAMPLES: u16 = 4;
/// The part of √(mean σ²) that is added to every tile's σ.
const EVENLY: f32 = 0.25;

/// Variances, credits and places in the order, per tile.
pub(crate) struct Refine {
    variance: Vec<f32>,
    /// How many samples the variance is the mean of.
    samples: Vec<u16>,
    /// u.
    unfinished: Vec<f32>,
    credit: Vec<f32>,
    place: Vec<u32>,
    /// Pixels of a tile in their order, relative to its corner.
    order: Vec<(u32, u32)>,
    /// Per pixel the number of its last sample.
    index: Vec<u32>,
    /// √E_s.
    spatial_error: f32,
    /// √E_t.
    temporal_error: f32,
}

impl Refine {
    pub(crate) fn new(grid: &TileGrid, side_bits: u32, rng: &mut Rng) -> Refine {
        let tiles = grid.len();
        Refine {
            variance: vec![FIRST_VARIANCE; tiles],
            samples: vec![FIRST_SAMPLES; tiles],
            unfinished: vec![0.0; tiles],
            credit: (0..tiles).map(|_| rng.unit_f32()).collect(),
            place: (0..tiles).map(|_| rng.next_u32()).collect(),
            order: bayer::order(side_bits),
            index: vec![0; grid.size.pixels()],
            spatial_error: 0.0,
            temporal_error: 0.0,
        }
    }

    /// Looks at the canvas anew, after a reconstruction has said what its pixels show.
    pub(crate) fn look(&mut self, canvas: &Canvas, rates: &Rates) {
        let wanted = canvas.samples_wanted();
        (self.spatial_error, self.temporal_error) = (0.0, 0.0);
        if wanted == 0 {
            self.unfinished.fill(0.0);
            return;
        }
        let (mut spatial, mut temporal) = (0.0, 0.0);
        for tile in 0..self.variance.len() {
            let rect = rates.grid.rect(tile);
            let (mut unfinished, mut samples) = (0u32, 0u32);
            for y in rect.y0..rect.y1 {
                let row = canvas.size().index(rect.x0, y) as usize;
                for pixel in row..row + (rect.x1 - rect.x0) as usize {
                    let n = canvas.samples()[pixel];
                    let counts = u32::from(n > 0 && n < wanted);
                    unfinished += counts;
                    samples += counts * u32::from(n);
                    // Who has begun anew begins the sequence anew.
                    self.index[pixel] *= u32::from(n > 1);
                }
            }
            self.unfinished[tile] = unfinished as f32 / rect.pixels() as f32;
            if unfinished > 0 {
                let per_pixel = samples as f32 / unfinished as f32;
                spatial += self.unfinished[tile] * self.variance[tile] / per_pixel;
            }
            temporal += rates.of_tile(tile) * rates.mean_age_secs(tile) * 0.5;
        }
        let per_tile = 1.0 / self.variance.len() as f32;
        self.spatial_error = (spatial * per_tile * (1.0 / 3.0)).sqrt();
        self.temporal_error = (temporal * per_tile).sqrt();
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

    pub(crate) fn observe(&mut self, tile: usize, refinement: &Refinement) {
        let samples = &mut self.samples[tile];
        *samples = (*samples + 1).min(MEMORY);
        let part = 1.0 / f32::from(*samples);
        self.variance[tile] += part * (refinement.deviation - self.variance[tile]);
    }

    /// Gives out about `count` samples; exactly on average.
    pub(crate) fn draw(
        &mut self,
        canvas: &Canvas,
        (grid, weights): (&TileGrid, &[f32]),
        count: f32,
        mut take: impl FnMut(Request),
    ) {
        let tiles = self.variance.len();
        let mean = self.variance.iter().sum::<f32>() / tiles as f32;
        let evenly = EVENLY * mean.sqrt() + 1e-6;
        let m = |tile: usize| weights.get(tile).copied().unwrap_or(1.0);
        let weight =
            |tile: usize| self.unfinished[tile] * (m(tile) * self.variance[tile].sqrt() + evenly);
        let sum: f32 = (0..tiles).map(weight).sum();
        if sum <= 0.0 {
            return;
        }
        for tile in 0..tiles {
            let weight = self.unfinished[tile] * (m(tile) * self.variance[tile].sqrt() + evenly);
            self.credit[tile] += count * weight / sum;
            while self.credit[tile] >= 1.0 {
                self.credit[tile] -= 1.0;
                if let Some(request) = self.next(canvas, grid, tile) {
                    take(request);
                }
            }
        }
    }

    /// The next pixel of a tile that wants a sample.
    fn next(&mut self, canvas: &Canvas, grid: &TileGrid, tile: usize) -> Option<Request> {
        let rect = grid.rect(tile);
        for _ in 0..self.order.len() {
            let (dx, dy) = self.order[self.place[tile] as usize % self.order.len()];
            self.place[tile] = self.place[tile].wrapping_add(1);
            let (x, y) = (rect.x0 + dx, rect.y0 + dy);
            if x >= rect.x1 || y >= rect.y1 {
                continue;
            }
            let pixel = canvas.size().index(x, y);
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
