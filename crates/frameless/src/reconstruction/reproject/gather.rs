//! The picture from the carried samples.
//!
//! ```text
//! e_j = v · age_j + s · dist_j²         expected squared error of sample j at a pixel's centre
//! w_j = 1 / (e_j + ε)²                  over the samples of the reference's object
//! ```
//!
//! The reference is the pixel's own sample with the least expected error. Pixels without one are holes: beside samples they show
//! the mean of those around that belong to one object, farther away something smooth between what is known
//! ([`smooth`](super::smooth)), as old as the nearest pixel that is no hole ([`fill`](super::fill)).
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

use std::ops::Range;

use super::fill::{self, AROUND, Far};
use super::holes::{Hole, Waiting};
use super::smooth::Smooth;
use super::store::{self, CENTRAL_PX, EMPTY, Layout, Store, TICK_SECS, Tick};
use super::touched::TILE;
use crate::bands;
use crate::rates::Rates;
use crate::traced::TileMarks;
use crate::wide::{self, Around, F8, M8, Offsets, Planes, Unit};
use crate::{Size, Time};

/// Gathers pictures.
pub(super) struct Gather {
    /// Whether pixels show means; else each its own best sample as it is.
    means: bool,
    /// Pixels to be traced.
    pub(super) waiting: Waiting,
    /// Bit by bit for eight pixels of a row: which have a sample at their centre.
    central: Vec<u8>,
    /// The same: holes that are not beside samples.
    far: Vec<u8>,
    smooth: Smooth,
    /// Of each tile.
    calm: Vec<Calm>,
    /// Of each band of rows.
    found: Vec<Found>,
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

/// What was found in a band of rows.
#[derive(Default)]
struct Found {
    waiting: Waiting,
    /// Scratch memory.
    rows: Rows,
    row: TileRow,
    unknown: Line,
}

/// Pixels of a row, with room for eight more than there can be.
#[derive(Default)]
struct Line {
    pixels: Vec<u32>,
    len: usize,
}

impl Line {
    fn begin(&mut self, width: u32) {
        self.pixels.resize(width as usize + 16, 0);
        self.len = 0;
    }

    /// Those of eight whose bit is set.
    #[inline(always)]
    fn push<U: Unit>(&mut self, pixels: M8<U>, lanes: u32) {
        if let Some(room) = self.pixels[self.len..].first_chunk_mut() {
            *room = pixels.packed(lanes);
        }
        self.len += lanes.count_ones() as usize;
    }

    fn take(&mut self) -> &[u32] {
        &self.pixels[..std::mem::take(&mut self.len)]
    }
}

/// What lies farther than all around a hole by more than this ratio is behind them.
const BEHIND: f32 = 0.07;

/// Below this expected error a sample is taken as it is.
const EXACT: f32 = 2e-5;

impl Gather {
    pub(super) fn new(means: bool) -> Gather {
        Gather {
            means,
            waiting: Waiting::default(),
            central: Vec::new(),
            far: Vec::new(),
            smooth: Smooth::default(),
            calm: Vec::new(),
            found: Vec::new(),
        }
    }

