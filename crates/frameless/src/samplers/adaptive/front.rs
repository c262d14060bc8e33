//! Front propagation: where a sample found a change, its neighbours have probably changed too.
//!
//! ```text
//! part of a front:       d / 3 > 0.05²           of a sample at time t that was no late look
//! beside it, a pixel waits if it was traced before t − f, until it is traced
//! f ← f / (1 + 29 Δt)    after a batch that left nobody waiting, else f ← f (1 + 29 Δt);   1 ms ≤ f ≤ 12 ms
//! ```
//!
//! So that what is about to change again is looked at again as soon as there are samples for it, and no sooner. Tiles that have such neighbours
//! wait, first come first served, and hold a bit for each.

use std::collections::VecDeque;
use std::hint::select_unpredictable;

use super::tiles::{Tile, Tiles};
use super::why::Why;
use crate::tile::TileGrid;
use crate::traced::{Mark, Place, Traced, half_ticks};
use crate::wide::{self, M8, Task, Unit};
use crate::{Canvas, Observation, Time};

/// A sample that differs by more than this (mean squared difference per channel) is part of a front: 5 % of the range.
const FRONT_CHANGE: f32 = 0.0025;
/// Neighbours traced later than a time before the front was found are left alone; its bounds.
const FRESH_SECS: [f32; 2] = [1e-3, 12e-3];
/// How fast that adapts: this part of itself per second.
const ADAPT_PER_SEC: f64 = 29.0;
/// The most by which it is multiplied or divided at once, however long a batch takes.
const MOST_AT_ONCE: f64 = 2.0;

/// How many tiles ahead of the one looked at the next is fetched.
const AHEAD: usize = 64;
/// So many changes are looked at together.
const MANY: usize = 1024;
/// So many rows of a tile.
const ROWS: u32 = 4;

/// Pixels beside changes, tile by tile.
pub(crate) struct Front {
    waiting: VecDeque<u32>,
    /// Neighbours younger than this are left alone.
    fresh_secs: f32,
    /// When that was adapted last.
    adapted: Time,
    /// Of the observations at hand, those that are part of a front, and room for the others.
    changed: Vec<(Place, Mark)>,
    parts: usize,
    /// Reused from batch to batch.
    runs: Vec<Pixels>,
    near: Vec<Pixels>,
    begin_to_wait: Vec<u32>,
}

/// Pixels of a tile that are changes, or beside changes: a bit for each.
#[derive(Clone, Copy, Debug, Default)]
struct Pixels {
    tile: u32,
    /// When the change was found, the last one if there are several.
    found: Mark,
    bits: u64,
}

/// A bit per pixel of a tile.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct TileFront {
    /// Those beside changes.
    beside: u64,
    /// Those to be looked at again however young they are.
    suspect: u64,
}

impl TileFront {
    /// A pixel has just been traced.
    #[inline(always)]
    pub(super) fn traced(&mut self, within: usize) {
        self.beside &= !(1 << within);
    }
}

/// Whether what was known there is wrong now.
#[inline]
pub(super) fn is_part(observed: &Observation) -> bool {
    observed.known & (observed.change > 3.0 * FRONT_CHANGE)
}

impl Front {
    pub(crate) fn new() -> Front {
        Front {
            waiting: VecDeque::new(),
            fresh_secs: FRESH_SECS[1],
            adapted: Time::ZERO,
            changed: Vec::new(),
            parts: 0,
            runs: Vec::new(),
            near: Vec::new(),
            begin_to_wait: Vec::new(),
        }
    }

    /// After a batch: where all fronts have been followed and samples are left, younger neighbours are looked at again as well; where
    /// fronts have to wait, only older ones.
    pub(crate) fn adapt(&mut self, now: Time, all_followed: bool) {
        let secs = now.secs_since(std::mem::replace(&mut self.adapted, now));
        let growth = (1.0 + ADAPT_PER_SEC * secs).min(MOST_AT_ONCE) as f32;
        let factor = if all_followed { 1.0 / growth } else { growth };
        self.fresh_secs = (self.fresh_secs * factor).clamp(FRESH_SECS[0], FRESH_SECS[1]);
    }

