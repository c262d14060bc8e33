//! Spatial contrast: how much neighbouring pixels differ, tile by tile.

use crate::tile::TileGrid;
use crate::{Size, wide};

/// s = mean squared difference between horizontal and vertical neighbours, per channel, of every tile of `grid`.
pub(crate) fn tile_contrast(picture: &[[f32; 3]], grid: &TileGrid, contrast: &mut Vec<f32>) {
    contrast.clear();
    while contrast.len() < grid.len() {
        let tile = contrast.len();
        if grid.side == SIDE as u32 && some_inside(grid, tile) {
            wide::run(Row { picture, grid, tile, contrast });
        } else {
            contrast.push(of_tile(picture, grid, tile));
        }
    }
}

/// Added, so that s is never zero: a tenth of an 8-bit step, squared.
const LEAST: f32 = 1e-5;
/// So many tiles are summed up side by side: each number of a sum waits for the one before.
const SOME: usize = 8;
/// Side of such tiles.
const SIDE: usize = 8;

fn of_tile(picture: &[[f32; 3]], grid: &TileGrid, tile: usize) -> f32 {
    let (rect, Size { width, height }) = (grid.rect(tile), grid.size);
    let (mut sum, mut pairs) = (0.0, 0u32);
    for y in rect.y0..rect.y1 {
        for x in (rect.x0..rect.x1).step_by(2) {
            let here = picture[(y * width + x) as usize];
            let beside = picture
                [(y * width + if x + 1 < width { x + 1 } else { x.saturating_sub(1) }) as usize];
            let below = picture
                [(if y + 1 < height { y + 1 } else { y.saturating_sub(1) } * width + x) as usize];
            for k in 0..3 {
                sum += (here[k] - beside[k]).powi(2) + (here[k] - below[k]).powi(2);
            }
            pairs += 6;
        }
    }
    sum / pairs as f32 + LEAST
}

/// Whether [`SOME`] tiles from `tile` on lie in a row, and none at the right border.
fn some_inside(grid: &TileGrid, tile: usize) -> bool {
    tile % grid.columns as usize + SOME < grid.columns as usize
}

/// [`of_tile`] of those that are [`some_inside`], with a side of [`SIDE`].
struct Row<'a> {
    picture: &'a [[f32; 3]],
    grid: &'a TileGrid,
    /// The first of them.
    tile: usize,
    contrast: &'a mut Vec<f32>,
}

impl wide::Task for Row<'_> {
    #[inline(always)]
    fn run<U: wide::Unit>(self) {
        let Row { picture, grid, tile, contrast } = self;
        let (rect, Size { width, height }) = (grid.rect(tile), grid.size);
        let row = |y: u32| &picture[(y * width + rect.x0) as usize..][..SOME * SIDE + 1];
        let mut sums = [0.0f32; SOME];
        for y in rect.y0..rect.y1 {
            let below = row(if y + 1 < height { y + 1 } else { y.saturating_sub(1) });
            let (here, below) = (row(y).as_flattened(), below.as_flattened());
            let mut squares = [0.0f32; 3 * SOME * SIDE];
            let pairs = here.iter().zip(&here[3..]).zip(below);
            for (square, ((here, beside), below)) in squares.iter_mut().zip(pairs) {
                let (to_beside, to_below) = (here - beside, here - below);
                *square = to_beside * to_beside + to_below * to_below;
            }
            for channel in (0..3 * SIDE).filter(|channel| channel / 3 % 2 == 0) {
                for (nth, sum) in sums.iter_mut().enumerate() {
                    *sum += squares[3 * SIDE * nth + channel];
                }
            }
        }
        let pairs = (3 * SIDE as u32 * (rect.y1 - rect.y0)) as f32;
        contrast.extend(sums.iter().map(|sum| sum / pairs + LEAST));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn several_tiles_at_once_are_what_they_are_one_by_one() {
        let mut rng = crate::Rng::new(1);
        for size in [Size::new(83, 21), Size::new(160, 8), Size::new(7, 5)] {
            let picture: Vec<[f32; 3]> =
                (0..size.pixels()).map(|_| std::array::from_fn(|_| rng.unit_f32())).collect();
            let (grid, mut contrast) = (TileGrid::new(size, 8), vec![9.0]);
            tile_contrast(&picture, &grid, &mut contrast);
            let one_by_one = (0..grid.len()).map(|tile| of_tile(&picture, &grid, tile));
            assert_eq!(contrast, one_by_one.collect::<Vec<_>>());
        }
    }

    #[test]
    fn stripes_by_hand() {
        // Every other column is brighter by a half: all pairs beside each other differ by that, none above each other.
        let size = Size::new(80, 8);
        let picture: Vec<[f32; 3]> =
            (0..size.pixels()).map(|i| [0.5 * (i % 2) as f32; 3]).collect();
        let mut contrast = Vec::new();
        tile_contrast(&picture, &TileGrid::new(size, 8), &mut contrast);
        assert_eq!(contrast, [0.125 + LEAST; 10]);
    }
}