    /// [`Look::store`] is as if untouched afterwards.
    pub(super) fn run<F>(&mut self, look: Look<'_, F>, shown: Shown<'_>)
    where
        F: Fn(u32) -> bool + Copy + Send + Sync,
    {
        let (size, threads) = (look.store.layout.size, look.threads);
        let prior = mean_of(shown.rgb);
        self.waiting.clear();
        let columns = size.width.div_ceil(TILE) as usize;
        for eights in [&mut self.central, &mut self.far] {
            eights.resize(columns * size.height as usize, 0);
        }
        self.calm.resize(columns * size.height.div_ceil(TILE) as usize, None);
        let cells = &[0, 1, 2].map(|turn| Cells::new(&look.store.layout, turn));
        let rows = bands::rows(size.height, threads);
        let band = rows as usize * size.width as usize;
        self.found.resize_with(size.height.div_ceil(rows) as usize, Found::default);
        let (means, tiles) = (self.means, columns * rows.div_ceil(TILE) as usize);
        let bands = shown
            .rgb
            .chunks_mut(band)
            .zip(shown.marks.chunks_mut(tiles))
            .zip(self.far.chunks_mut(columns * rows as usize))
            .zip(self.central.chunks_mut(columns * rows as usize))
            .zip(self.calm.chunks_mut(tiles))
            .zip(&mut self.found);
        let bands = (0u32..).step_by(rows as usize).zip(bands).map(|(first_row, band)| {
            let (((((rgb, marks), far), central), calm), found) = band;
            let shown = Shown { rgb, marks };
            Blocks { look, cells, means, first_row, shown, far, central, calm, found }
        });
        bands::run(threads, bands.collect(), wide::run);
        for found in &mut self.found {
            self.waiting.append(&mut found.waiting);
        }
        let far = Far::new(size, &self.far);
        // What is shown where next to nothing is known.
        if far.pixels.len() < size.pixels() {
            self.smooth.run(&far, prior, shown.rgb);
        }
        fill::nearest(&look.rates.grid, &far, shown.marks);
    }

    /// Row by row, bit by bit for eight pixels at a time: which have a sample at their centre.
    pub(super) fn central(&self) -> &[u8] {
        &self.central
    }
}

/// Rows of cells, as columns of numbers: of those of one row of pixels, and of the rows above and below it.
///
/// Column and row from the pixel's centre, the bits of the object's number, the bits of the tick, red, green, blue, depth.
#[derive(Default)]
struct Rows([Vec<f32>; PLANES]);

const PLANES: usize = 8;

/// So many rows of pixels are there at a time, turn by turn.
const ROWS: usize = 3;

impl Rows {
    fn fit(&mut self, layout: &Layout) {
        let len = ROWS * layout.subs() * layout.stride;
        self.0.iter_mut().for_each(|plane| plane.resize(len, 0.0));
    }