    /// So many samples will be heard of.
    pub(crate) fn expect(&mut self, samples: usize) {
        self.changed.resize(samples, Default::default());
        self.parts = 0;
    }

    /// A sample that was traced, and may be part of a front. Late looks are not.
    #[inline(always)]
    pub(crate) fn hear(&mut self, observed: &Observation, place: Place, why: Why) {
        // Written in any case, so that nobody has to guess who is.
        self.changed[self.parts] = (place, Mark::at(observed.now));
        self.parts += usize::from(is_part(observed) & (why != Why::Late));
    }

    /// The neighbours of samples that are part of a front wait from now on.
    pub(crate) fn observe(&mut self, tiles: &mut Tiles, canvas: &Canvas) {
        let (traced, fresh) = (canvas.traced(), half_ticks(self.fresh_secs));
        let Front { changed, parts, runs, near, begin_to_wait, waiting, .. } = self;
        for changed in changed[..*parts].chunks(MANY) {
            let runs = find_runs(changed, runs);
            let near = find_near(runs, traced.grid(), near);
            begin_to_wait.resize(near.len().max(begin_to_wait.len()), 0);
            let mut begin = 0;
            wide::run(LookAtNear { near, traced, fresh, tiles, begin_to_wait, count: &mut begin });
            waiting.extend(&begin_to_wait[..begin]);
        }
    }

    #[inline(always)]
    fn wait(&mut self, number: usize, tile: &mut Tile) {
        if !tile.waits {
            tile.waits = true;
            self.waiting.push_back(number as u32);
        }
    }

    /// A pixel that had better be looked at again.
    pub(crate) fn suspect(&mut self, tiles: &mut Tiles, place: Place) {
        let tile = tiles.of_mut(place.tile());
        tile.front.suspect |= 1 << place.within();
        self.wait(place.tile(), tile);
    }

    /// Of how many seconds neighbours are left alone now.
    #[cfg(test)]
    pub(crate) fn fresh_secs(&self) -> f32 {
        self.fresh_secs
    }

    /// Calls `take` with one tile after another and the pixels of it that are to be looked at; it returns those that are taken and those
    /// for which it has no room. Whether nobody has to wait.
    pub(crate) fn follow(
        &mut self,
        tiles: &mut Tiles,
        grid: &TileGrid,
        mut take: impl FnMut(usize, u64) -> [u64; 2],
    ) -> bool {
        while let Some(&tile) = self.waiting.front() {
            if let Some(&later) = self.waiting.get(AHEAD) {
                tiles.prefetch(later as usize);
            }
            let tile = tile as usize;
            let Tile { front, reasons, waits, .. } = tiles.of_mut(tile);
            let pixels = (front.beside | front.suspect) & grid.pixels_of(tile);
            let [taken, left] = if pixels == 0 { [0; 2] } else { take(tile, pixels) };
            reasons.set(taken, Why::Front);
            if left != 0 {
                front.beside &= left;
                front.suspect &= left;
                return false;
            }
            *front = TileFront::default();
            *waits = false;
            self.waiting.pop_front();
        }
        true
    }

    pub(crate) fn clear(&mut self, tiles: &mut Tiles) {
        for tile in self.waiting.drain(..) {
            let Tile { front, waits, .. } = tiles.of_mut(tile as usize);
            (*front, *waits) = (TileFront::default(), false);
        }
    }
}

/// Changes that follow each other in the same tile, together.
fn find_runs<'a>(changed: &[(Place, Mark)], runs: &'a mut Vec<Pixels>) -> &'a [Pixels] {
    runs.resize(changed.len().max(runs.len()), Pixels::default());
    let (mut run, mut count) = (Pixels { tile: u32::MAX, ..Pixels::default() }, 0);
    for &(place, found) in changed {
        let tile = place.tile() as u32;
        // Written in any case, so that nobody has to guess where runs end.
        let goes_on = tile == run.tile;
        count += usize::from(!goes_on);
        let before = select_unpredictable(goes_on, run.bits, 0);
        run = Pixels { tile, found, bits: before | 1 << place.within() };
        runs[count - 1] = run;
    }
    &runs[..count]
}

