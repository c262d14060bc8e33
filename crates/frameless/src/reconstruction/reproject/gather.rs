//! The picture from the carried samples.
//!
//! ```text
//! e_j = v · age_j + s · dist_j²         expected squared error of sample j at a pixel's centre
//! w_j = 1 / (e_j + ε)²                  over the samples of the reference's object
//! ```
//!
//! The reference is the pixel's own sample with the least expected error. Pixels without one are holes: beside samples they show
//! the mean of those around that belong to the nearest one's object, farther away what the nearest pixel shows that is no hole
//! ([`fill`](super::fill)).

use std::ops::Range;

use super::fill::{self, AROUND};
use super::holes::{Hole, Waiting};
use super::smooth::Smooth;
use super::store::{EMPTY, Layout, Store, TICK_SECS, Tick, centres, distance2};
use crate::Time;
use crate::bands;
use crate::rates::Rates;
use crate::tile::TileGrid;
use crate::traced::{Mark, TileMarks};
use crate::wide::{self, F8, M8, Planes, Unit};

/// What became of the pixels.
pub(super) struct Gather {
    /// Whether pixels show means; else each its own best sample as it is.
    means: bool,
    /// Per pixel when what it shows was traced, [`Time::ZERO`] if nothing is known anywhere, and whether it has a sample of its own.
    pub(super) marks: Vec<TileMarks>,
    /// Pixels to be traced.
    pub(super) waiting: Waiting,
    /// Per pixel the one whose sample it shows: itself, unless it is a hole.
    source: Vec<u32>,
    /// Holes that are not beside samples.
    far: Vec<u32>,
    smooth: Smooth,
    /// Of each band of rows.
    found: Vec<Found>,
}

/// What was found in a band of rows.
#[derive(Default)]
struct Found {
    waiting: Waiting,
    far: Vec<u32>,
}

/// Below this expected error a sample is taken as it is.
const EXACT: f32 = 2e-5;

impl Gather {
    pub(super) fn new(means: bool) -> Gather {
        Gather {
            means,
            marks: Vec::new(),
            waiting: Waiting::default(),
            source: Vec::new(),
            far: Vec::new(),
            smooth: Smooth::default(),
            found: Vec::new(),
        }
    }

    /// `contrast` per tile of `rates`, whose tiles are eight pixels wide; `shown`: the picture if nothing is known.
    #[expect(clippy::too_many_arguments)]
    pub(super) fn run(
        &mut self,
        store: &Store,
        now: Time,
        threads: usize,
        rates: &Rates,
        contrast: &[f32],
        shown: &[[f32; 3]],
        picture: &mut Vec<[f32; 3]>,
    ) {
        let pixels = store.layout.size.pixels();
        picture.resize(pixels, [0.0; 3]);
        self.marks.resize(rates.grid.len(), TileMarks::UNKNOWN);
        self.source.resize(pixels, fill::NOBODY);
        self.far.clear();
        self.waiting.clear();
        let [red, green, blue] = store.rgb.each_ref().map(Vec::as_slice);
        let model = Model {
            samples: Planes::new([&store.px[0], &store.px[1], red, green, blue]),
            marks: Planes::new([&store.object, &store.tick]),
            store,
            now: Tick::of(now),
            rates,
            contrast,
        };
        let cells = &Cells::new(&store.layout);
        let size = store.layout.size;
        let rows = bands::rows(size.height, threads);
        let band = rows as usize * size.width as usize;
        self.found.resize_with(size.height.div_ceil(rows) as usize, Found::default);
        let means = self.means;
        // Bands are of whole tiles, but for the last.
        let tiles = rows.div_ceil(8) as usize * rates.grid.columns as usize;
        let bands = picture
            .chunks_mut(band)
            .zip(self.marks.chunks_mut(tiles))
            .zip(self.source.chunks_mut(band))
            .zip(&mut self.found)
            .zip((0..size.height).step_by(rows as usize));
        let bands = bands.map(|((((picture, marks), source), found), first_row)| {
            let first = size.index(0, first_row);
            let first_tile = (first_row / 8 * rates.grid.columns) as usize;
            Blocks { model, cells, means, first, first_tile, picture, marks, source, found }
        });
        bands::run(threads, bands.collect(), wide::run);
        for found in &mut self.found {
            self.waiting.append(&mut found.waiting);
            self.far.append(&mut found.far);
        }
        self.fill_far(&rates.grid, shown, picture);
    }