    /// Reads the row of pixels `y`, instead of the one that was there three rows before. −1 and the height are the border. `wanted`: of
    /// eights of cells.
    #[inline(always)]
    fn read<U: Unit>(&mut self, store: &Store, y: i32, wanted: &[bool]) {
        let Layout { stride, plane, .. } = store.layout;
        let turn = (y + 1) as usize % ROWS;
        for sub in 0..store.layout.subs() {
            let from = store.layout.row(y) + sub * plane;
            let to = (turn * store.layout.subs() + sub) * stride;
            let (objects, _) = store.object[from..from + stride].as_chunks::<8>();
            let (records, _) = store.record[from..from + stride].as_chunks::<8>();
            let eights = objects.iter().zip(records).zip(wanted).zip((to..).step_by(8));
            for (((objects, records), _), at) in eights.filter(|((_, wanted), _)| **wanted) {
                let [depth, place, tick, r, g, b] = F8::<U>::six_columns(store::rows_of(records));
                let [x, y] = store::offsets(place);
                let object = M8::load(objects, 0).as_f32();
                let columns = [x, y, object, tick, r, g, b, store::depths(depth)];
                for (column, plane) in columns.iter().zip(&mut self.0) {
                    column.store(plane, at);
                }
            }
        }
    }
}

/// Cells around the first cell of a pixel, in [`Rows`].
struct Cells {
    /// Where the cells of the row begin.
    row: usize,
    own: Offsets,
    /// Those of the 3×3 pixels around.
    around: Offsets,
    /// Of each of these.
    beside: Vec<Beside>,
    /// Cells of the pixels [`AROUND`], one pixel after the other.
    pixels: Offsets,
}

/// A cell beside another.
struct Beside {
    /// From the one's pixel to the other's.
    step: [f32; 2],
    /// Whether it is at most one cell away: all bits, or none.
    is_near: u32,
    /// With one cell per pixel: its place in [`AROUND`], beyond which the pixel itself is.
    nth: u32,
}

impl Beside {
    /// Squared distance from the pixel's centre to a sample that is so far from its own pixel's.
    #[inline(always)]
    fn distance2<U: Unit>(&self, x: F8<U>, y: F8<U>) -> F8<U> {
        let [step_x, step_y] = self.step;
        let (dx, dy) = (x + F8::splat(step_x), y + F8::splat(step_y));
        dx * dx + dy * dy
    }
}

impl Cells {
    /// `turn`: that of the pixel's row.
    fn new(layout: &Layout, turn: usize) -> Cells {
        let n = layout.per_side as i32;
        let row = |turn: usize| turn % ROWS * layout.subs() * layout.stride;
        let to = |dx: i32, dy: i32| {
            let [(x, sub_x), (y, sub_y)] = [dx, dy].map(|d| (d.div_euclid(n), d.rem_euclid(n)));
            let below = turn + (y + ROWS as i32) as usize;
            let cell = row(below) + (sub_y * n + sub_x) as usize * layout.stride;
            cell as isize + x as isize - row(turn) as isize
        };
        let square = |columns: Range<i32>, rows: Range<i32>| {
            rows.flat_map(move |dy| columns.clone().map(move |dx| (dx, dy)))
        };
        let offsets = |cells: &[(i32, i32)]| Offsets::new(cells.iter().map(|c| to(c.0, c.1)));
        let pixel = |[dx, dy]: [i32; 2]| {
            let [columns, rows] = [dx, dy].map(|d| n * d..n * (d + 1));
            square(columns, rows).collect::<Vec<_>>()
        };
        let around: Vec<(i32, i32)> = square(-n..2 * n, -n..2 * n).collect();
        let is_near = |d: i32| -1 <= d && d <= n;
        let beside = |&(dx, dy): &(i32, i32)| {
            let step = [dx, dy].map(|d| d.div_euclid(n));
            let nth = AROUND.iter().position(|&to| to == step);
            Beside {
                step: step.map(|d| d as f32),
                is_near: u32::from(is_near(dx) && is_near(dy)).wrapping_neg(),
                nth: nth.unwrap_or(AROUND.len()) as u32,
            }
        };
        Cells {
            row: row(turn),
            own: offsets(&pixel([0, 0])),
            beside: around.iter().map(beside).collect(),
            around: offsets(&around),
            pixels: offsets(&AROUND.map(pixel).concat()),
        }
    }
}

/// The expected error of samples.
#[derive(Clone, Copy)]
struct Model<U: Unit> {
    now: M8<U>,
    /// The tile's learned rate of change, and its contrast.
    v: F8<U>,
    s: F8<U>,
    /// ε: so that a sample at the very centre does not weigh everything.
    floor: F8<U>,
}

impl<U: Unit> Model<U> {
    #[inline(always)]
    fn new(now: Tick, v: f32, s: f32) -> Self {
        let floor = F8::splat(1e-4 * s + 2e-6);
        Model { now: M8::splat(now.0), v: F8::splat(v), s: F8::splat(s), floor }
    }

    #[inline(always)]
    fn error(&self, distance2: F8<U>, tick: M8<U>) -> F8<U> {
        let age_secs = self.now.minus(tick).to_f32() * F8::splat(TICK_SECS);
        self.v * age_secs + self.s * distance2
    }
}

/// Rows that are looked at.
#[derive(Clone, Copy)]
struct Near<'a> {
    /// As in [`Rows`].
    samples: Planes<'a, f32, PLANES>,
    cells: &'a Cells,
}

