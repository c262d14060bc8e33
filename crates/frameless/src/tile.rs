//! The picture cut into square tiles; those at the right and bottom border may be smaller.

use crate::Size;
use crate::traced::{Place, TILE_PIXELS};
use crate::wide::{self, F8, Unit};

/// Which pixel lies in which tile. Tiles are numbered row by row.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct TileGrid {
    pub(crate) size: Size,
    /// Side of a whole tile, in pixels.
    pub(crate) side: u32,
    pub(crate) columns: u32,
    pub(crate) rows: u32,
    by_width: Divider,
    by_side: Divider,
    by_columns: Divider,
}

/// Divides by a number that is known long before, with a product and a shift (Granlund and Montgomery 1994, "Division by invariant integers
/// using multiplication").
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Divider {
    /// ⌈2ᵏ / divisor⌉.
    reciprocal: u64,
    /// k.
    bits: u32,
}

impl Divider {
    /// For dividends up to `most`, which is below 2³¹.
    fn new(divisor: u32, most: u32) -> Divider {
        debug_assert!(most < 1 << 31);
        // The most for which no product has more than 64 bits: 2ᵏ > most · divisor, for which all quotients are exact.
        let bits = (most / divisor + 1).leading_zeros() + 32;
        Divider { reciprocal: (1u64 << bits).div_ceil(u64::from(divisor)), bits }
    }

    #[inline(always)]
    fn quotient(self, dividend: u32) -> u32 {
        ((self.reciprocal * u64::from(dividend)) >> self.bits) as u32
    }
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
        let by_width = Divider::new(size.width, size.pixels() as u32);
        let by_side = Divider::new(side, size.width.max(size.height));
        let by_columns = Divider::new(columns, columns * rows);
        TileGrid { size, side, columns, rows, by_width, by_side, by_columns }
    }

    pub(crate) fn len(&self) -> usize {
        self.columns as usize * self.rows as usize
    }

    #[inline]
    pub(crate) fn tile_of(&self, pixel: u32) -> usize {
        let y = self.by_width.quotient(pixel);
        let x = pixel - y * self.size.width;
        (self.by_side.quotient(y) * self.columns + self.by_side.quotient(x)) as usize
    }

    /// Where a pixel is if tiles are numbered and their pixels, row by row, too. Only for tiles of 8×8.
    #[inline(always)]
    pub(crate) fn place(&self, pixel: u32) -> Place {
        debug_assert_eq!(self.side, 8);
        let y = self.by_width.quotient(pixel);
        let x = pixel - y * self.size.width;
        let tile = (y / 8) as usize * self.columns as usize + (x / 8) as usize;
        Place(tile * TILE_PIXELS + (y % 8 * 8 + x % 8) as usize)
    }

    /// The pixel at a place, the inverse of [`TileGrid::place`]. Only for tiles of 8×8.
    #[inline(always)]
    pub(crate) fn pixel(&self, place: Place) -> u32 {
        self.corner(place.tile()) + self.step(place.within())
    }

    /// The first pixel of a tile of 8×8.
    #[inline(always)]
    pub(crate) fn corner(&self, tile: usize) -> u32 {
        debug_assert_eq!(self.side, 8);
        let [column, row] = self.column_and_row(tile);
        8 * (row * self.size.width + column)
    }

    /// Whether no tile is cut.
    #[inline(always)]
    pub(crate) fn is_whole(&self) -> bool {
        (self.size.width | self.size.height).is_multiple_of(8)
    }

    #[inline(always)]
    pub(crate) fn column_and_row(&self, tile: usize) -> [u32; 2] {
        let row = self.by_columns.quotient(tile as u32);
        [tile as u32 - row * self.columns, row]
    }

    /// A bit for every pixel of a tile of 8×8, row by row: set where there is one.
    #[inline(always)]
    pub(crate) fn pixels_of(&self, tile: usize) -> u64 {
        if self.is_whole() {
            return u64::MAX;
        }
        let [x1, y1] = self.column_and_row(tile).map(|at| 8 * (at + 1));
        let columns = 0xff >> x1.saturating_sub(self.size.width);
        (columns * 0x0101_0101_0101_0101) & (u64::MAX >> (8 * y1.saturating_sub(self.size.height)))
    }

    /// From the first pixel of a tile of 8×8 to another one in it.
    #[inline(always)]
    pub(crate) fn step(&self, within: usize) -> u32 {
        let within = within as u32;
        within / 8 * self.size.width + within % 8
    }

    #[inline]
    pub(crate) fn rect(&self, tile: usize) -> TileRect {
        let row = self.by_columns.quotient(tile as u32);
        let column = tile as u32 - row * self.columns;
        let (x0, y0) = (column * self.side, row * self.side);
        TileRect {
            x0,
            y0,
            x1: x0.saturating_add(self.side).min(self.size.width),
            y1: y0.saturating_add(self.side).min(self.size.height),
        }
    }
}