    fn fill_far(&mut self, grid: &TileGrid, shown: &[[f32; 3]], picture: &mut [[f32; 3]]) {
        let size = grid.size;
        if self.far.len() == size.pixels() {
            picture.copy_from_slice(shown);
        } else {
            self.smooth.run(size, &self.far, &self.source, mean_of(shown), picture);
        }
        fill::nearest(size, &self.far, &mut self.source);
        for &pixel in &self.far {
            let mark = match self.source[pixel as usize] {
                fill::NOBODY => Mark::default(),
                source => {
                    let place = grid.place(source);
                    Mark(self.marks[place.tile()].0[place.within()])
                }
            };
            let place = grid.place(pixel);
            self.marks[place.tile()].0[place.within()] = mark.of_unknown().0;
        }
    }

    /// After a picture: samples beside their pixel's centre are to be traced again, where their object `rests`; so are those at the centre
    /// that have been carried there, since the camera came to rest only after `carried`.
    pub(super) fn find_off_centre(
        &mut self,
        store: &Store,
        carried: Tick,
        threads: usize,
        rests: impl Fn(u32) -> bool + Sync,
    ) {
        let height = store.layout.size.height;
        let band = bands::rows(height, threads);
        let firsts = (0..height).step_by(band as usize);
        let bands = self.found.iter_mut().zip(firsts).map(|(found, first)| {
            let rows = first..(first + band).min(height);
            OffCentre { store, rows, carried, rests: &rests, waiting: &mut found.waiting }
        });
        bands::run(threads, bands.collect(), wide::run);
        self.found.iter_mut().for_each(|found| self.waiting.append(&mut found.waiting));
    }
}

/// Of every so manieth pixel: in what is shown far from everything that is known, details do not count.
fn mean_of(shown: &[[f32; 3]]) -> [f32; 3] {
    let few = shown.iter().step_by(31);
    let count = few.len() as f32;
    few.fold([0.0; 3], |sum, c| std::array::from_fn(|k| sum[k] + c[k])).map(|sum| sum / count)
}

struct OffCentre<'a, F> {
    store: &'a Store,
    rows: Range<u32>,
    carried: Tick,
    rests: &'a F,
    waiting: &'a mut Waiting,
}

impl<F: Fn(u32) -> bool> wide::Task for OffCentre<'_, F> {
    #[inline(always)]
    fn run<U: Unit>(self) {
        let OffCentre { store, rows, carried, rests, waiting } = self;
        let Layout { size, plane, .. } = store.layout;
        for y in rows {
            for x in (0..size.width).step_by(8) {
                let first = store.layout.of_pixel(x as i32, y as i32);
                let (mut known, mut central) = (M8::<U>::splat(0), M8::splat(0));
                for sub in 0..store.layout.subs() {
                    let i = first + sub * plane;
                    let is_sample = M8::load(&store.object, i).equals(M8::splat(EMPTY)).not();
                    known = known.either(is_sample);
                    let since = M8::load(&store.tick, i).minus(M8::splat(carried.0));
                    let is_traced = M8::splat(0).less_than(since);
                    central = central.either(store.are_central(i, x, y).and(is_traced));
                }
                // Cells beyond the border are empty.
                known.and(central.not()).for_each(|lane| {
                    let x = x + lane as u32;
                    if store.newest(x, y).is_some_and(|cell| rests(store.object[cell])) {
                        waiting.push(size.index(x, y), x, y, Hole::OffCentre);
                    }
                });
            }
        }
    }
}

/// From the first cell of a pixel to others.
struct Cells {
    own: Vec<isize>,
    /// Those of the 3×3 pixels around, and whether they are at most one cell away: all bits, or none.
    around: Vec<(isize, u32)>,
    /// First cells of the pixels [`AROUND`].
    pixels: [isize; 8],
}

impl Cells {
    fn new(layout: &Layout) -> Cells {
        let n = layout.per_side as i32;
        let here = layout.of_pixel(0, 0) as isize;
        let to = |dx, dy| layout.neighbour(0, 0, dx, dy) as isize - here;
        let square = |cells: std::ops::Range<i32>| {
            cells.clone().flat_map(move |dy| cells.clone().map(move |dx| (dx, dy)))
        };
        let is_near = |d: i32| -1 <= d && d <= n;
        let mask = |dx, dy| u32::from(is_near(dx) && is_near(dy)).wrapping_neg();
        Cells {
            own: square(0..n).map(|(dx, dy)| to(dx, dy)).collect(),
            around: square(-n..2 * n).map(|(dx, dy)| (to(dx, dy), mask(dx, dy))).collect(),
            pixels: AROUND.map(|[dx, dy]| to(n * dx, n * dy)),
        }
    }
}

/// The expected error of samples.
#[derive(Clone, Copy)]
struct Model<'a> {
    /// Column, row, red, green, blue.
    samples: Planes<'a, f32, 5>,
    /// Object, tick.
    marks: Planes<'a, u32, 2>,
    store: &'a Store,
    now: Tick,
    rates: &'a Rates,
    contrast: &'a [f32],
}