/// A band of rows, eight pixels at a time.
struct Blocks<'a, F> {
    look: Look<'a, F>,
    /// By the turn of a row.
    cells: &'a [Cells; ROWS],
    means: bool,
    first_row: u32,
    /// Of the band's pixels, eights and tiles, as all below.
    shown: Shown<'a>,
    far: &'a mut [u8],
    central: &'a mut [u8],
    calm: &'a mut [Calm],
    found: &'a mut Found,
}

/// What is to be done in a row of tiles.
#[derive(Default)]
struct TileRow {
    /// Of the tiles: those that have to be gathered again.
    todo: Vec<bool>,
    /// Of eights of cells: those that are needed for that.
    wanted: Vec<bool>,
    /// The same of the row of tiles before, if its last rows are still there.
    before: Vec<bool>,
}

/// Eight pixels in a row of one tile.
struct Eight<U: Unit> {
    x: u32,
    y: u32,
    /// The first cell of the first one, in [`Rows`].
    first: usize,
    model: Model<U>,
}

/// What is around eight pixels that have no samples.
struct AroundHoles<U: Unit> {
    /// The object that is probably there; [`EMPTY`] where there is none around.
    object: M8<U>,
    /// Where the last ray tells more.
    by_ray: M8<U>,
    /// Whether any pixel beside it has samples.
    any: M8<U>,
    /// When the newest sample of the first of them in the order of [`AROUND`] was traced.
    tick: M8<U>,
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
    /// Whether there is a sample at the pixel's centre, and one that was traced there.
    central: M8<U>,
    traced: M8<U>,
}

impl<F: Fn(u32) -> bool> wide::Task for Blocks<'_, F> {
    #[inline(always)]
    fn run<U: Unit>(mut self) {
        let Size { width, height } = self.look.store.layout.size;
        let last = self.first_row + self.shown.rgb.len() as u32 / width;
        let mut near = std::mem::take(&mut self.found.rows);
        let mut row = std::mem::take(&mut self.found.row);
        near.fit(&self.look.store.layout);
        row.begin(width.div_ceil(TILE) as usize);
        self.found.unknown.begin(width);
        for y in (self.first_row..last.min(height)).step_by(TILE as usize) {
            if row.find(&self, y / TILE) {
                self.tile_row::<U>(&mut near, &row, y, last.min(y + TILE));
            }
        }
        (self.found.rows, self.found.row) = (near, row);
    }
}

impl TileRow {
    fn begin(&mut self, tiles: usize) {
        self.todo.resize(tiles, false);
        for eights in [&mut self.wanted, &mut self.before] {
            eights.clear();
            eights.resize(tiles + 1, false);
        }
    }

    /// Whether anything is to be done in row `row` of tiles.
    fn find<F>(&mut self, blocks: &Blocks<'_, F>, row: u32) -> bool {
        std::mem::swap(&mut self.wanted, &mut self.before);
        self.wanted.fill(false);
        let (columns, mut any) = (self.todo.len(), false);
        for column in 0..columns {
            let is_todo = !blocks.stays(row, column as u32);
            self.todo[column] = is_todo;
            self.wanted[column] |= is_todo;
            self.wanted[column + 1] = is_todo;
            any |= is_todo;
        }
        any
    }

    /// Whether all that is wanted of the two rows above has been read.
    fn is_there(&self) -> bool {
        self.wanted.iter().zip(&self.before).all(|(wanted, before)| *before || !wanted)
    }
}

impl<F> Blocks<'_, F> {
    /// Whether a tile goes on showing what it shows.
    fn stays(&self, row: u32, column: u32) -> bool {
        let Look { store, now, rates, contrast, .. } = self.look;
        let tile = (row * rates.grid.columns + column) as usize;
        let first_tile = (self.first_row / TILE * rates.grid.columns) as usize;
        let Some(oldest) = self.calm[tile - first_tile] else { return false };
        // No error is larger than this: it is rounded like this one.
        let age_secs = Tick::of(now).0.wrapping_sub(oldest.0) as i32 as f32 * TICK_SECS;
        let most = rates.of_tile(tile) * age_secs + contrast[tile] * (CENTRAL_PX * CENTRAL_PX);
        most < EXACT && !store.touched.is_near(row, column)
    }
}

