//! The picture cut into square tiles; those at the right and bottom border may be smaller.

use crate::Size;

/// Which pixel lies in which tile. Tiles are numbered row by row.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct TileGrid {
    pub(crate) size: Size,
    /// Side of a whole tile, in pixels.
    pub(crate) side: u32,
    pub(crate) columns: u32,
    pub(crate) rows: u32,
}

/// A tile's pixels: columns `x0..x1`, rows `y0..y1`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct TileRect {
    pub(crate) x0: u32,
    pub(crate) y0: u32,
    pub(crate) x1: u32,
    pub(crate) y1: u32,
}

impl TileRect {
    pub(crate) fn pixels(&self) -> u32 {
        (self.x1 - self.x0) * (self.y1 - self.y0)
    }
}

impl TileGrid {
    /// `side` is at least 1; a side larger than the picture gives one tile.
    pub(crate) fn new(size: Size, side: u32) -> TileGrid {
        let side = side.max(1);
        let (columns, rows) = (size.width.div_ceil(side), size.height.div_ceil(side));
        TileGrid { size, side, columns, rows }
    }

    pub(crate) fn len(&self) -> usize {
        self.columns as usize * self.rows as usize
    }

    #[inline]
    pub(crate) fn tile_of(&self, pixel: u32) -> usize {
        let (x, y) = self.size.xy(pixel);
        (y / self.side * self.columns + x / self.side) as usize
    }

    pub(crate) fn rect(&self, tile: usize) -> TileRect {
        let (column, row) = (tile as u32 % self.columns, tile as u32 / self.columns);
        let (x0, y0) = (column * self.side, row * self.side);
        TileRect {
            x0,
            y0,
            x1: x0.saturating_add(self.side).min(self.size.width),
            y1: y0.saturating_add(self.side).min(self.size.height),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tiles_cover_every_pixel_once() {
        for (width, height, side) in
            [(512, 384, 16), (13, 7, 4), (1, 1, 16), (5, 5, 1), (3, 9, u32::MAX)]
        {
            let grid = TileGrid::new(Size::new(width, height), side);
            let mut seen = vec![0; grid.size.pixels()];
            for tile in 0..grid.len() {
                let rect = grid.rect(tile);
                for y in rect.y0..rect.y1 {
                    for x in rect.x0..rect.x1 {
                        let pixel = grid.size.index(x, y);
                        assert_eq!(grid.tile_of(pixel), tile);
                        seen[pixel as usize] += 1;
                    }
                }
            }
            assert!(seen.iter().all(|&n| n == 1), "{width}×{height}, tiles of {side}");
        }
    }
}
