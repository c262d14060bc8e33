//! Which tiles have to be gathered again.

use std::sync::atomic::{AtomicBool, Ordering};

use crate::Size;

/// Side of a tile, in pixels.
pub(super) const TILE: u32 = 8;

/// Tiles of which something has changed since they were gathered last. Several threads may tell of changes at once.
#[derive(Default)]
pub(super) struct Touched {
    columns: u32,
    /// Whether everything has.
    all: AtomicBool,
    tiles: Vec<AtomicBool>,
}

impl Touched {
    /// Everything.
    pub(super) fn new(size: Size) -> Touched {
        let columns = size.width.div_ceil(TILE);
        let len = columns * size.height.div_ceil(TILE);
        let tiles = (0..len).map(|_| AtomicBool::new(false)).collect();
        Touched { columns, all: AtomicBool::new(true), tiles }
    }

    /// Something has changed in pixel (x, y), which is in the picture.
    #[inline(always)]
    pub(super) fn mark(&self, x: u32, y: u32) {
        if self.all.load(Ordering::Relaxed) {
            return;
        }
        let tile = y / TILE * self.columns + x / TILE;
        self.tiles[tile as usize].store(true, Ordering::Relaxed);
    }

    /// The same of a position in the picture, in pixels.
    #[inline(always)]
    pub(super) fn mark_px(&self, [x, y]: [f32; 2]) {
        // As signed numbers, as [`Layout::of_px`](super::store::Layout::of_px) does: one instruction.
        self.mark(x as i32 as u32, y as i32 as u32);
    }

    pub(super) fn mark_all(&self) {
        self.all.store(true, Ordering::Relaxed);
    }

    /// Of the tile in a row and column: whether anything has changed in it or beside it.
    pub(super) fn is_near(&self, row: u32, column: u32) -> bool {
        if self.all.load(Ordering::Relaxed) {
            return true;
        }
        let rows = self.tiles.len() as u32 / self.columns;
        let beside = |at: u32, end: u32| at.saturating_sub(1)..(at + 2).min(end);
        beside(row, rows).any(|row| {
            let [first, last] =
                [beside(column, self.columns).start, beside(column, self.columns).end]
                    .map(|column| (row * self.columns + column) as usize);
            self.tiles[first..last].iter().any(|tile| tile.load(Ordering::Relaxed))
        })
    }

    /// All has been gathered.
    pub(super) fn clear(&mut self) {
        *self.all.get_mut() = false;
        self.tiles.iter_mut().for_each(|tile| *tile.get_mut() = false);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_touched_reaches_the_tiles_beside_it() {
        let mut touched = Touched::new(Size::new(41, 24));
        assert!(touched.is_near(2, 5), "everything at first");
        touched.clear();
        touched.mark_px([16.0, 15.99]);
        for (row, column) in (0..3).flat_map(|row| (0..6).map(move |column| (row, column))) {
            assert_eq!(touched.is_near(row, column), (1..4).contains(&column), "{row} {column}");
        }
    }
}