/// The first and the last column of a tile.
const COLUMNS: [u64; 2] = [0x0101_0101_0101_0101, 0x8080_8080_8080_8080];
/// The pixels of a tile that have neighbours in four.
const CORNERS: u64 = 0x8100_0000_0000_0081;
/// A tile and those around it.
const TILES: usize = 9;

/// What is beside changes, tile by tile.
fn find_near<'a>(runs: &[Pixels], grid: &TileGrid, near: &'a mut Vec<Pixels>) -> &'a [Pixels] {
    near.resize((TILES * runs.len()).max(near.len()), Pixels::default());
    let mut count = 0;
    for &Pixels { tile, found, bits } in runs {
        let [column, row] = grid.column_and_row(tile as usize);
        let [left, right] = [column > 0, column + 1 < grid.columns];
        let [above, below] = [row > 0, row + 1 < grid.rows];
        let near = near[count..].first_chunk_mut::<TILES>().expect("room for all");
        let mut next = 0;
        // Written in any case, so that nobody has to guess which there are. Some may lie beyond the picture, in tiles that are cut: whoever
        // follows them leaves these out.
        let mut put = |[dx, dy]: [i32; 2], is_there: bool, bits: u64| {
            let tile = tile.wrapping_add_signed(dy * grid.columns as i32 + dx);
            near[next % TILES] = Pixels { tile, found, bits };
            next += usize::from(is_there & (bits != 0));
        };
        let tall = bits | bits << 8 | bits >> 8;
        let [first, last] = COLUMNS.map(|column| tall & column);
        let wide = tall | (tall ^ last) << 1 | (tall ^ first) >> 1;
        // They themselves have just been traced.
        put([0, 0], true, wide & !bits);
        put([-1, 0], left, first << 7);
        put([1, 0], right, last >> 7);
        let [top, bottom] = [bits & 0xff, bits >> 56];
        put([0, -1], above, (top | top << 1 | top >> 1) << 56);
        put([0, 1], below, (bottom | bottom << 1 | bottom >> 1) & 0xff);
        if (bits & CORNERS) != 0 {
            put([-1, -1], above & left, (top & 1) << 63);
            put([1, -1], above & right, (top >> 7) << 56);
            put([-1, 1], below & left, (bottom & 1) << 7);
            put([1, 1], below & right, bottom >> 7);
        }
        count += next;
    }
    &near[..count]
}

/// Finds the tiles that begin to wait.
struct LookAtNear<'a> {
    near: &'a [Pixels],
    traced: &'a Traced,
    /// In half ticks.
    fresh: i32,
    tiles: &'a mut Tiles,
    /// As many as there are in `near`.
    begin_to_wait: &'a mut [u32],
    /// How many of them do.
    count: &'a mut usize,
}

