//! A band of rows of the picture, eight pixels at a time.

use std::ops::Range;

use super::near::{Model, Near, Seen};
use super::rows::{Columns, EIGHTS, Rows, TILES};
use super::{Calm, Look, Shown};
use crate::Size;
use crate::reconstruction::reproject::store::{CENTRAL_PX, EMPTY, TICK_SECS, Tick};
use crate::reconstruction::reproject::touched::TILE;
use crate::wide::{self, F8, M8, Unit};

/// Below this expected error a sample is taken as it is.
const EXACT: f32 = 2e-5;

/// A band of rows, of a picture with `N` × `N` = `SUBS` cells per pixel.
pub(super) struct Blocks<'a, F, const N: usize, const SUBS: usize> {
    pub(super) look: Look<'a, F>,
    pub(super) means: bool,
    pub(super) first_row: u32,
    /// Of the band's pixels, eights and tiles, as all below.
    pub(super) shown: Shown<'a>,
    pub(super) central: &'a mut [u8],
    pub(super) calm: &'a mut [Calm],
    pub(super) holes: Holes<'a>,
    /// Scratch memory.
    pub(super) columns: &'a mut Vec<Columns>,
}

/// Per tile, bit by bit for its pixels: who waits to be traced, see [`Waiting::tiles`](super::Waiting::tiles).
pub(super) struct Holes<'a> {
    pub(super) unknown: &'a mut [u64],
    pub(super) off_centre: &'a mut [u64],
    /// Holes that are not beside samples.
    pub(super) far: &'a mut [u64],
}

/// What is to be done in a row of tiles, some of them side by side.
struct TileRow {
    /// Of the picture's columns of tiles.
    columns: Range<u32>,
    /// Of the tiles: those that have to be gathered again.
    todo: [bool; TILES],
    /// Of eights of cells: those that are needed for that.
    wanted: [bool; EIGHTS],
    /// The same of the row of tiles before, if its last rows are still there.
    before: [bool; EIGHTS],
}

/// Eight pixels in a row of one tile.
struct Eight<U: Unit> {
    x: u32,
    y: u32,
    model: Model<U>,
}

impl<F: Fn(u32) -> bool, const N: usize, const SUBS: usize> wide::Task for Blocks<'_, F, N, SUBS> {
    #[inline(always)]
    fn run<U: Unit>(mut self) {
        let Size { width, height } = self.look.store.layout.size;
        let last = (self.first_row + self.shown.rgb.len() as u32 / width).min(height);
        let mut columns = std::mem::take(self.columns);
        let mut rows = Rows::new(&mut columns);
        let all = width.div_ceil(TILE);
        for first in (0..all).step_by(TILES) {
            let mut row = TileRow::new(first..all.min(first + TILES as u32));
            for y in (self.first_row..last).step_by(TILE as usize) {
                if row.find(&self, y / TILE) {
                    self.tile_row::<U>(&mut rows, &row, y, last.min(y + TILE));
                }
            }
        }
        *self.columns = columns;
    }
}

impl TileRow {
    fn new(columns: Range<u32>) -> TileRow {
        let nothing = [false; EIGHTS];
        TileRow { columns, todo: [false; TILES], wanted: nothing, before: nothing }
    }

    /// Whether anything is to be done in row `row` of tiles.
    fn find<F, const N: usize, const SUBS: usize>(
        &mut self,
        blocks: &Blocks<'_, F, N, SUBS>,
        row: u32,
    ) -> bool {
        self.before = std::mem::replace(&mut self.wanted, [false; EIGHTS]);
        let mut any = false;
        for (nth, column) in self.columns.clone().enumerate() {
            let is_todo = !blocks.stays(row, column);
            self.todo[nth] = is_todo;
            self.wanted[nth] |= is_todo;
            self.wanted[nth + 1] = is_todo;
            any |= is_todo;
        }
        any
    }

    /// Whether all that is wanted of the two rows above has been read.
    fn is_there(&self) -> bool {
        self.wanted.iter().zip(&self.before).all(|(wanted, before)| *before || !wanted)
    }
}

impl<F, const N: usize, const SUBS: usize> Blocks<'_, F, N, SUBS> {
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

