//! The chosen tiles as one image, so that the headers of a format are paid once per message.

use super::{Grid, SIDE};

/// Tiles beside each other in an atlas: with many of them the atlas of a whole picture is about the picture.
const COLUMNS: usize = 32;

/// RGB, row-major.
pub(crate) struct Atlas {
    /// In tiles.
    pub(crate) columns: u16,
    /// In pixels.
    pub(crate) width: u16,
    /// In pixels.
    pub(crate) height: u16,
    /// Three bytes per pixel.
    pub(crate) rgb: Vec<u8>,
}

impl Atlas {
    /// Tiles of a picture; where one is cut by the border its last column and row are repeated, which costs next to nothing to encode.
    pub(crate) fn of(grid: &Grid, tiles: &[u16], rgba: &[[u8; 4]], memory: Vec<u8>) -> Atlas {
        let side = SIDE as usize;
        let columns = tiles.len().clamp(1, COLUMNS);
        let (width, height) = (columns * side, tiles.len().div_ceil(columns) * side);
        let mut rgb = memory;
        rgb.clear();
        rgb.resize(3 * width * height, 0);
        for (k, &tile) in tiles.iter().enumerate() {
            let (x, y) = (k % columns * side, k / columns * side);
            let mut from = Vec::with_capacity(side);
            from.extend(grid.rows(tile.into()));
            for line in 0..side {
                let row = &rgba[from[line.min(from.len() - 1)].clone()];
                let start = 3 * ((y + line) * width + x);
                let to = rgb[start..start + 3 * side].as_chunks_mut::<3>().0;
                for (column, to) in to.iter_mut().enumerate() {
                    let [r, g, b, _] = row[column.min(row.len() - 1)];
                    *to = [r, g, b];
                }
            }
        }
        Atlas { columns: columns as u16, width: width as u16, height: height as u16, rgb }
    }
}

#[cfg(test)]
mod tests {
    use frameless::Size;

    use super::*;

    #[test]
    fn tiles_lie_where_the_specification_says_and_are_padded() {
        // 24×17: 2×2 tiles, all but the first cut.
        let size = Size::new(24, 17);
        let at = |x: u32, y: u32| [x as u8, y as u8, 7, 255];
        let rgba: Vec<_> =
            (0..size.pixels() as u32).map(|pixel| at(pixel % 24, pixel / 24)).collect();
        let atlas = Atlas::of(&Grid::new(size), &[3, 0], &rgba, vec![1; 5]);
        assert_eq!((atlas.columns, atlas.width, atlas.height), (2, 32, 16));
        let pixel = |x: usize, y: usize| &atlas.rgb[3 * (y * 32 + x)..][..3];
        assert_eq!(pixel(0, 0), [16, 16, 7]);
        assert_eq!(pixel(7, 0), [23, 16, 7]);
        assert_eq!(pixel(15, 15), [23, 16, 7], "repeated");
        assert_eq!(pixel(16, 0), [0, 0, 7]);
        assert_eq!(pixel(31, 15), [15, 15, 7]);
    }
}