impl<F: Fn(u32) -> bool> Blocks<'_, F> {
    /// Rows `y` to `last` of a row of tiles.
    #[inline(always)]
    fn tile_row<U: Unit>(&mut self, near: &mut Rows, row: &TileRow, y: u32, last: u32) {
        let Look { store, now, rates, contrast, .. } = self.look;
        let first_tile = (y / TILE * rates.grid.columns) as usize;
        let in_band = ((y - self.first_row) / TILE * rates.grid.columns) as usize;
        if !row.is_there() {
            near.read::<U>(store, y as i32 - 1, &row.wanted);
            near.read::<U>(store, y as i32, &row.wanted);
        }
        for y in y..last {
            near.read::<U>(store, y as i32 + 1, &row.wanted);
            let samples = Planes::new(near.0.each_ref().map(Vec::as_slice));
            let near = Near { samples, cells: &self.cells[(y + 1) as usize % ROWS] };
            for column in (0..row.todo.len()).filter(|&column| row.todo[column]) {
                let (x, tile) = (column as u32 * TILE, first_tile + column);
                let eight = Eight::<U> {
                    x,
                    y,
                    first: near.cells.row + x as usize + 1,
                    model: Model::new(Tick::of(now), rates.of_tile(tile), contrast[tile]),
                };
                let oldest = self.block(&near, &eight);
                let calm = &mut self.calm[in_band + column];
                let before = if y % TILE == 0 { oldest } else { *calm };
                *calm = before.zip(oldest).map(|(a, b)| if a.is_later_than(b) { b } else { a });
            }
            let Found { waiting, unknown, .. } = &mut *self.found;
            waiting.push(Hole::Unknown, unknown.take());
        }
    }

    #[inline(always)]
    fn block<U: Unit>(&mut self, near: &Near<'_>, eight: &Eight<U>) -> Calm {
        let Layout { size, per_side, .. } = self.look.store.layout;
        let mut seen = near.own(eight, self.look.carried);
        let empty = M8::splat(EMPTY);
        let lanes = 8.min((size.width - eight.x) as usize);
        let inside = M8::first_lanes(lanes);
        let holes = seen.object.equals(empty).and(inside);
        let object = seen.object;
        let [mut far, mut by_ray] = [M8::splat(0); 2];
        if holes.any() {
            let around = near.around_holes(eight, self.look.before);
            seen.object = around.object.or(holes, seen.object);
            seen.tick = around.tick.or(holes, seen.tick);
            far = around.any.not().and(holes);
            by_ray = around.by_ray.and(holes);
            seen.rgb = F8::all_or(near.last(eight), by_ray, seen.rgb);
            self.note_holes(eight, holes);
        }
        let good = seen.error.less_than(F8::splat(EXACT));
        let exact = if self.means { good } else { holes.not() }.either(by_ray);
        if !exact.either(seen.object.equals(empty)).all() {
            let mean = near.mean(eight, seen.object, holes);
            seen.rgb = F8::all_or(seen.rgb, exact, mean);
        }
        self.show(eight, &seen, far, holes, lanes);
        if !seen.traced.either(inside.not()).all() {
            self.note_off_centre(eight, object.equals(empty).not().and(seen.traced.not()));
            return None;
        }
        let is_calm = per_side == 1 && good.either(inside.not()).all();
        is_calm.then(|| eight.oldest(seen.tick, lanes))
    }

    #[inline(always)]
    fn show<U: Unit>(
        &mut self,
        eight: &Eight<U>,
        seen: &Seen<U>,
        far: M8<U>,
        holes: M8<U>,
        lanes: usize,
    ) {
        let size = self.look.store.layout.size;
        let in_band = size.index(eight.x, eight.y) - self.first_row * size.width;
        let pixels = in_band as usize..in_band as usize + lanes;
        let (mut rgb, room) = (F8::triples(seen.rgb), &mut self.shown.rgb[pixels]);
        // What nothing is known of goes on showing what it has shown, until the larger holes are filled.
        far.for_each(|lane| rgb[lane] = room[lane]);
        put(room, &rgb);
        let columns = size.width.div_ceil(TILE);
        let eights = (eight.y - self.first_row) * columns + eight.x / TILE;
        self.central[eights as usize] = seen.central.bits() as u8;
        self.far[eights as usize] = far.bits() as u8;
        // A mask is −1 where it is set.
        let marks = seen.tick.plus(seen.tick).minus(holes);
        let tile = (eight.y - self.first_row) / TILE * columns + eight.x / TILE;
        marks.store(&mut self.shown.marks[tile as usize].0, (eight.y % TILE * TILE) as usize);
    }

    /// Holes wait to be traced.
    #[inline(always)]
    fn note_holes<U: Unit>(&mut self, eight: &Eight<U>, holes: M8<U>) {
        let first = self.look.store.layout.size.index(eight.x, eight.y);
        let pixels = M8::<U>::new([0, 1, 2, 3, 4, 5, 6, 7]).plus(M8::splat(first));
        self.found.unknown.push(pixels, holes.bits());
    }

    /// Those of the pixels whose object rests.
    #[inline(always)]
    fn note_off_centre<U: Unit>(&mut self, eight: &Eight<U>, pixels: M8<U>) {
        let Look { store, rests: Some(rests), .. } = &self.look else { return };
        // Cells beyond the border are empty.
        pixels.for_each(|lane| {
            let (x, y) = (eight.x + lane as u32, eight.y);
            if store.newest(x, y).is_some_and(|cell| rests(store.object[cell])) {
                self.found.waiting.push(Hole::OffCentre, &[store.layout.size.index(x, y)]);
            }
        });
    }
}

