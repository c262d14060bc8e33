//! Spatial contrast: how much neighbouring pixels differ, tile by tile.

use crate::Size;
use crate::tile::TileGrid;

/// s = mean squared difference between horizontal and vertical neighbours, per channel, of every tile of `grid`.
pub(crate) fn tile_contrast(picture: &[[f32; 3]], grid: &TileGrid, contrast: &mut Vec<f32>) {
    contrast.clear();
    contrast.extend((0..grid.len()).map(|tile| of_tile(picture, grid, tile)));
}

/// Added, so that s is never zero: a tenth of an 8-bit step, squared.
const LEAST: f32 = 1e-5;

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
