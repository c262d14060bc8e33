//! What counts how much, tile by tile: see [`Weights`].
//!
//! ```text
//! m_i = (c₀ + √s_i)^c · (1 + |u_i − û_i| / r₀)^f · a_i^g · √I_i,  over its mean      tile i gets samples ∝ m_i √v_i
//! ```
//!
//! s_i is the spatial contrast of the last picture, u_i how far the tile's surface moves from refresh to refresh, û_i how far it would
//! if it followed the picture's global pattern ([`Flow`]), a_i how sharply the eye sees there, I_i how much a squared error counts; c, f
//! and g are the strengths of contrast, flow and gaze. Where errors count I times, Σ I v / f at given Σ f is least for f ∝ √I √v, hence
//! the root (see [`credit`](super::credit)).
//!
//! Of the holes and fronts in a tile of m < 1 the part m is let through.
//!
//! The smallest angle that the eye resolves grows linearly with the distance e from where it looks (Guenter et al. 2012, "Foveated 3D
//! graphics", section 3): a = 1 / (1 + e / e₂). Of an error that is spread over all spatial frequencies evenly a² is left if only
//! those below a are seen, so that √I = a.
//!
//! Degenerate cases: a factor of which nothing is known (no reconstruction that tells it, no surface) is 1; if m is 0 everywhere all
//! tiles count alike.

use super::flow::{Flow, Moving};
use crate::tile::{TileGrid, TileRect};
use crate::weights::{Gaze, Importance};
use crate::{Canvas, Weights};

/// c₀: the difference of neighbours that counts as a contrast, a twentieth of the range, as for fronts. Keeps plain surfaces from
/// counting next to nothing.
const CONTRAST: f32 = 0.05;
/// r₀, in pixels per refresh: an edge that is off by as much is wrong by as much as it can be.
const MOTION_PX: f32 = 1.0;
/// Faster things, in pixels per refresh, count no more.
const MOST_PX: f32 = 15.0;

/// m of every tile.
#[derive(Default)]
pub(crate) struct TileWeights {
    contrast: f32,
    flow: f32,
    /// What gaze and importance make of it.
    given: Vec<f32>,
    /// m; empty: all are 1.
    tile: Vec<f32>,
    /// Parts of holes and fronts that are still to be let through.
    pass: Vec<f32>,
    moving: Vec<Moving>,
}

impl TileWeights {
    pub(crate) fn new(weights: &Weights, grid: &TileGrid) -> TileWeights {
        if weights.is_off() {
            return TileWeights::default();
        }
        let mut given = vec![1.0; grid.len()];
        for (tile, given) in given.iter_mut().enumerate() {
            let rect = grid.rect(tile);
            if let Some(gaze) = &weights.gaze {
                *given *= acuity(gaze, grid, &rect).powf(gaze.strength);
            }
            if let Some(importance) = &weights.importance {
                *given *= importance.mean(grid, &rect).sqrt() as f32;
            }
        }
        let (tile, pass) = (given.clone(), vec![0.0; given.len()]);
        let Weights { contrast, flow, .. } = *weights;
        let mut made = TileWeights { contrast, flow, given, tile, pass, moving: Vec::new() };
        made.divide_by_mean();
        made
    }

    /// Whether a hole or front is let through: all in tiles where m is at least 1, else m of them.
    #[inline]
    pub(crate) fn lets_pass(&mut self, grid: &TileGrid, pixel: u32) -> bool {
        if self.tile.is_empty() {
            return true;
        }
        let tile = grid.tile_of(pixel);
        let m = self.tile[tile];
        let pass = &mut self.pass[tile];
        *pass += m.min(1.0);
        let passes = *pass >= 1.0;
        *pass -= f32::from(u8::from(passes));
        passes
    }

    /// m of a tile.
    #[inline]
    pub(crate) fn of_tile(&self, tile: usize) -> f32 {
        self.tile.get(tile).copied().unwrap_or(1.0)
    }

    /// m of all tiles; empty: all are 1.
    #[inline]
    pub(crate) fn of_tiles(&self) -> &[f32] {
        &self.tile
    }