impl Task for LookAtNear<'_> {
    /// Those that were traced `fresh` before the change was found, or earlier.
    #[inline(always)]
    fn run<U: Unit>(self) {
        let LookAtNear { near, traced, fresh, tiles, begin_to_wait, count } = self;
        let first_row = |bits: u64| (bits.trailing_zeros() / 8).min(8 - ROWS) as usize;
        let mut waiting = 0;
        for (i, &Pixels { tile, found, bits }) in near.iter().enumerate() {
            if let Some(later) = near.get(i + AHEAD) {
                let (marks, first) =
                    (&traced.tiles()[later.tile as usize].0, first_row(later.bits));
                wide::prefetch(marks, 8 * first);
                wide::prefetch(marks, 8 * (first + 2));
                wide::prefetch(marks, 8 * (first + 3));
                tiles.prefetch(later.tile as usize);
            }
            let marks = &traced.tiles()[tile as usize].0;
            let latest = M8::<U>::splat(found.0.wrapping_sub(fresh as u32));
            let (mut rest, mut stale) = (bits, 0);
            // Four rows at a time, so that nobody has to guess how many: mostly that is all.
            while rest != 0 {
                let (first, mut young) = (first_row(rest), 0);
                for row in 0..ROWS as usize {
                    let since = latest.minus(M8::load(marks, 8 * (first + row)));
                    young |= u64::from(since.signs()) << (8 * row);
                }
                let rows = u64::from(u32::MAX) << (8 * first);
                stale |= rest & rows & !(young << (8 * first));
                rest &= !rows;
            }
            let Tile { front, waits, .. } = tiles.of_mut(tile as usize);
            front.beside |= stale;
            // Neither is it guessed who begins to wait.
            begin_to_wait[waiting] = tile;
            waiting += usize::from((stale != 0) & !*waits);
            *waits |= stale != 0;
        }
        *count = waiting;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Rng, Size};

    fn found(pixel: u32, now: Time, change: f32) -> Observation {
        Observation { pixel, now, previous: Time::ZERO, known: true, change, refinement: None }
    }

    /// Fronts, and the tiles that they are in.
    struct Fronts(Front, Tiles);

    impl Fronts {
        fn new(tiles: usize) -> Fronts {
            Fronts(Front::new(), Tiles::new(tiles))
        }

        fn observe(&mut self, canvas: &Canvas, observed: Observation) {
            let Fronts(front, tiles) = self;
            let place = canvas.traced().place(observed.pixel);
            front.expect(1);
            front.hear(&observed, place, tiles.of(place.tile()).reasons.of(place.within()));
            front.observe(tiles, canvas);
        }

        fn traced(&mut self, place: Place) {
            self.1.of_mut(place.tile()).front.traced(place.within());
        }
    }

    /// All pixels that are to be looked at, in the order of the picture.
    fn followed(Fronts(front, tiles): &mut Fronts, canvas: &Canvas) -> Vec<u32> {
        let mut pixels = Vec::new();
        let take = |tile: usize, bits: u64| {
            let places = (0..64).filter(|i| bits >> i & 1 == 1).map(|i| Place(64 * tile + i));
            pixels.extend(places.map(|place| canvas.traced().grid().pixel(place)));
            [bits, 0]
        };
        assert!(front.follow(tiles, canvas.traced().grid(), take));
        pixels.sort_unstable();
        pixels
    }

    #[test]
    fn the_neighbours_of_a_change_are_next_unless_they_are_fresh() {
        let size = Size::new(4, 3);
        let mut canvas = Canvas::from_picture(size, vec![[0.0; 3]; 12]);
        let mut front = Fronts::new(1);
        let now = Time::from_secs(1.0);
        canvas.replace(1, Time::from_secs(0.995), [0.0; 3]);
        front.observe(&canvas, found(0, now, 0.1));
        assert_eq!(
            followed(&mut front, &canvas),
            [4, 5],
            "1 is 5 ms old, and the corner has no other"
        );
        assert!(is_part(&found(0, now, 0.1)));
        assert!(!is_part(&found(0, now, 0.001)), "too small a change");
        let unknown = Observation { known: false, ..found(0, now, 0.1) };
        assert!(!is_part(&unknown), "its change says nothing");
    }

    #[test]
    fn who_was_traced_since_is_left_out() {
        let size = Size::new(3, 1);
        let canvas = Canvas::from_picture(size, vec![[0.0; 3]; 3]);
        let mut front = Fronts::new(1);
        front.observe(&canvas, found(1, Time::from_secs(1.0), 0.1));
        front.traced(canvas.traced().place(0));
        assert_eq!(followed(&mut front, &canvas), [2]);
    }

    #[test]
    fn every_pixel_has_the_neighbours_that_it_has() {
        let now = Time::from_secs(1.0);
        for size in
            [(4, 3), (19, 17), (8, 16), (1, 9)].map(|(width, height)| Size::new(width, height))
        {
            let canvas = Canvas::from_picture(size, vec![[0.0; 3]; size.pixels()]);
            for pixel in 0..size.pixels() as u32 {
                let mut front = Fronts::new(canvas.traced().grid().len());
                front.observe(&canvas, found(pixel, now, 0.1));
                let near = |other: &u32| {
                    let ((x, y), (u, v)) = (size.xy(pixel), size.xy(*other));
                    *other != pixel && x.abs_diff(u) < 2 && y.abs_diff(v) < 2
                };
                let near: Vec<u32> = (0..size.pixels() as u32).filter(near).collect();
                assert_eq!(followed(&mut front, &canvas), near, "pixel {pixel} of {size:?}");
            }
        }
    }

    #[test]
    fn changes_that_are_heard_of_together_have_the_neighbours_of_all() {
        let (size, now, mut rng) = (Size::new(27, 21), Time::from_secs(1.0), Rng::new(5));
        for count in [2, 3, 5, 9, 40] {
            let mut canvas = Canvas::from_picture(size, vec![[0.0; 3]; size.pixels()]);
            let mut changed: Vec<u32> =
                (0..count).map(|_| rng.below(size.pixels() as u32)).collect();
            // Tile by tile, as fronts are followed: runs, and in the tallest of them all rows.
            changed.sort_by_key(|&pixel| canvas.traced().place(pixel).tile());
            changed.dedup();
            for &pixel in &changed {
                canvas.replace(pixel, now, [0.0; 3]);
            }
            let mut front = Fronts::new(canvas.traced().grid().len());
            front.0.expect(changed.len());
            for &pixel in &changed {
                front.0.hear(&found(pixel, now, 0.1), canvas.traced().place(pixel), Why::Tile);
            }
            front.0.observe(&mut front.1, &canvas);
            let is_near = |pixel: &u32| {
                let (x, y) = size.xy(*pixel);
                let beside = |&change: &u32| {
                    let (u, v) = size.xy(change);
                    x.abs_diff(u) < 2 && y.abs_diff(v) < 2
                };
                changed.iter().any(beside) && !changed.contains(pixel)
            };
            let near: Vec<u32> = (0..size.pixels() as u32).filter(is_near).collect();
            assert_eq!(followed(&mut front, &canvas), near, "of {changed:?}");
        }
    }

    #[test]
    fn late_looks_begin_no_fronts() {
        let canvas = Canvas::from_picture(Size::new(3, 1), vec![[0.0; 3]; 3]);
        let (mut front, grid) = (Fronts::new(1), canvas.traced().grid());
        let observed = found(1, Time::from_secs(1.0), 0.1);
        front.1.set_why(grid.place(1), Why::Late);
        front.observe(&canvas, observed);
        assert!(followed(&mut front, &canvas).is_empty());
    }

    #[test]
    fn where_all_fronts_are_followed_younger_neighbours_are_looked_at_again() {
        let mut canvas = Canvas::from_picture(Size::new(3, 1), vec![[0.0; 3]; 3]);
        let mut front = Fronts::new(1);
        let now = Time::from_secs(1.0);
        (0..3).for_each(|pixel| _ = canvas.replace(pixel, Time::from_secs(0.995), [0.0; 3]));
        let next = |front: &mut Fronts| {
            front.observe(&canvas, found(1, now, 0.1));
            followed(front, &canvas).len()
        };
        assert_eq!(next(&mut front), 0, "5 ms are young at first");
        let millis = |millis: u64| Time(millis * 1_000_000);
        (1..101).for_each(|time| front.0.adapt(millis(time), true));
        assert_eq!(next(&mut front), 2);
        (101..201).for_each(|time| front.0.adapt(millis(time), false));
        assert_eq!(next(&mut front), 0, "and again where fronts have to wait");
    }

    #[test]
    fn who_has_no_room_waits_in_front_and_suspects_are_looked_at_in_any_case() {
        let size = Size::new(16, 8);
        let canvas = Canvas::from_picture(size, vec![[0.0; 3]; size.pixels()]);
        let (mut front, now) = (Fronts::new(2), Time::from_secs(1.0));
        front.observe(&canvas, found(2, now, 0.1));
        front.0.suspect(&mut front.1, canvas.traced().grid().place(2));
        front.observe(&canvas, found(12, now, 0.1));
        // Traced just now: only as a suspect is it looked at.
        front.traced(canvas.traced().place(2));
        let mut seen = Vec::new();
        let Fronts(waiting, tiles) = &mut front;
        let all = waiting.follow(tiles, canvas.traced().grid(), |tile, pixels| {
            seen.push((tile, pixels));
            [pixels & 0b10, pixels & !0b10]
        });
        assert!(!all && seen == [(0, 0b1110_0000_1110)], "{seen:?}");
        front.traced(canvas.traced().place(3));
        assert_eq!(followed(&mut front, &canvas), [2, 11, 13, 17, 18, 19, 27, 28, 29]);
        front.observe(&canvas, found(12, now, 0.1));
        front.0.clear(&mut front.1);
        assert_eq!(followed(&mut front, &canvas), [0u32; 0]);
    }
}