impl<F: Fn(u32) -> bool, const N: usize, const SUBS: usize> Blocks<'_, F, N, SUBS> {
    /// Rows `y` to `last` of a row of tiles.
    #[inline(always)]
    fn tile_row<U: Unit>(&mut self, rows: &mut Rows<'_, SUBS>, row: &TileRow, y: u32, last: u32) {
        let Look { store, rates, contrast, .. } = self.look;
        let now = Tick::of(self.look.now);
        let first_column = (row.columns.start * TILE) as i32;
        let tile_rows = (y - self.first_row) / TILE;
        let in_band = (tile_rows * rates.grid.columns + row.columns.start) as usize;
        if !row.is_there() {
            rows.read::<U>(store, now, [first_column, y as i32 - 1], &row.wanted);
            rows.read::<U>(store, now, [first_column, y as i32], &row.wanted);
        }
        for y in y..last {
            rows.read::<U>(store, now, [first_column, y as i32 + 1], &row.wanted);
            let around = rows.around(y as i32);
            for (nth, column) in row.columns.clone().enumerate().filter(|&(nth, _)| row.todo[nth]) {
                let tile = (y / TILE * rates.grid.columns + column) as usize;
                let model = Model::new(rates.of_tile(tile), contrast[tile]);
                let eight = Eight::<U> { x: column * TILE, y, model };
                let oldest = self.block(&Near::new(around, nth), &eight);
                let calm = &mut self.calm[in_band + nth];
                let before = if y % TILE == 0 { oldest } else { *calm };
                *calm = before.zip(oldest).map(|(a, b)| if a.is_later_than(b) { b } else { a });
            }
        }
    }

    #[inline(always)]
    fn block<U: Unit>(&mut self, near: &Near<'_, N, SUBS>, eight: &Eight<U>) -> Calm {
        let size = self.look.store.layout.size;
        let mut seen = near.own(&eight.model, self.look.carried);
        let empty = M8::splat(EMPTY);
        let lanes = 8.min((size.width - eight.x) as usize);
        let inside = M8::first_lanes(lanes);
        let holes = seen.object.equals(empty).and(inside);
        let object = seen.object;
        let [mut far, mut by_ray] = [M8::splat(0); 2];
        if holes.any() {
            let around = near.around_holes(self.look.before);
            seen.object = around.object.or(holes, seen.object);
            far = around.object.equals(empty).and(holes);
            by_ray = around.by_ray.and(holes);
            seen.rgb = F8::all_or(near.last(), by_ray, seen.rgb);
            self.holes.unknown[self.tile_in_band(eight)] |= eight.in_tile(holes.bits());
        }
        let good = seen.error.less_than(F8::splat(EXACT));
        let exact = if self.means { good } else { holes.not() }.either(by_ray);
        if !exact.either(seen.object.equals(empty)).all() {
            let mean = near.mean(&eight.model, seen.object, holes);
            seen.rgb = F8::all_or(seen.rgb, exact, mean);
        }
        self.show(eight, &seen, far, holes, lanes);
        if !seen.traced.either(inside.not()).all() {
            self.note_off_centre(eight, object.equals(empty).not().and(seen.traced.not()));
            return None;
        }
        let is_calm = N == 1 && good.either(inside.not()).all();
        is_calm.then(|| oldest(Tick::of(self.look.now), seen.tick, lanes))
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
        let tile = self.tile_in_band(eight);
        self.holes.far[tile] |= eight.in_tile(far.bits());
        let (marks, first) = (&mut self.shown.marks[tile].0, (eight.y % TILE * TILE) as usize);
        // Holes have been traced when they were traced last.
        let of_holes = M8::load(marks, first).either(M8::splat(1));
        of_holes.or(holes, seen.tick.plus(seen.tick)).store(marks, first);
    }

    /// The pixels whose object rests wait to be traced.
    #[inline(always)]
    fn note_off_centre<U: Unit>(&mut self, eight: &Eight<U>, pixels: M8<U>) {
        let Look { store, rests: Some(rests), .. } = &self.look else { return };
        let mut off_centre = 0;
        // Cells beyond the border are empty.
        pixels.for_each(|lane| {
            let newest = store.newest(eight.x + lane as u32, eight.y);
            if newest.is_some_and(|cell| rests(store.object[cell])) {
                off_centre |= 1 << lane;
            }
        });
        self.holes.off_centre[self.tile_in_band(eight)] |= eight.in_tile(off_centre);
    }

    fn tile_in_band<U: Unit>(&self, eight: &Eight<U>) -> usize {
        let columns = self.look.rates.grid.columns;
        ((eight.y - self.first_row) / TILE * columns + eight.x / TILE) as usize
    }
}

impl<U: Unit> Eight<U> {
    /// From bits of the pixels to bits of their tile's.
    #[inline(always)]
    fn in_tile(&self, pixels: u32) -> u64 {
        u64::from(pixels) << (self.y % TILE * TILE)
    }
}

/// The earliest of the first `lanes` ticks.
#[inline(always)]
fn oldest<U: Unit>(now: Tick, ticks: M8<U>, lanes: usize) -> Tick {
    let ages = M8::splat(now.0).minus(ticks).lanes();
    Tick(now.0.wrapping_sub(ages[..lanes].iter().copied().max().unwrap_or(0)))
}

/// The first of `values`, as many as there is room for: mostly all.
#[inline(always)]
fn put<T: Copy>(room: &mut [T], values: &[T; 8]) {
    match room.first_chunk_mut() {
        Some(all) => *all = *values,
        None => room.copy_from_slice(&values[..room.len()]),
    }
}