/// Numbers in a line of the cache.
pub(crate) const LINE: usize = 16;

/// A number for every tile, those of [`LINE`] consecutive ones in a line of the cache; what is behind the last is 0.
#[derive(Clone, Debug, Default)]
pub(crate) struct PerTile(Vec<Line>);

#[derive(Clone, Copy, Debug, Default)]
#[repr(align(64))]
struct Line([f32; LINE]);

/// A line's two halves.
#[inline(always)]
pub(crate) fn halves<U: Unit>(line: &[f32; LINE]) -> [F8<U>; 2] {
    [F8::load(line, 0), F8::load(line, LINE / 2)]
}

impl PerTile {
    /// All 0.
    pub(crate) fn new(tiles: usize) -> PerTile {
        PerTile(vec![Line::default(); tiles.div_ceil(LINE)])
    }

    #[inline(always)]
    pub(crate) fn of(&self, tile: usize) -> f32 {
        self.0[tile / LINE].0[tile % LINE]
    }

    #[inline(always)]
    pub(crate) fn of_mut(&mut self, tile: usize) -> &mut f32 {
        &mut self.0[tile / LINE].0[tile % LINE]
    }

    /// Of all tiles, and what is behind the last.
    pub(crate) fn all_mut(&mut self) -> impl Iterator<Item = &mut f32> {
        self.0.iter_mut().flat_map(|line| &mut line.0)
    }

    pub(crate) fn lines(&self) -> usize {
        self.0.len()
    }

    #[inline(always)]
    pub(crate) fn line(&self, line: usize) -> &[f32; LINE] {
        &self.0[line].0
    }

    #[inline(always)]
    pub(crate) fn line_mut(&mut self, line: usize) -> &mut [f32; LINE] {
        &mut self.0[line].0
    }

    /// A line's two halves.
    #[inline(always)]
    pub(crate) fn halves<U: Unit>(&self, line: usize) -> [F8<U>; 2] {
        halves(self.line(line))
    }

    /// Begins to fetch a line.
    #[inline(always)]
    pub(crate) fn prefetch(&self, line: usize) {
        wide::prefetch(&self.0, line);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn division_is_exact() {
        const MOST: u32 = i32::MAX as u32;
        for divisor in [1, 2, 3, 7, 16, 512, 1000, 3840, 46_340, 65_537, MOST - 1, MOST] {
            for most in [1, 70, 4096, 5_000_000, MOST - 1, MOST] {
                let divider = Divider::new(divisor, most);
                let near = |n: u64| (n.saturating_sub(2)..n + 3).map(|n| n as u32);
                let multiples =
                    (0..31).map(|k| (1u64 << k) / u64::from(divisor) * u64::from(divisor));
                let dividends = multiples.flat_map(near).chain([0, 1, most - 1, most]);
                for dividend in dividends.filter(|dividend| *dividend <= most) {
                    let quotient = dividend / divisor;
                    assert_eq!(divider.quotient(dividend), quotient, "{dividend} / {divisor}");
                }
            }
        }
    }

    #[test]
    fn places_are_those_of_the_tiles() {
        for (width, height) in [(512, 384), (13, 7), (1, 1), (3, 9)] {
            let grid = TileGrid::new(Size::new(width, height), 8);
            for pixel in 0..grid.size.pixels() as u32 {
                let (place, (x, y)) = (grid.place(pixel), grid.size.xy(pixel));
                assert_eq!(place.tile(), grid.tile_of(pixel));
                assert_eq!(place.within() as u32, y % 8 * 8 + x % 8);
                assert_eq!(grid.pixel(place), pixel);
                assert!(grid.pixels_of(place.tile()) >> place.within() & 1 == 1);
            }
            let pixels = (0..grid.len()).map(|tile| grid.pixels_of(tile).count_ones() as usize);
            assert_eq!(pixels.sum::<usize>(), grid.size.pixels());
        }
    }

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