/// The pixels of a band of rows, eight at a time.
struct Blocks<'a> {
    model: Model<'a>,
    cells: &'a Cells,
    means: bool,
    /// The band's first pixel, and its first tile.
    first: u32,
    first_tile: usize,
    /// Of the band's pixels, as all below.
    picture: &'a mut [[f32; 3]],
    marks: &'a mut [TileMarks],
    source: &'a mut [u32],
    found: &'a mut Found,
}

/// Eight pixels in a row of one tile.
struct Eight<U: Unit> {
    /// The first cell of the first one.
    first: usize,
    centre: [F8<U>; 2],
    /// The tile's learned rate of change, and its contrast.
    v: F8<U>,
    s: F8<U>,
}

/// What eight pixels show.
struct Seen<U: Unit> {
    rgb: [F8<U>; 3],
    /// The object; [`EMPTY`] where there is none.
    object: M8<U>,
    /// The expected error of the reference.
    error: F8<U>,
    /// When the pixel's newest sample was traced.
    tick: M8<U>,
}

impl wide::Task for Blocks<'_> {
    #[inline(always)]
    fn run<U: Unit>(mut self) {
        let size = self.model.store.layout.size;
        let columns = self.model.rates.grid.columns;
        let (first, rows) = (self.first / size.width, self.picture.len() as u32 / size.width);
        for y in first..first + rows {
            for x in (0..size.width).step_by(8) {
                self.block::<U>(x, y, (y / 8 * columns + x / 8) as usize);
            }
        }
    }
}

impl Blocks<'_> {
    #[inline(always)]
    fn block<U: Unit>(&mut self, x: u32, y: u32, tile: usize) {
        let Model { store, rates, contrast, .. } = self.model;
        let size = store.layout.size;
        let eight = Eight::<U> {
            first: store.layout.of_pixel(x as i32, y as i32),
            centre: centres(x, y),
            v: F8::splat(rates.of_tile(tile)),
            s: F8::splat(contrast[tile]),
        };
        let mut seen = self.model.own(&eight, self.cells);
        let empty = M8::splat(EMPTY);
        let lanes = 8.min((size.width - x) as usize);
        let holes = seen.object.equals(empty).and(M8::first_lanes(lanes));
        if holes.any() {
            seen.object = self.model.nearest(&eight, self.cells).or(holes, seen.object);
        }
        let exact = match self.means {
            true => seen.error.less_than(F8::splat(EXACT)),
            false => holes.not(),
        };
        if !exact.either(seen.object.equals(empty)).all() {
            let mean = self.model.mean(&eight, self.cells, seen.object, holes);
            seen.rgb = F8::all_or(seen.rgb, exact, mean);
        }
        let start = size.index(x, y);
        let [r, g, b] = seen.rgb;
        let rgb = [r.lanes(), g.lanes(), b.lanes()];
        let in_band = (start - self.first) as usize;
        let pixels = in_band..in_band + lanes;
        let picture = &mut self.picture[pixels.clone()];
        let source = &mut self.source[pixels];
        for lane in 0..lanes {
            picture[lane] = [rgb[0][lane], rgb[1][lane], rgb[2][lane]];
            source[lane] = start + lane as u32;
        }
        // A mask is −1 where it is set.
        let marks = seen.tick.plus(seen.tick).minus(holes);
        let tile = tile - self.first_tile;
        marks.store(&mut self.marks[tile].0, (y % 8 * 8) as usize);
        if holes.any() {
            self.note_holes(&eight, holes, [x, y], tile);
        }
    }

    /// How well holes can be guessed, and whose sample they show.
    #[inline(always)]
    fn note_holes<U: Unit>(
        &mut self,
        eight: &Eight<U>,
        holes: M8<U>,
        [x, y]: [u32; 2],
        tile: usize,
    ) {
        let Model { store, .. } = self.model;
        let size = store.layout.size;
        let (mut nearest, mut known) = (M8::<U>::splat(AROUND.len() as u32), M8::splat(0));
        for (k, &offset) in self.cells.pixels.iter().enumerate().rev() {
            let first = eight.first.wrapping_add_signed(offset);
            let is_known = self.model.are_known(first, self.cells);
            nearest = M8::splat(k as u32).or(is_known, nearest);
            // A mask is −1 where it is set.
            known = known.plus(is_known);
        }
        let (nearest, known) = (nearest.lanes(), known.lanes());
        let row = (y % 8 * 8) as usize;
        holes.for_each(|lane| {
            let x = x + lane as u32;
            let pixel = size.index(x, y);
            let in_band = (pixel - self.first) as usize;
            let hole = if known[lane] as i32 <= -4 { Hole::Small } else { Hole::Large };
            self.found.waiting.push(pixel, x, y, hole);
            let Some([dx, dy]) = AROUND.get(nearest[lane] as usize) else {
                self.source[in_band] = fill::NOBODY;
                self.found.far.push(pixel);
                return;
            };
            let (x, y) = (x.wrapping_add_signed(*dx), y.wrapping_add_signed(*dy));
            self.source[in_band] = size.index(x, y);
            if let Some(i) = store.newest(x, y) {
                let mark = Mark::of_tick(store.tick[i]).of_unknown();
                self.marks[tile].0[row + lane] = mark.0;
            }
        });
    }
}