    /// Looks at the canvas anew, after a reconstruction has said what its tiles show. Whether any m may have changed.
    pub(crate) fn look(&mut self, canvas: &Canvas, grid: &TileGrid) -> bool {
        if self.contrast == 0.0 && self.flow == 0.0 {
            return false;
        }
        self.tile.clone_from(&self.given);
        if self.contrast != 0.0 {
            for (m, s) in self.tile.iter_mut().zip(canvas.tile_contrast()) {
                *m *= (CONTRAST + s.sqrt()).powf(self.contrast);
            }
        }
        if self.flow != 0.0 {
            self.moving.clear();
            self.moving.extend((0..).zip(canvas.tile_motion()).filter_map(|(tile, motion_px)| {
                Some(Moving { tile, at_px: middle(&grid.rect(tile)), motion_px: (*motion_px)? })
            }));
            let flow = Flow::fit(&self.moving);
            for moving in &self.moving {
                let off_px = flow.deviation_px(moving).min(MOST_PX);
                self.tile[moving.tile] *= (1.0 + off_px / MOTION_PX).powf(self.flow);
            }
        }
        self.divide_by_mean();
        true
    }

    fn divide_by_mean(&mut self) {
        let mean = self.tile.iter().map(|&m| f64::from(m)).sum::<f64>() / self.tile.len() as f64;
        match mean > 0.0 {
            true => self.tile.iter_mut().for_each(|m| *m = (f64::from(*m) / mean) as f32),
            false => self.tile.fill(1.0),
        }
    }
}

/// a = 1 / (1 + e / e₂), e from the gaze to the tile's middle; in (0, 1].
fn acuity(gaze: &Gaze, grid: &TileGrid, rect: &TileRect) -> f32 {
    let (width, height) = (grid.size.width as f32, grid.size.height as f32);
    let [x, y] = middle(rect);
    let e_px = (x - gaze.at[0] * width).hypot(y - gaze.at[1] * height);
    1.0 / (1.0 + e_px / (gaze.radius * height))
}

fn middle(rect: &TileRect) -> [f32; 2] {
    [(rect.x0 + rect.x1) as f32 * 0.5, (rect.y0 + rect.y1) as f32 * 0.5]
}

