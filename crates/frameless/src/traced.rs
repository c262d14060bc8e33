//! When each pixel was traced last, and whether anything is known of it: a mark of four bytes per pixel, those of a tile of 8×8 beside each
//! other.
//!
//! ```text
//! mark = 2 · tick + (1 where nothing is known)        modulo 2³²; a tick is 16 µs
//! ```
//!
//! Whoever looks for the next pixel to be traced looks all over the picture, and what lies far apart takes longer to fetch than everything
//! else together: here a tile is four lines of the cache, where rows of whole times would be eight, in as many pages.

use crate::tile::TileGrid;
use crate::time::{TICK_BITS, TICK_SECS, Tick};
use crate::{Size, Time, pages, wide};

/// Pixels of a tile.
pub(crate) const TILE_PIXELS: usize = 64;
/// Side of a tile, as a power of two.
const SIDE_BITS: u32 = 3;

/// Where a pixel's mark is: 64 · tile + place in the tile, row by row.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Place(pub(crate) usize);

impl Place {
    #[inline(always)]
    pub(crate) fn tile(self) -> usize {
        self.0 / TILE_PIXELS
    }

    /// Place in the tile, row by row.
    #[inline(always)]
    pub(crate) fn within(self) -> usize {
        self.0 % TILE_PIXELS
    }
}

/// See the module.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Mark(pub(crate) u32);

impl Mark {
    /// Of a known pixel that was traced then.
    #[inline(always)]
    pub(crate) fn at(time: Time) -> Mark {
        Mark::of_tick(Tick::of(time).0)
    }

    /// Of a known pixel that was traced at a tick.
    #[inline(always)]
    pub(crate) fn of_tick(tick: u32) -> Mark {
        Mark(tick << 1)
    }

    #[inline(always)]
    pub(crate) fn is_known(self) -> bool {
        self.0 & 1 == 0
    }

    /// How much later this mark is, in half ticks; negative if it is earlier. Right for five hours.
    #[inline(always)]
    pub(crate) fn since(self, earlier: Mark) -> i32 {
        self.0.wrapping_sub(earlier.0) as i32
    }
}

pub(crate) const HALF_TICKS_PER_SEC: f32 = 2.0 / TICK_SECS;

/// Seconds as half ticks, rounded down.
#[inline(always)]
pub(crate) fn half_ticks(secs: f32) -> i32 {
    (secs * HALF_TICKS_PER_SEC) as i32
}

/// The marks of a tile.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(align(64))]
pub(crate) struct TileMarks(pub(crate) [u32; TILE_PIXELS]);

/// Marks of all pixels. Tiles at the border may have more than there are pixels; those mean nothing.
#[derive(Clone, Debug)]
pub(crate) struct Traced {
    grid: TileGrid,
    tiles: Vec<TileMarks>,
    /// No mark is later.
    latest: Time,
}

impl PartialEq for Traced {
    fn eq(&self, other: &Traced) -> bool {
        let same = self.grid == other.grid && self.latest == other.latest;
        same && self.marks().eq(other.marks())
    }
}

impl Traced {
    /// All traced at [`Time::ZERO`]; whether anything is known of them.
    pub(crate) fn new(size: Size, known: bool) -> Traced {
        let grid = TileGrid::new(size, 1 << SIDE_BITS);
        let mark = u32::from(!known);
        Traced { tiles: Traced::unmarked(&grid, mark), grid, latest: Time::ZERO }
    }

    fn unmarked(grid: &TileGrid, mark: u32) -> Vec<TileMarks> {
        pages::filled(TileMarks([mark; TILE_PIXELS]), grid.len())
    }

    pub(crate) fn grid(&self) -> &TileGrid {
        &self.grid
    }

    pub(crate) fn tiles(&self) -> &[TileMarks] {
        &self.tiles
    }

    #[inline(always)]
    pub(crate) fn place(&self, pixel: u32) -> Place {
        self.grid.place(pixel)
    }

    #[inline(always)]
    pub(crate) fn mark(&self, place: Place) -> Mark {
        Mark(self.tiles[place.tile()].0[place.within()])
    }

    #[inline(always)]
    pub(crate) fn set(&mut self, place: Place, time: Time) {
        self.tiles[place.tile()].0[place.within()] = Mark::at(time).0;
        self.latest = self.latest.max(time);
    }

    /// When a pixel was traced, rounded down to a tick.
    #[inline(always)]
    pub(crate) fn time(&self, mark: Mark) -> Time {
        let ago = u64::from(Mark::at(self.latest).0.wrapping_sub(mark.0 & !1) >> 1);
        Time((self.latest.0 >> TICK_BITS).saturating_sub(ago) << TICK_BITS)
    }

    /// All marks, row by row of the picture.
    pub(crate) fn marks(&self) -> impl Iterator<Item = Mark> {
        let Size { width, height } = self.grid.size;
        (0..height).flat_map(move |y| {
            let tiles = (y / 8) as usize * self.grid.columns as usize..;
            let row = self.tiles[tiles].iter().flat_map(move |tile| {
                let first = (y % 8 * 8) as usize;
                tile.0[first..first + 8].iter().map(|&mark| Mark(mark))
            });
            row.take(width as usize)
        })
    }

    /// The marks of all tiles, until they are given back by [`Traced::replace`].
    pub(crate) fn lend(&mut self) -> Vec<TileMarks> {
        std::mem::take(&mut self.tiles)
    }

    /// The marks of all tiles are others from now on, at `now`.
    ///
    /// # Panics
    /// If there are not as many.
    pub(crate) fn replace(&mut self, now: Time, marks: Vec<TileMarks>) {
        assert_eq!(marks.len(), self.grid.len());
        self.tiles = marks;
        self.latest = self.latest.max(now);
    }

    /// Of a picture of another size, of which every pixel takes over the mark of one of this.
    pub(crate) fn resized(&self, size: Size, source: impl Fn(u32) -> u32) -> Traced {
        let mut resized = Traced { latest: self.latest, ..Traced::new(size, false) };
        for pixel in 0..size.pixels() as u32 {
            let place = resized.place(pixel);
            let mark = self.mark(self.place(source(pixel)));
            resized.tiles[place.tile()].0[place.within()] = mark.0;
        }
        resized
    }

    /// Begins to fetch a pixel's mark.
    #[inline(always)]
    pub(crate) fn prefetch(&self, place: Place) {
        if let Some(tile) = self.tiles.get(place.tile()) {
            wide::prefetch(&tile.0, place.within());
        }
    }
}