impl<U: Unit> Seen<U> {
    /// Samples as in [`Rows`].
    #[inline(always)]
    fn new(samples: [F8<U>; PLANES], eight: &Eight<U>, carried: Tick) -> Self {
        let [x, y, object, tick, r, g, b, _] = samples;
        let (object, tick) = (object.to_bits(), tick.to_bits());
        let (none, empty) = (M8::splat(0), M8::splat(EMPTY));
        let distance2 = x * x + y * y;
        let is_sample = object.equals(empty).not();
        let central = distance2.less_than(F8::splat(CENTRAL_PX * CENTRAL_PX)).and(is_sample);
        let is_later = none.less_than(tick.minus(M8::splat(carried.0)));
        let error = eight.model.error(distance2, tick);
        Seen {
            rgb: F8::all_or([r, g, b], is_sample, [F8::splat(0.0); 3]),
            object,
            error: error.or(is_sample, F8::splat(f32::MAX)),
            tick: tick.and(is_sample),
            central,
            traced: central.and(is_later),
        }
    }

    /// With others of the same pixels.
    #[inline(always)]
    fn join(&mut self, other: &Self) {
        let (none, empty) = (M8::splat(0), M8::splat(EMPTY));
        let is_first = self.object.equals(empty);
        let is_newer = none.less_than(other.tick.minus(self.tick)).either(is_first);
        self.tick = other.tick.or(is_newer.and(other.object.equals(empty).not()), self.tick);
        let better = other.error.less_than(self.error);
        self.error = other.error.or(better, self.error);
        self.object = other.object.or(better, self.object);
        self.rgb = F8::all_or(other.rgb, better, self.rgb);
        self.central = self.central.either(other.central);
        self.traced = self.traced.either(other.traced);
    }
}

