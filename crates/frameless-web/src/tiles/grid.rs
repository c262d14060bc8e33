//! The picture in squares.

use frameless::Size;

/// Side of a tile in pixels. A multiple of 16, so that no block of JPEG's lies in two tiles: with 32 a
/// moving ball costs a fifth more bytes, since more of what rests is sent along.
pub(crate) const SIDE: u32 = 16;

/// The tiles of a picture, row-major; those at the right and bottom border may be cut.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Grid {
    /// Of the picture, in pixels.
    pub(crate) size: Size,
    columns: u32,
}

impl Grid {
    pub(crate) fn new(size: Size) -> Grid {
        Grid { size, columns: size.width.div_ceil(SIDE) }
    }

    /// How many there are.
    pub(crate) fn len(&self) -> usize {
        (self.columns * self.size.height.div_ceil(SIDE)) as usize
    }

    /// Pixels in the tile, cut where the picture ends.
    pub(crate) fn pixels(&self, tile: usize) -> u32 {
        let (x, y) = self.corner(tile);
        (self.size.width - x).min(SIDE) * (self.size.height - y).min(SIDE)
    }

    /// Column and row of the tile's first pixel.
    pub(crate) fn corner(&self, tile: usize) -> (u32, u32) {
        let tile = tile as u32;
        (tile % self.columns * SIDE, tile / self.columns * SIDE)
    }

    /// The tile's rows, as ranges of the picture's pixels.
    pub(crate) fn rows(
        &self,
        tile: usize,
    ) -> impl ExactSizeIterator<Item = std::ops::Range<usize>> {
        let (x, y) = self.corner(tile);
        let (width, height) = (self.size.width as usize, self.size.height);
        let end = (x + SIDE).min(self.size.width) as usize;
        (y..(y + SIDE).min(height)).map(move |row| {
            let row = row as usize * width;
            row + x as usize..row + end
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_tiles_cover_the_picture_once() {
        for size in [Size::new(1, 1), Size::new(64, 32), Size::new(100, 70), Size::new(33, 1)] {
            let grid = Grid::new(size);
            let mut covered = vec![0; size.pixels()];
            for tile in 0..grid.len() {
                grid.rows(tile).flatten().for_each(|pixel| covered[pixel] += 1);
                let pixels: usize = grid.rows(tile).map(|row| row.len()).sum();
                assert_eq!(pixels as u32, grid.pixels(tile));
            }
            assert!(covered.iter().all(|&times| times == 1), "{size:?}");
        }
    }
}
