//! Which pixel of a tile is next: Bayer's order (1973), but those that were traced lately are passed over.
//!
//! ```text
//! next = the first in the order, from the tile's turn on, that was not traced since the turn came into the part before the present one;
//!        the very next if there is none.  The order has four parts of 16 pixels.
//! ```
//!
//! So what fronts and holes have traced waits for between a quarter and half of a round. All that has to be looked up for that are two bits per
//! pixel, beside what else is known of the tile: when each was traced lies in lines of the cache of their own.

use crate::traced::TILE_PIXELS;
use crate::{Rng, bayer};
use std::hint::select_unpredictable;

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

    /// The next pixel of a tile that is not [`Recent`]; the next one where all are, and in tiles that are cut.
    #[inline(always)]
    pub(crate) fn next_but_recent(
        &mut self,
        pixels: u64,
        recent: &mut Recent,
        turn: &mut u8,
    ) -> usize {
        if pixels != u64::MAX || self.random.is_some() {
            return self.next(pixels, turn);
        }
        let others = !(recent.now | recent.before);
        let others = select_unpredictable(others == 0, u64::MAX, others);
        let rank = u32::from(*turn) + others.rotate_right(u32::from(*turn)).trailing_zeros();
        let next = rank + 1;
        // How many parts the turn comes into: what was traced in the one before the present one is recent, unless it jumps over that.
        let parts = next / PART - u32::from(*turn) / PART;
        recent.before = select_unpredictable(parts == 0, recent.before, recent.now);
        recent.before = select_unpredictable(parts < 2, recent.before, 0);
        recent.now = select_unpredictable(parts == 0, recent.now, 0);
        *turn = next as u8;
        self.peek(rank as u8)
    }
}

/// Which pixels of a tile were traced since its turn came to the last part but one of the order, a bit for the rank of each.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Recent {
    now: u64,
    before: u64,
}

/// Pixels of a part of the order.
const PART: u32 = 16;

impl Recent {
    #[inline(always)]
    pub(super) fn traced(&mut self, within: usize) {
        self.now |= 1 << RANKS[within];
    }
}

/// Where in the order each pixel of a tile is.
const RANKS: [u8; TILE_PIXELS] = {
    let mut ranks = [0; TILE_PIXELS];
    let mut within = 0;
    while within < TILE_PIXELS {
        ranks[within] = bayer::rank(within as u32 % 8, within as u32 / 8, 3) as u8;
        within += 1;
    }
    ranks
};

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Size;
    use crate::tile::TileGrid;

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

    /// A tile whose turn is at the beginning of the order.
    #[derive(Default)]
    struct Tile {
        turn: u8,
        recent: Recent,
    }

    impl Tile {
        fn next(&mut self, order: &mut Order) -> usize {
            order.next_but_recent(u64::MAX, &mut self.recent, &mut self.turn)
        }
    }

    #[test]
    fn ranks_are_places_in_the_order() {
        let order = Order::new();
        for (within, &rank) in RANKS.iter().enumerate() {
            assert_eq!(order.peek(rank), within);
        }
    }

    #[test]
    fn who_was_traced_lately_is_passed_over_until_two_parts_later() {
        let mut order = Order::new();
        let turns: Vec<usize> = order.order.iter().map(|&within| within.into()).collect();
        let mut tile = Tile::default();
        [0, 2, 3, 40].into_iter().for_each(|rank| tile.recent.traced(turns[rank]));
        let seen: Vec<usize> = (0..60).map(|_| tile.next(&mut order)).collect();
        let mut others = turns.clone();
        others.retain(|within| ![0, 2, 3].map(|rank| turns[rank]).contains(within));
        assert_eq!(seen[..60], others[..60], "the 41st is looked at again: two parts have passed");
        assert_eq!(tile.next(&mut order), turns[63]);
        assert_eq!(tile.next(&mut order), turns[0]);
    }

    #[test]
    fn a_turn_that_jumps_over_parts_forgets_what_was_traced_before_them() {
        let mut order = Order::new();
        for (jump, is_recent) in [(14, true), (15, true), (30, true), (31, false), (50, false)] {
            let mut tile = Tile::default();
            // All up to there, and one that comes long after.
            (0..jump).chain([60]).for_each(|rank| tile.recent.traced(order.peek(rank)));
            assert_eq!(tile.next(&mut order), order.peek(jump));
            let recent = (tile.recent.now | tile.recent.before) >> 60 & 1 == 1;
            assert_eq!(recent, is_recent, "over {jump}");
        }
    }

    #[test]
    fn where_all_were_traced_lately_the_next_is_taken() {
        let mut order = Order::new();
        let mut tile = Tile::default();
        (0..TILE_PIXELS).for_each(|within| tile.recent.traced(within));
        for rank in 0..4 {
            assert_eq!(tile.next(&mut order), order.peek(rank));
        }
        let mut order = Order::new();
        (0..TILE_PIXELS).for_each(|within| tile.recent.traced(within));
        let [last, next] = [order.peek(63), order.peek(tile.turn)];
        tile.recent.now &= !(1 << 63);
        tile.recent.before = 0;
        assert_eq!(tile.next(&mut order), last, "however far it is");
        assert_ne!(last, next);
    }

    #[test]
    fn cut_tiles_have_nothing_but_their_order() {
        let (mut order, mut turn, mut recent) = (Order::new(), 0, Recent::default());
        let pixels = 0x0f0f;
        (0..TILE_PIXELS).for_each(|within| recent.traced(within));
        for _ in 0..20 {
            assert!(pixels >> order.next_but_recent(pixels, &mut recent, &mut turn) & 1 == 1);
        }
    }
}