impl<U: Unit> Eight<U> {
    /// The earliest of the first `lanes` ticks.
    #[inline(always)]
    fn oldest(&self, ticks: M8<U>, lanes: usize) -> Tick {
        let now = self.model.now.lanes()[0];
        let ages = self.model.now.minus(ticks).lanes();
        Tick(now.wrapping_sub(ages[..lanes].iter().copied().max().unwrap_or(0)))
    }
}

impl Near<'_> {
    /// The pixels' own samples with the least expected error.
    #[inline(always)]
    fn own<U: Unit>(&self, eight: &Eight<U>, carried: Tick) -> Seen<U> {
        let own = self.samples.around(eight.first, &self.cells.own);
        let mut seen = Seen::new(own.load(0), eight, carried);
        for k in 1..own.len() {
            seen.join(&Seen::new(own.load(k), eight, carried));
        }
        seen
    }

    /// What is around the pixels, those that have no samples. `before`: the last refresh.
    #[inline(always)]
    fn around_holes<U: Unit>(&self, eight: &Eight<U>, before: Tick) -> AroundHoles<U> {
        if self.cells.own.len() > 1 {
            return AroundHoles { object: self.nearest(eight), ..self.beside(eight) };
        }
        let (none, empty) = (M8::splat(0), M8::splat(EMPTY));
        let (mut tick, mut first) = (none, M8::splat(AROUND.len() as u32));
        let (mut least, mut most) = (F8::splat(f32::INFINITY), F8::splat(-1.0));
        let (mut farthest, mut enclosing, mut depth_of_that) = (empty, empty, least);
        let around = self.samples.around(eight.first, &self.cells.around);
        for (k, beside) in self.cells.beside.iter().enumerate() {
            // Nothing is in the pixels themselves.
            if beside.nth == AROUND.len() as u32 {
                continue;
            }
            let [_, _, object, when, .., depth] = around.load(k);
            let object = object.to_bits();
            let is_sample = object.equals(empty).not();
            let is_farther = most.less_than(depth).and(is_sample);
            most = depth.or(is_farther, most);
            farthest = object.or(is_farther, farthest);
            let is_nearer = depth.less_than(least).and(is_sample);
            least = depth.or(is_nearer, least);
            let opposite = self.cells.beside.len() - 1 - k;
            if k < opposite {
                let [_, _, other, ..] = around.load(opposite);
                let on_both_sides = other.to_bits().equals(object).and(is_sample);
                let is_nearer = depth.less_than(depth_of_that).either(enclosing.equals(empty));
                depth_of_that = depth.or(on_both_sides.and(is_nearer), depth_of_that);
                enclosing = object.or(on_both_sides.and(is_nearer), enclosing);
            }
            let nth = M8::splat(beside.nth);
            let is_first = nth.less_than(first).and(is_sample);
            first = nth.or(is_first, first);
            tick = when.to_bits().or(is_first, tick);
        }
        let is_open = enclosing.equals(empty);
        let own = self.samples.around(eight.first, &self.cells.own);
        let [_, _, _, last, .., depth] = own.load(0);
        let is_new = none.less_than(last.to_bits().minus(M8::splat(before.0)));
        let is_behind = least.less_than(depth * F8::splat(1.0 - BEHIND));
        AroundHoles {
            object: farthest.or(is_open, enclosing),
            by_ray: is_open.and(is_new).and(is_behind),
            any: first.less_than(M8::splat(AROUND.len() as u32)),
            tick,
        }
    }

    /// The colours of the samples that were in the pixels last.
    #[inline(always)]
    fn last<U: Unit>(&self, eight: &Eight<U>) -> [F8<U>; 3] {
        let [.., r, g, b, _] = self.samples.around(eight.first, &self.cells.own).load(0);
        [r, g, b]
    }

    /// The objects of the samples nearest to the centres of holes; [`EMPTY`] where there is none around.
    #[inline(always)]
    fn nearest<U: Unit>(&self, eight: &Eight<U>) -> M8<U> {
        let mut least = F8::splat(f32::INFINITY);
        let mut nearest = M8::splat(EMPTY);
        let around = self.samples.around(eight.first, &self.cells.around);
        for (k, beside) in self.cells.beside.iter().enumerate() {
            let [x, y, object, ..] = around.load(k);
            let object = object.to_bits();
            let is_sample = object.equals(M8::splat(EMPTY)).not();
            let distance2 = beside.distance2(x, y);
            let nearer = distance2.less_than(least).and(is_sample);
            least = distance2.or(nearer, least);
            nearest = object.or(nearer, nearest);
        }
        nearest
    }

    /// Over the objects' samples: those in the pixel's cells and one further around, for holes in the 3×3 pixels around.
    #[inline(always)]
    fn mean<U: Unit>(&self, eight: &Eight<U>, object: M8<U>, holes: M8<U>) -> [F8<U>; 3] {
        let zero = F8::splat(0.0);
        let (mut red, mut green, mut blue, mut weights) = (zero, zero, zero, zero);
        let around = self.samples.around(eight.first, &self.cells.around);
        for (k, beside) in self.cells.beside.iter().enumerate() {
            let [x, y, other, tick, r, g, b, _] = around.load(k);
            let (other, tick) = (other.to_bits(), tick.to_bits());
            let counts = other.equals(object).and(holes.either(M8::splat(beside.is_near)));
            let distance2 = beside.distance2(x, y);
            let error = eight.model.error(distance2, tick) + eight.model.floor;
            let weight = (F8::splat(1.0) / (error * error)).or(counts, zero);
            weights = weights + weight;
            red = red + weight * r;
            green = green + weight * g;
            blue = blue + weight * b;
        }
        [red / weights, green / weights, blue / weights]
    }

    /// What is known beside the pixels, but for the object.
    #[inline(always)]
    fn beside<U: Unit>(&self, eight: &Eight<U>) -> AroundHoles<U> {
        let (none, object) = (M8::splat(0), M8::splat(EMPTY));
        let mut beside = AroundHoles { object, by_ray: none, any: none, tick: none };
        let cells = self.samples.around(eight.first, &self.cells.pixels);
        let subs = cells.len() / AROUND.len();
        for nth in 0..AROUND.len() {
            let (is_known, newest) = newest(&cells, nth * subs..(nth + 1) * subs);
            let is_first = beside.any.equals(none).and(is_known);
            beside.tick = beside.tick.either(is_first.and(newest));
            beside.any = beside.any.either(is_known);
        }
        beside
    }
}

