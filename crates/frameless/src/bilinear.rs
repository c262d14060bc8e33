//! Pixels inside a tile, with density ∝ the bilinear interpolation of the tiles' values.
//!
//! Along one axis let u ∈ (−1/2, 1/2) be a pixel centre's distance from its own tile's centre, in tiles. The interpolation
//! between the tile before (i = 0), the tile itself (1) and the tile after (2) has the weights
//!
//! ```text
//! H₀(u) = max(0, −u),   H₁(u) = 1 − |u|,   H₂(u) = max(0, u),   H₀ + H₁ + H₂ = 1
//! ```
//!
//! and with v_ij the values of the 3×3 tiles around
//!
//! ```text
//! b(x, y) = Σ_ij v_ij · H_i(x) · H_j(y)
//! ```
//!
//! That is a mixture of nine products, so a pixel is drawn without rejection: first (i, j) with probability
//! ∝ v_ij · W_i · W_j, W_i = Σ_x H_i(x), then x by H_i / W_i and y by H_j / W_j. The H depend on the tile's extent only, so
//! their tables are made once.

use crate::Rng;
use crate::alias::Alias;
use crate::tile::TileGrid;

/// H along one axis of a tile.
#[derive(Clone, Debug)]
struct Hats {
    /// H_i of every pixel.
    values: [Vec<f32>; 3],
    /// W_i.
    sums: [f32; 3],
    /// Draws a pixel by H_i / W_i.
    alias: [Alias; 3],
}

impl Hats {
    /// For a tile of `pixels` pixels in a grid of tiles of `side` pixels; fewer than `side` where the tile is cut.
    fn new(pixels: u32, side: u32) -> Hats {
        let hat = |i: usize, x: u32| {
            let u = (f64::from(x) + 0.5) / f64::from(side) - 0.5;
            [(-u).max(0.0), 1.0 - u.abs(), u.max(0.0)][i]
        };
        let values: [Vec<f64>; 3] =
            std::array::from_fn(|i| (0..pixels).map(|x| hat(i, x)).collect());
        Hats {
            sums: std::array::from_fn(|i| values[i].iter().sum::<f64>() as f32),
            alias: std::array::from_fn(|i| Alias::new(&values[i])),
            values: values.map(|of_pixels| of_pixels.iter().map(|&h| h as f32).collect()),
        }
    }
}

/// H for every tile of a grid: whole tiles, and those cut by the right and bottom border.
#[derive(Clone, Debug)]
pub(crate) struct Bilinear {
    grid: TileGrid,
    whole: [Hats; 2],
    last: [Hats; 2],
}

impl Bilinear {
    pub(crate) fn new(grid: &TileGrid) -> Bilinear {
        let corner = grid.rect(grid.len() - 1);
        let first = grid.rect(0);
        let hats = |pixels: u32| Hats::new(pixels, grid.side);
        Bilinear {
            grid: grid.clone(),
            whole: [hats(first.x1 - first.x0), hats(first.y1 - first.y0)],
            last: [hats(corner.x1 - corner.x0), hats(corner.y1 - corner.y0)],
        }
    }

    pub(crate) fn grid(&self) -> &TileGrid {
        &self.grid
    }

    /// The interpolation inside `tile` of one value per tile; beyond the border the outermost values go on.
    pub(crate) fn inside(&self, tile: usize, value_of_tile: &[f32]) -> Inside<'_> {
        let TileGrid { columns, rows, .. } = self.grid;
        let (column, row) = (tile as u32 % columns, tile as u32 / columns);
        let [across, _] = if column + 1 == columns { &self.last } else { &self.whole };
        let [_, down] = if row + 1 == rows { &self.last } else { &self.whole };
        let columns_around = [column.saturating_sub(1), column, (column + 1).min(columns - 1)];
        let rows_around = [row.saturating_sub(1), row, (row + 1).min(rows - 1)];
        let value = |i: usize, j: usize| {
            value_of_tile[(rows_around[j] * columns + columns_around[i]) as usize]
        };
        let rect = self.grid.rect(tile);
        Inside {
            origin: self.grid.size.index(rect.x0, rect.y0),
            stride: self.grid.size.width,
            values: std::array::from_fn(|k| value(k % 3, k / 3)),
            across,
            down,
        }
    }
}

/// b inside one tile.
pub(crate) struct Inside<'a> {
    /// The tile's first pixel.
    origin: u32,
    stride: u32,
    /// v_ij at index 3 j + i.
    values: [f32; 9],
    across: &'a Hats,
    down: &'a Hats,
}

impl Inside<'_> {
    /// b at the pixel in column `x` and row `y` of the tile.
    pub(crate) fn value(&self, x: u32, y: u32) -> f64 {
        let term = |k: usize| {
            let (i, j) = (k % 3, k / 3);
            let hats = self.across.values[i][x as usize] * self.down.values[j][y as usize];
            f64::from(self.values[k]) * f64::from(hats)
        };
        (0..9).map(term).sum()
    }

    /// Probabilities of the nine products, added up; the last is their sum.
    pub(crate) fn mixture(&self) -> [f32; 9] {
        let mut sum = 0.0;
        std::array::from_fn(|k| {
            sum += self.values[k] * self.across.sums[k % 3] * self.down.sums[k / 3];
            sum
        })
    }

    /// The index of a pixel drawn with density ∝ b; `mixture` is [`Inside::mixture`], whose last entry must be positive.
    #[inline]
    pub(crate) fn draw(&self, mixture: &[f32; 9], rng: &mut Rng) -> u32 {
        let target = rng.unit_f32() * mixture[8];
        // Without a branch per product: how many of the partial sums are not above the target.
        let k = mixture[..8].iter().map(|&sum| usize::from(sum <= target)).sum::<usize>();
        let x = self.across.alias[k % 3].draw(rng);
        let y = self.down.alias[k / 3].draw(rng);
        self.origin + y * self.stride + x
    }
}