impl Importance {
    /// Mean over a tile: every cell counts with the area that it shares with the tile.
    fn mean(&self, grid: &TileGrid, rect: &TileRect) -> f64 {
        let across = |from: u32, to: u32, cells: u32, pixels: u32| {
            let per_pixel = f64::from(cells) / f64::from(pixels);
            let (from, to) = (f64::from(from) * per_pixel, f64::from(to) * per_pixel);
            (from as u32..(to.ceil() as u32).min(cells)).map(move |cell| {
                let shared = to.min(f64::from(cell + 1)) - from.max(f64::from(cell));
                (cell, shared / (to - from))
            })
        };
        let rows = across(rect.y0, rect.y1, self.height, grid.size.height);
        rows.map(|(y, height)| {
            let row = y as usize * self.width as usize;
            let columns = across(rect.x0, rect.x1, self.width, grid.size.width);
            columns
                .map(|(x, width)| width * height * f64::from(self.values[row + x as usize]))
                .sum::<f64>()
        })
        .sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Size;

    /// 8×6 tiles, the last column and row cut in half.
    fn grid() -> TileGrid {
        TileGrid::new(Size::new(60, 44), 8)
    }

    fn near(a: f64, b: f64) -> bool {
        (a - b).abs() < 1e-5
    }

    #[test]
    fn nothing_set_is_nothing_kept() {
        let gaze = Gaze { at: [0.5; 2], radius: 1.0, strength: 0.0 };
        let off = Weights::default().with_gaze(gaze).expect("valid");
        assert!(TileWeights::new(&off, &grid()).tile.is_empty());
    }

    #[test]
    fn maps_finer_and_coarser_than_the_picture_have_the_same_means() {
        let (grid, whole) = (grid(), TileRect { x0: 0, y0: 0, x1: 60, y1: 44 });
        for (width, height) in [(1, 1), (3, 2), (60, 44), (61, 43), (240, 88)] {
            // From 0 at the left border to 1 at the right.
            let cells = (0..width * height).map(|i| ((i % width) as f32 + 0.5) / width as f32);
            let map = Importance { width, height, values: cells.collect() };
            assert!(near(map.mean(&grid, &whole), 0.5), "{width}×{height}");
            for tile in (0..grid.len()).filter(|_| width >= 60) {
                let rect = grid.rect(tile);
                let middle = f64::from(rect.x0 + rect.x1) / 120.0;
                let mean = map.mean(&grid, &rect);
                assert!((mean - middle).abs() < 0.01, "{width}×{height}: {mean}, not {middle}");
            }
        }
    }

    #[test]
    fn importance_counts_by_its_root_and_only_by_ratio() {
        for scale in [1.0, 1e-30, 1e30] {
            let map = vec![scale, 9.0 * scale];
            let weights = Weights::default().with_importance(2, 1, map).expect("valid");
            let grid = TileGrid::new(Size::new(32, 8), 8);
            let m = TileWeights::new(&weights, &grid);
            assert!(
                m.tile.iter().zip([0.5, 0.5, 1.5, 1.5]).all(|(m, want)| (m - want).abs() < 1e-5)
            );
        }
        let nothing = Weights::default().with_importance(1, 1, vec![0.0]).expect("valid");
        assert!(TileWeights::new(&nothing, &grid()).tile.iter().all(|&m| m == 1.0));
    }

    #[test]
    fn the_eye_sees_half_as_sharply_one_radius_away() {
        let grid = TileGrid::new(Size::new(80, 40), 8);
        let gaze = Gaze { at: [0.05, 0.1], radius: 0.2, strength: 1.0 };
        let m = TileWeights::new(&Weights::default().with_gaze(gaze).expect("valid"), &grid);
        // From the middle of tile 0, tile 1 is 8 pixels away and tile 3 24.
        for (tile, ratio) in [(1, 0.5), (3, 0.25), (10, 0.5)] {
            assert!((m.tile[tile] / m.tile[0] - ratio).abs() < 1e-5, "{tile}");
        }
    }

    #[test]
    fn contrast_and_what_moves_by_itself_count_more_or_less_as_wanted() {
        let grid = TileGrid::new(Size::new(64, 64), 8);
        let mut canvas = Canvas::new(grid.size);
        let contrast: Vec<f32> = (0..64).map(|tile| if tile == 3 { 0.0625 } else { 0.0 }).collect();
        // All slide to the right, but one does not, and of one nothing is known.
        let motion = |tile| (tile != 7).then_some([if tile == 9 { 0.0 } else { 3.0 }, 0.0]);
        canvas.set_tiles(&contrast, (0..64).map(motion));
        let look = |weights: Result<Weights, _>| {
            let mut m = TileWeights::new(&weights.expect("valid"), &grid);
            m.look(&canvas, &grid);
            m.tile
        };
        let m = look(Weights::default().with_contrast(1.0));
        assert!((m[3] / m[4] - 6.0).abs() < 1e-4, "(0.05 + 0.25) / 0.05, not {}", m[3] / m[4]);
        let m = look(Weights::default().with_contrast(-1.0));
        assert!((m[4] / m[3] - 6.0).abs() < 1e-4);
        let m = look(Weights::default().with_flow(1.0));
        assert!((m[9] / m[4] - 4.0).abs() < 0.1, "1 + 3 px, not {}", m[9] / m[4]);
        assert!((m[7] / m[4] - 1.0).abs() < 0.1);
    }

    #[test]
    fn a_canvas_that_tells_nothing_changes_nothing() {
        let grid = grid();
        let both = Weights::default().with_contrast(1.0).and_then(|w| w.with_flow(1.0));
        let mut m = TileWeights::new(&both.expect("valid"), &grid);
        m.look(&Canvas::new(grid.size), &grid);
        assert!(m.tile.iter().all(|&m| m == 1.0));
    }
}