/// Whether there are samples in some cells of eight pixels, and when the newest were traced.
#[inline(always)]
fn newest<U: Unit>(cells: &Around<'_, f32, PLANES>, some: Range<usize>) -> (M8<U>, M8<U>) {
    let none = M8::splat(0);
    let (mut is_known, mut newest) = (none, none);
    for k in some {
        let [_, _, object, tick, ..] = cells.load(k);
        let (object, tick) = (object.to_bits(), tick.to_bits());
        let is_sample = object.equals(M8::splat(EMPTY)).not();
        let is_newer = none.less_than(tick.minus(newest));
        newest = tick.or(is_sample.and(is_known.not().either(is_newer)), newest);
        is_known = is_known.either(is_sample);
    }
    (is_known, newest)
}

/// Of every so manieth pixel: in what is shown far from everything that is known, details do not count.
fn mean_of(shown: &[[f32; 3]]) -> [f32; 3] {
    let few = shown.iter().step_by(31);
    let count = few.len() as f32;
    few.fold([0.0; 3], |sum, c| std::array::from_fn(|k| sum[k] + c[k])).map(|sum| sum / count)
}

/// The first of `values`, as many as there is room for: mostly all.
#[inline(always)]
fn put<T: Copy>(room: &mut [T], values: &[T; 8]) {
    match room.first_chunk_mut() {
        Some(all) => *all = *values,
        None => room.copy_from_slice(&values[..room.len()]),
    }
}
