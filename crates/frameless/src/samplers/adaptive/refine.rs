//! What is at rest is refined: more samples for pixels that show the mean of a few.
//!
//! ```text
//! share of tile i ∝ u_i (m_i σ_i^(1+b) + ¼ σ̄^(1+b)),   σ̄² = mean σ²
//! u_i = 1/N_i Σ_j 1/n_j^b                   over the tile's pixels j that are at rest and have not enough samples yet
//! b = 3 of a renderer with noise, else 0
//! ```
//!
//! σ²_i is the variance of a pixel's samples in the tile, by noise or because the pixel is not all one colour, N_i how many pixels it has, n_j of
//! how many samples a pixel shows the mean, m_i how much the tile counts ([`weights`](super::weights)). Samples in proportion to σ make Σ σ²/n least (Neyman 1934); some are
//! given out as if all tiles were alike, since σ itself is only an estimate.
//!
//! b: with noise pixels never have enough, and those that something has changed have begun anew among others that have hundreds of samples. Shares in proportion to
//! σ (σ/n)^b lead to n ∝ σ for any b ≥ 0, too, since dn/dt = σ (σ/n)^b has the solution n^(1+b) ∝ σ^(1+b) t; the larger b, the more of the samples go to those that are
//! behind until they are level. A pixel with a third of the others' samples counts 27 times as much. Within a tile those with the fewest come first.
//!
//! How many samples go to change and how many to refinement follows from what is to be gained, and from the control τ:
//!
//! ```text
//! E_t = mean of v_i · age_i / 2            squared error by change since the samples were taken
//! E_s = mean of σ²_i / n_j                 squared error of means of n_j samples
//! temporal part = τ √E_t / (τ √E_t + (1 − τ) √E_s), at least ε
//! ```

use super::order::Order;
use super::shares::Shares;
use super::tiles::Tiles;
use crate::rates::Rates;
use crate::tile::{LINE, PerTile, TileGrid, TileRect};
use crate::{Canvas, Refinement, Request, Rng, wide};

/// ε: the least part of the samples that look for change, however still the picture is.
const LEAST_TEMPORAL: f32 = super::LEAST_EVEN;
/// Variance of tiles of which nothing is known yet (Σ over the channels).
const FIRST_VARIANCE: f32 = 1e-3;
/// A tile's variance is the mean over its last samples: about so many.
const MEMORY: u16 = 256;
/// Samples that the first guess of a tile's variance counts for.
const FIRST_SAMPLES: u16 = 4;
/// Of what a tile of mean variance has, the part that every tile gets beside its own.
const EVENLY: f32 = 0.25;
/// b of a renderer with noise. Less: pixels that begin anew take longer to be level with the others (b = 1: seconds); more changes little, and cubes are cheap.
const BEHIND: i32 = 3;

/// Variances of all tiles, and whose turn it is.
pub(crate) struct Refine {
    tiles: Vec<TileNoise>,
    behind: Behind,
    /// Σ σ².
    variance_sum: f64,
    /// u m σ^(1+b).
    weights: PerTile,
    /// By these, with u as the even part.
    shares: Shares,
    order: Order,
    /// Whose turn it is, tile by tile.
    turns: Vec<u8>,
    /// Per pixel the number of its last sample; empty until samples are wanted.
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

/// How much more those count that have fewer samples than others.
#[derive(Clone, Copy, PartialEq)]
enum Behind {
    /// b = 0.
    Alike,
    /// b = [`BEHIND`].
    First,
}

impl Behind {
    fn of(canvas: &Canvas) -> Behind {
        if canvas.adds_without_end() { Behind::First } else { Behind::Alike }
    }

    /// x^(1+b).
    fn power(self, x: f32) -> f32 {
        match self {
            Behind::Alike => x,
            Behind::First => x.powi(1 + BEHIND),
        }
    }

