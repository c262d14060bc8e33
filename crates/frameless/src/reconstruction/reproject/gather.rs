//! The picture from the carried samples.
//!
//! ```text
//! e_j = v · age_j + s · dist_j²         expected squared error of sample j at a pixel's centre
//! w_j = 1 / (e_j + ε)²                  over the samples of the reference's object
//! ```
//!
//! The reference is the pixel's own sample with the least expected error. Pixels without one are holes: beside samples they show
//! the mean of those around that belong to one object, farther away something smooth between what is known
//! ([`smooth`](super::smooth)).
//!
//! ```text
//! a a ·      Which object: one that has samples at opposite sides of the hole, of several the nearest to the camera: it is a gap in that.
//! a ? a      Else that of the farthest sample: what has been uncovered is what was behind.
//! · b b
//! ```
//!
//! In a hole of the second kind the last ray tells what is there, if it went since the last refresh and by more than 7 % behind all around.
//!
//! A tile in which nothing has been touched goes on showing what it shows, as long as all its samples would still be taken as they are.

mod blocks;
mod near;
mod rows;

use super::holes::Waiting;
use super::smooth::{Far, Smooth};
use super::store::{Store, Tick};
use super::touched::TILE;
use crate::rates::Rates;
use crate::tile::TileGrid;
use crate::traced::TileMarks;
use crate::{Time, bands, wide};
use blocks::{Blocks, Holes};
use rows::Columns;

/// Gathers pictures.
pub(super) struct Gather {
    /// Whether pixels show means; else each its own best sample as it is.
    means: bool,
    /// Pixels to be traced.
    pub(super) waiting: Waiting,
    /// Bit by bit for eight pixels of a row: which have a sample at their centre.
    central: Vec<u8>,
    /// Per tile, bit by bit for its pixels: holes that are not beside samples.
    far: Vec<u64>,
    smooth: Smooth,
    /// Of each tile.
    calm: Vec<Calm>,
    /// Scratch memory of each band of rows.
    columns: Vec<Vec<Columns>>,
}

/// What a picture is gathered from.
#[derive(Clone, Copy)]
pub(super) struct Look<'a, F> {
    pub(super) store: &'a Store,
    pub(super) now: Time,
    pub(super) threads: usize,
    /// Its tiles are eight pixels wide.
    pub(super) rates: &'a Rates,
    /// Per tile of these.
    pub(super) contrast: &'a [f32],
    /// Samples beside their pixel's centre are to be traced again, where their object rests; so are those at the centre that have been
    /// carried there, since the camera came to rest only after this time.
    pub(super) carried: Tick,
    /// When the picture before was shown.
    pub(super) before: Tick,
    /// Of an object number; `None`: no sample is to be traced again.
    pub(super) rests: Option<F>,
}

/// What the pixels show. Each as it was at the picture before, where it stays.
pub(super) struct Shown<'a> {
    pub(super) rgb: &'a mut [[f32; 3]],
    /// When that was traced, [`Time::ZERO`] if nothing is known anywhere, and whether there is a sample of the pixel's own.
    pub(super) marks: &'a mut [TileMarks],
}

/// Of a tile whose pixels all have a sample at their centre, which they show as it is: when the oldest of these was traced.
type Calm = Option<Tick>;

impl Gather {
    pub(super) fn new(means: bool) -> Gather {
        Gather {
            means,
            waiting: Waiting::default(),
            central: Vec::new(),
            far: Vec::new(),
            smooth: Smooth::default(),
            calm: Vec::new(),
            columns: Vec::new(),
        }
    }

    /// [`Look::store`] is as if untouched afterwards.
    pub(super) fn run<F>(&mut self, look: Look<'_, F>, mut shown: Shown<'_>)
    where
        F: Fn(u32) -> bool + Copy + Send + Sync,
    {
        let size = look.store.layout.size;
        let prior = mean_of(shown.rgb);
        self.waiting.begin(&look.rates.grid);
        let columns = size.width.div_ceil(TILE) as usize;
        self.central.resize(columns * size.height as usize, 0);
        self.far.clear();
        self.far.resize(look.rates.grid.len(), 0);
        self.calm.resize(columns * size.height.div_ceil(TILE) as usize, None);
        match look.store.layout.per_side {
            1 => self.gather::<_, 1, 1>(look, &mut shown),
            _ => self.gather::<_, 2, 4>(look, &mut shown),
        }
        // What is shown where next to nothing is known.
        let is_far = self.far.iter().any(|&pixels| pixels != 0);
        if is_far && !self.knows_nothing(&look.rates.grid) {
            let far = Far { grid: &look.rates.grid, tiles: &self.far };
            self.smooth.run(far, prior, shown.rgb);
        }
    }

    /// Band by band, with `N` × `N` = `SUBS` cells per pixel.
    fn gather<F, const N: usize, const SUBS: usize>(
        &mut self,
        look: Look<'_, F>,
        shown: &mut Shown<'_>,
    ) where
        F: Fn(u32) -> bool + Copy + Send + Sync,
    {
        let (size, columns) = (look.store.layout.size, look.rates.grid.columns as usize);
        let rows = bands::rows(size.height, look.threads);
        let [pixels, eights] = [size.width as usize, columns].map(|count| count * rows as usize);
        let tiles = columns * rows.div_ceil(TILE) as usize;
        self.columns.resize_with(size.height.div_ceil(rows) as usize, Vec::new);
        let (means, [unknown, off_centre]) = (self.means, self.waiting.tiles());
        let bands = shown
            .rgb
            .chunks_mut(pixels)
            .zip(shown.marks.chunks_mut(tiles))
            .zip(self.central.chunks_mut(eights))
            .zip(self.calm.chunks_mut(tiles))
            .zip(unknown.chunks_mut(tiles).zip(off_centre.chunks_mut(tiles)))
            .zip(self.far.chunks_mut(tiles))
            .zip(&mut self.columns);
        let bands = (0u32..).step_by(rows as usize).zip(bands).map(|(first_row, band)| {
            let ((((((rgb, marks), central), calm), (unknown, off_centre)), far), columns) = band;
            let (shown, holes) = (Shown { rgb, marks }, Holes { unknown, off_centre, far });
            Blocks::<_, N, SUBS> { look, means, first_row, shown, central, calm, holes, columns }
        });
        bands::run(look.threads, bands.collect(), wide::run);
    }

    /// Whether all pixels are far from all samples.
    fn knows_nothing(&self, grid: &TileGrid) -> bool {
        let mut tiles = (0..grid.len()).zip(&self.far);
        tiles.all(|(tile, &pixels)| pixels == grid.pixels_of(tile))
    }

    /// Row by row, bit by bit for eight pixels at a time: which have a sample at their centre.
    pub(super) fn central(&self) -> &[u8] {
        &self.central
    }
}

/// Of every so manieth pixel: in what is shown far from everything that is known, details do not count.
fn mean_of(shown: &[[f32; 3]]) -> [f32; 3] {
    let few = shown.iter().step_by(31);
    let count = few.len() as f32;
    few.fold([0.0; 3], |sum, c| std::array::from_fn(|k| sum[k] + c[k])).map(|sum| sum / count)
}