impl Model<'_> {
    #[inline(always)]
    fn errors<U: Unit>(&self, px: [F8<U>; 2], tick: M8<U>, eight: &Eight<U>) -> F8<U> {
        let age_secs = M8::splat(self.now.0).minus(tick).to_f32() * F8::splat(TICK_SECS);
        eight.v * age_secs + eight.s * distance2(px, &eight.centre)
    }

    /// The pixels' own samples with the least expected error.
    #[inline(always)]
    fn own<U: Unit>(&self, eight: &Eight<U>, cells: &Cells) -> Seen<U> {
        let mut seen = Seen {
            rgb: [F8::splat(0.0); 3],
            object: M8::splat(EMPTY),
            error: F8::splat(f32::MAX),
            tick: M8::splat(0),
        };
        for &offset in &cells.own {
            let i = eight.first.wrapping_add_signed(offset);
            let [x, y, rgb @ ..] = self.samples.load(i);
            let [object, tick] = self.marks.load(i);
            let error = self.errors([x, y], tick, eight);
            let is_sample = object.equals(M8::splat(EMPTY)).not();
            let is_first = seen.object.equals(M8::splat(EMPTY));
            let is_newer = M8::splat(0).less_than(tick.minus(seen.tick));
            seen.tick = tick.or(is_sample.and(is_first.either(is_newer)), seen.tick);
            let better = error.less_than(seen.error).and(is_sample);
            seen.error = error.or(better, seen.error);
            seen.object = object.or(better, seen.object);
            seen.rgb = F8::all_or(rgb, better, seen.rgb);
        }
        seen
    }

    /// The objects of the samples nearest to the centres of holes; [`EMPTY`] where there is none around.
    #[inline(always)]
    fn nearest<U: Unit>(&self, eight: &Eight<U>, cells: &Cells) -> M8<U> {
        let mut least = F8::splat(f32::INFINITY);
        let mut nearest = M8::splat(EMPTY);
        for &(offset, _) in &cells.around {
            let i = eight.first.wrapping_add_signed(offset);
            let ([x, y, ..], [object, _]) = (self.samples.load(i), self.marks.load(i));
            let is_sample = object.equals(M8::splat(EMPTY)).not();
            let distance2 = distance2([x, y], &eight.centre);
            let nearer = distance2.less_than(least).and(is_sample);
            least = distance2.or(nearer, least);
            nearest = object.or(nearer, nearest);
        }
        nearest
    }

    /// Over the objects' samples: those in the pixel's cells and one further around, for holes in the 3×3 pixels around.
    #[inline(always)]
    fn mean<U: Unit>(
        &self,
        eight: &Eight<U>,
        cells: &Cells,
        object: M8<U>,
        holes: M8<U>,
    ) -> [F8<U>; 3] {
        let floor = F8::splat(least_error(eight.s.lanes()[0]));
        let zero = F8::splat(0.0);
        let (mut red, mut green, mut blue, mut weights) = (zero, zero, zero, zero);
        for &(offset, is_near) in &cells.around {
            let i = eight.first.wrapping_add_signed(offset);
            let [x, y, r, g, b] = self.samples.load(i);
            let [other, tick] = self.marks.load(i);
            let counts = other.equals(object).and(holes.either(M8::splat(is_near)));
            let error = self.errors([x, y], tick, eight) + floor;
            let weight = (F8::splat(1.0) / (error * error)).or(counts, zero);
            weights = weights + weight;
            red = red + weight * r;
            green = green + weight * g;
            blue = blue + weight * b;
        }
        [red / weights, green / weights, blue / weights]
    }

    /// Whether the pixels have samples of their own.
    #[inline(always)]
    fn are_known<U: Unit>(&self, first: usize, cells: &Cells) -> M8<U> {
        let mut known = M8::splat(0);
        for &offset in &cells.own {
            let [object, _] = self.marks.load(first.wrapping_add_signed(offset));
            known = known.either(object.equals(M8::splat(EMPTY)).not());
        }
        known
    }
}

/// ε: so that a sample at the very centre does not weigh everything.
#[inline(always)]
fn least_error(s: f32) -> f32 {
    1e-4 * s + 2e-6
}