    /// 1/n^b.
    fn urgency(self, n: u16) -> f32 {
        match self {
            Behind::Alike => 1.0,
            Behind::First => (1.0 / f32::from(n)).powi(BEHIND),
        }
    }
}

impl TileNoise {
    /// u m σ^(1+b).
    fn weight(&self, m: f32, behind: Behind) -> f32 {
        self.unfinished * m * behind.power(self.variance.sqrt())
    }
}

/// Pixels of a whole tile, from left to right.
const SIDE: usize = 1 << super::TILE_BITS;
/// Pixels of a whole tile.
const TILE_PIXELS: f32 = (SIDE * SIDE) as f32;

/// Pixels of a tile that want samples.
#[derive(Clone, Copy, Default)]
struct Unfinished {
    pixels: u32,
    /// That they have already.
    samples: u32,
}

/// Those of a renderer with noise, all of which want samples.
#[derive(Clone, Copy, Default)]
struct Endless {
    /// Σ 1/n.
    error: f32,
    /// Σ 1/n^b.
    urgency: f32,
}

impl Endless {
    fn of(canvas: &Canvas, rect: &TileRect) -> Endless {
        let mut sums = Endless::default();
        for y in rect.y0..rect.y1 {
            let begin = canvas.size().index(rect.x0, y) as usize;
            let row = &canvas.samples()[begin..begin + (rect.x1 - rect.x0) as usize];
            for &n in row.iter().filter(|&&n| n > 0) {
                sums.error += 1.0 / f32::from(n);
                sums.urgency += Behind::First.urgency(n);
            }
        }
        sums
    }
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
    pub(crate) fn new(grid: &TileGrid, rng: &mut Rng) -> Refine {
        let tiles = grid.len();
        let unknown =
            TileNoise { variance: FIRST_VARIANCE, samples: FIRST_SAMPLES, unfinished: 0.0 };
        Refine {
            tiles: vec![unknown; tiles],
            behind: Behind::Alike,
            variance_sum: f64::from(FIRST_VARIANCE) * tiles as f64,
            weights: PerTile::new(tiles),
            shares: Shares::new(tiles, rng),
            order: Order::new(),
            turns: (0..tiles).map(|_| Order::begin(rng)).collect(),
            index: Vec::new(),
            spatial_error: 0.0,
            temporal_error: 0.0,
            drawn: Vec::new(),
        }
    }

    /// Looks at the canvas anew, after a reconstruction has said what its pixels show.
    pub(crate) fn look(
        &mut self,
        canvas: &Canvas,
        rates: &Rates,
        tiles: &Tiles,
        m: impl Fn(usize) -> f32,
    ) {
        (self.spatial_error, self.temporal_error) = (0.0, 0.0);
        // Nothing is drawn then.
        if canvas.samples_wanted() == 0 {
            return;
        }
        self.index.resize(canvas.size().pixels(), 0);
        // Who has begun anew begins the sequence anew.
        for (index, n) in self.index.iter_mut().zip(canvas.samples()) {
            *index = if *n > 1 { *index } else { 0 };
        }
        self.behind = Behind::of(canvas);
        let (mut spatial, mut temporal) = (0.0, 0.0);
        for tile in 0..self.tiles.len() {
            spatial += match self.behind {
                Behind::Alike => self.look_at_tile(canvas, rates, tile),
                Behind::First => self.look_at_endless_tile(canvas, rates, tile),
            };
            temporal += rates.of_tile(tile) * tiles.of(tile).mean_age_secs * 0.5;
        }
        let per_tile = 1.0 / self.tiles.len() as f32;
        self.spatial_error = (spatial * per_tile * (1.0 / 3.0)).sqrt();
        self.temporal_error = (temporal * per_tile).sqrt();
        self.variance_sum = self.tiles.iter().map(|noise| f64::from(noise.variance)).sum();
        self.weigh_all(m);
    }

    /// Returns the mean of σ²/n over the tile, n being the mean of its pixels.
    fn look_at_tile(&mut self, canvas: &Canvas, rates: &Rates, tile: usize) -> f32 {
        let rect = rates.grid.rect(tile);
        let unfinished = Unfinished::of(canvas, &rect);
        let noise = &mut self.tiles[tile];
        noise.unfinished = unfinished.pixels as f32 / rect.pixels() as f32;
        if unfinished.pixels == 0 {
            return 0.0;
        }
        let per_pixel = unfinished.samples as f32 / unfinished.pixels as f32;
        noise.unfinished * noise.variance / per_pixel
    }

    /// The same of a renderer with noise, with each pixel's own n.
    fn look_at_endless_tile(&mut self, canvas: &Canvas, rates: &Rates, tile: usize) -> f32 {
        let rect = rates.grid.rect(tile);
        let Endless { error, urgency } = Endless::of(canvas, &rect);
        let noise = &mut self.tiles[tile];
        noise.unfinished = urgency / TILE_PIXELS;
        noise.variance * error / TILE_PIXELS
    }

