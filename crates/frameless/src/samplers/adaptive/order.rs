//! Which pixel of a tile is next: Bayer's order (1973), but those that are young for their tile are passed over.
//!
//! ```text
//! next = the first of four in the order with age > ā / 2, else the oldest of the four
//! ā ← ā + 0.05 (age − ā)                         for every sample of the tile that replaces one of that age
//! ```

use crate::traced::{HALF_TICKS_PER_SEC, Mark, TILE_PIXELS, TileMarks};
use crate::{Rng, bayer};
use std::hint::select_unpredictable;

/// Pixels looked at before one is taken that is younger than half the mean age of its tile.
const TRIES: u32 = 4;

/// See the module. A tile's turn is kept by whoever asks for its pixels.
pub(crate) struct Order {
    /// Pixels of a tile in their order, numbered row by row.
    order: [u8; TILE_PIXELS],
    /// Draws turns instead of the order, if that is left out.
    random: Option<Rng>,
}

impl Order {
    /// Tiles are of 8×8 pixels.
    pub(crate) fn new() -> Order {
        let mut order = [0; TILE_PIXELS];
        for (within, (dx, dy)) in order.iter_mut().zip(bayer::order(3)) {
            *within = (8 * dy + dx) as u8;
        }
        Order { order, random: None }
    }

    /// Where a tile begins: each somewhere else.
    pub(crate) fn begin(rng: &mut Rng) -> u8 {
        rng.next_u32() as u8
    }

    /// Pixels are drawn at random from now on.
    pub(crate) fn forget(&mut self, rng: Rng) {
        self.random = Some(rng);
    }

    /// The place in a tile that is next, whether or not there is a pixel.
    #[inline(always)]
    pub(super) fn peek(&self, turn: u8) -> usize {
        usize::from(self.order[usize::from(turn) % TILE_PIXELS])
    }

    /// The next of the `pixels` of a tile, a bit for each, of which there is at least one.
    #[inline(always)]
    pub(crate) fn next(&mut self, pixels: u64, turn: &mut u8) -> usize {
        if self.random.is_some() {
            return self.next_at_random(pixels, turn);
        }
        loop {
            let within = self.peek(*turn);
            *turn = turn.wrapping_add(1);
            if pixels >> within & 1 == 1 {
                return within;
            }
        }
    }

    /// Apart, so that it is in nobody's way.
    #[cold]
    #[inline(never)]
    fn next_at_random(&mut self, pixels: u64, turn: &mut u8) -> usize {
        loop {
            let within = self.peek(*turn);
            *turn = self.random.as_mut().map_or(0, |rng| rng.next_u32() as u8);
            if pixels >> within & 1 == 1 {
                return within;
            }
        }
    }

    /// The next pixel of a tile that is more than `enough` old, of [`TRIES`]; else the oldest of these. Ages are in half ticks.
    #[inline(always)]
    pub(crate) fn old_enough(
        &mut self,
        now: Mark,
        TileMarks(marks): &TileMarks,
        pixels: u64,
        turn: &mut u8,
        enough: f32,
    ) -> usize {
        let mut oldest = self.next(pixels, turn);
        let mut oldest_age = Mark(marks[oldest]).age(now);
        if oldest_age as f32 > enough {
            return oldest;
        }
        // Three of four times that is all; how many more are looked at nobody can guess, hence all are.
        let mut next_turn = *turn;
        for _ in 1..TRIES {
            let is_enough = oldest_age as f32 > enough;
            let within = self.next(pixels, &mut next_turn);
            *turn = select_unpredictable(is_enough, *turn, next_turn);
            let age = Mark(marks[within]).age(now);
            let is_older = !is_enough & (age > oldest_age);
            oldest = select_unpredictable(is_older, within, oldest);
            oldest_age = select_unpredictable(is_older, age, oldest_age);
        }
        oldest
    }
}

/// The age from which on pixels of a tile are old enough, in half ticks: half their mean age.
#[inline(always)]
pub(super) fn enough(mean_age_secs: f32) -> f32 {
    // Not as a whole number: to be made one it would have to be asked whether it is one.
    0.5 * HALF_TICKS_PER_SEC * mean_age_secs
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tile::TileGrid;
    use crate::{Size, Time};

    #[test]
    fn every_pixel_of_a_cut_tile_has_its_turn() {
        let grid = TileGrid::new(Size::new(13, 11), 8);
        let (mut order, mut rng) = (Order::new(), Rng::new(1));
        for tile in 0..grid.len() {
            let (mut turn, pixels) = (Order::begin(&mut rng), grid.rect(tile).pixels() as usize);
            let turns = (0..2 * pixels).map(|_| order.next(grid.pixels_of(tile), &mut turn));
            let turns: Vec<usize> = turns.collect();
            let mut once = turns[..pixels].to_vec();
            once.sort_unstable();
            once.dedup();
            assert_eq!(once.len(), pixels, "tile {tile}");
            assert!(once.iter().all(|&within| grid.pixels_of(tile) >> within & 1 == 1));
            assert_eq!(turns[..pixels], turns[pixels..], "the same order again");
        }
    }

    #[test]
    fn the_young_are_passed_over_for_a_few_tries() {
        let now = Mark::at(Time::from_secs(1.0));
        let traced_at = |secs: f64| Mark::at(Time::from_secs(secs)).0;
        let (mut order, mut turn) = (Order::new(), 0);
        let turns: Vec<usize> = (0..64).map(|_| order.next(u64::MAX, &mut turn)).collect();
        let mut marks = TileMarks([0; TILE_PIXELS]);
        let mut chosen =
            |marks: &TileMarks| order.old_enough(now, marks, u64::MAX, &mut turn, enough(1.0));
        marks.0[turns[0]] = traced_at(0.9);
        assert_eq!(chosen(&marks), turns[1], "the first is younger than half a second");
        for &within in &turns[2..6] {
            marks.0[within] = traced_at(0.9);
        }
        marks.0[turns[4]] = traced_at(0.8);
        assert_eq!(chosen(&marks), turns[4], "the oldest of four young ones");
        assert_eq!(chosen(&marks), turns[6]);
    }
}
