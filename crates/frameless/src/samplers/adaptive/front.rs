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

use super::tiles::{Tile, Tiles};
use super::why::Why;
use crate::tile::TileGrid;
use crate::traced::{Mark, Place, TILE_PIXELS, Traced, half_ticks};
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
    near: Vec<Near>,
    begin_to_wait: Vec<u32>,
}

/// Pixels of a tile that are beside a change.
#[derive(Clone, Copy, Debug, Default)]
struct Near {
    tile: u32,
    /// When the change was found.
    found: Mark,
    /// In at most three rows.
    pixels: u64,
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

/// The neighbours of a pixel of a tile.
#[derive(Clone, Copy)]
struct Beside {
    /// In the tile itself.
    own: u64,
    /// In the tile to the left or right, above or below, and in the one at the corner; those to which [`Beside::step`] leads.
    others: [u64; 3],
    /// To the other tiles: columns, rows.
    step: [i32; 2],
}

const BESIDE: [Beside; TILE_PIXELS] = {
    let mut all = [Beside { own: 0, others: [0; 3], step: [0; 2] }; TILE_PIXELS];
    let mut within = 0;
    while within < TILE_PIXELS {
        let (x, y) = (within as i32 % 8, within as i32 / 8);
        let mut i = 0;
        while i < 9 {
            let (nx, ny) = (x + i % 3 - 1, y + i / 3 - 1);
            let bit = if i == 4 { 0 } else { 1 << (ny.rem_euclid(8) * 8 + nx.rem_euclid(8)) };
            let (dx, dy) = (nx.div_euclid(8), ny.div_euclid(8));
            let beside = &mut all[within];
            if dx != 0 {
                beside.step[0] = dx;
            }
            if dy != 0 {
                beside.step[1] = dy;
            }
            match (dx != 0, dy != 0) {
                (false, false) => beside.own |= bit,
                (true, false) => beside.others[0] |= bit,
                (false, true) => beside.others[1] |= bit,
                (true, true) => beside.others[2] |= bit,
            }
            i += 1;
        }
        within += 1;
    }
    all
};

impl Front {
    pub(crate) fn new() -> Front {
        Front {
            waiting: VecDeque::new(),
            fresh_secs: FRESH_SECS[1],
            adapted: Time::ZERO,
            changed: Vec::new(),
            parts: 0,
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
        let Front { changed, parts, near, begin_to_wait, waiting, .. } = self;
        for changed in changed[..*parts].chunks(MANY) {
            let count = find_near(changed, traced.grid(), near);
            let near = &near[..count];
            begin_to_wait.resize(count.max(begin_to_wait.len()), 0);
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

/// What is beside changes, tile by tile. Returns how many there are.
fn find_near(changed: &[(Place, Mark)], grid: &TileGrid, near: &mut Vec<Near>) -> usize {
    near.resize((4 * changed.len()).max(near.len()), Near::default());
    let mut count = 0;
    for &(place, found) in changed {
        let Beside { own, others: [beside, beyond, corner], step: [dx, dy] } =
            BESIDE[place.within()];
        let (tile, [column, row]) = (place.tile() as u32, grid.column_and_row(place.tile()));
        let across = (dx != 0) & (column.wrapping_add_signed(dx) < grid.columns);
        let down = (dy != 0) & (row.wrapping_add_signed(dy) < grid.rows);
        let (side, other) = (tile.wrapping_add_signed(dx), dy * grid.columns as i32);
        // Written in any case, so that nobody has to guess which there are.
        let four = near[count..].first_chunk_mut::<4>().expect("room for four each");
        let mut next = 0;
        let mut put = |tile: u32, pixels: u64, is_there: bool| {
            four[next % 4] = Near { tile, found, pixels };
            next += usize::from(is_there);
        };
        put(tile, own, true);
        put(side, beside, across);
        put(tile.wrapping_add_signed(other), beyond, down);
        put(side.wrapping_add_signed(other), corner, across & down);
        count += next;
    }
    count
}

/// Finds the tiles that begin to wait.
struct LookAtNear<'a> {
    near: &'a [Near],
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
        let first_row = |pixels: u64| (pixels.trailing_zeros() / 8).min(5) as usize;
        let mut waiting = 0;
        for (i, &Near { tile, found, pixels }) in near.iter().enumerate() {
            if let Some(later) = near.get(i + AHEAD) {
                let (marks, first) =
                    (&traced.tiles()[later.tile as usize].0, first_row(later.pixels));
                wide::prefetch(marks, 8 * first);
                wide::prefetch(marks, 8 * (first + 2));
                tiles.prefetch(later.tile as usize);
            }
            let marks = &traced.tiles()[tile as usize].0;
            // Always three rows, so that nobody has to guess how many.
            let first = first_row(pixels);
            let latest = M8::<U>::splat(found.0.wrapping_sub(fresh as u32));
            let mut young = 0;
            for row in 0..3 {
                let since = latest.minus(M8::load(marks, 8 * (first + row)));
                young |= u64::from(since.signs()) << (8 * row);
            }
            let stale = pixels & !(young << (8 * first));
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
    use crate::Size;

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