    /// What tiles count has changed.
    pub(crate) fn weigh_all(&mut self, m: impl Fn(usize) -> f32) {
        for (tile, noise) in self.tiles.iter().enumerate() {
            *self.weights.of_mut(tile) = noise.weight(m(tile), self.behind);
        }
        self.shares.set_evens(|tile| self.tiles[tile].unfinished);
        self.shares.weigh_all(&self.weights);
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

    /// Of a sample that was the `n`th of its pixel. `m`: how much the tile counts.
    pub(crate) fn observe(&mut self, tile: usize, n: u16, refinement: &Refinement, m: f32) {
        let noise = &mut self.tiles[tile];
        if self.behind == Behind::First && n > 1 {
            let less = Behind::First.urgency(n - 1) - Behind::First.urgency(n);
            noise.unfinished = (noise.unfinished - less / TILE_PIXELS).max(0.0);
        }
        noise.samples = (noise.samples + 1).min(MEMORY);
        let part = 1.0 / f32::from(noise.samples);
        let change = part * (refinement.deviation - noise.variance);
        noise.variance += change;
        self.variance_sum += f64::from(change);
        *self.weights.of_mut(tile) = noise.weight(m, self.behind);
        self.shares.touch(tile);
    }

    /// Begin to fetch what [`Refine::observe`] changes.
    #[inline]
    pub(crate) fn prefetch(&self, tile: usize) {
        wide::prefetch(&self.tiles, tile);
        self.weights.prefetch(tile / LINE);
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
        let evenly = EVENLY * self.behind.power(mean.sqrt()) + 1e-6;
        self.shares.renew(&self.weights);
        let sums = self.shares.sums();
        let sum = sums.weight as f32 + evenly * sums.even as f32;
        if sum <= 0.0 {
            return;
        }
        let mut drawn = std::mem::take(&mut self.drawn);
        drawn.clear();
        self.shares.draw(count / sum, evenly * count / sum, &self.weights, &mut drawn);
        for &tile in &drawn {
            let within = self.order.peek(self.turns[tile as usize]);
            let pixel = (grid.corner(tile as usize) + grid.step(within)) as usize;
            wide::prefetch(canvas.samples(), pixel);
            wide::prefetch(&self.index, pixel);
        }
        drawn.iter().filter_map(|&tile| self.next(canvas, grid, tile as usize)).for_each(&mut take);
        self.drawn = drawn;
    }

    /// The next pixel of a tile that wants a sample; with noise one of those with the fewest.
    fn next(&mut self, canvas: &Canvas, grid: &TileGrid, tile: usize) -> Option<Request> {
        let rect = grid.rect(tile);
        let most = match self.behind {
            Behind::Alike => canvas.samples_wanted() - 1,
            Behind::First => fewest(canvas, &rect)?,
        };
        let (corner, pixels) = (grid.corner(tile), grid.pixels_of(tile));
        for _ in 0..rect.pixels() {
            let within = self.order.next(pixels, &mut self.turns[tile]);
            let pixel = corner + grid.step(within);
            let n = canvas.samples()[pixel as usize];
            if n > 0 && n <= most {
                let index = &mut self.index[pixel as usize];
                *index += 1;
                return Some(Request::in_sequence(pixel, *index));
            }
        }
        None
    }
}

/// The least number of samples of a tile's pixels at rest.
fn fewest(canvas: &Canvas, rect: &TileRect) -> Option<u16> {
    let rows = (rect.y0..rect.y1).map(|y| {
        let begin = canvas.size().index(rect.x0, y) as usize;
        &canvas.samples()[begin..begin + (rect.x1 - rect.x0) as usize]
    });
    // Those that do not rest have 0, which wraps to more than any other has.
    let least = rows.flatten().map(|n| n.wrapping_sub(1)).min()?;
    (least < u16::MAX).then_some(least + 1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Size;

    #[test]
    fn a_part_of_the_samples_always_looks_for_change() {
        let grid = TileGrid::new(Size::new(16, 16), 8);
        let mut refine = Refine::new(&grid, &mut Rng::new(1));
        assert_eq!(refine.temporal_part(0.0), 1.0, "nothing to refine");
        (refine.spatial_error, refine.temporal_error) = (1.0, 1e-9);
        assert_eq!(refine.temporal_part(0.5), LEAST_TEMPORAL);
        assert_eq!(refine.temporal_part(0.0), LEAST_TEMPORAL);
        refine.temporal_error = 1.0;
        assert_eq!(refine.temporal_part(0.5), 0.5);
    }
}
