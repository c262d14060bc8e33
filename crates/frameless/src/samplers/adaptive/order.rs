//! Which pixel of a tile is next: Bayer's order, but those that are young for their tile are passed over.

use crate::rates::Rates;
use crate::tile::TileGrid;
use crate::traced::{Mark, Place, TILE_PIXELS, Traced, half_ticks};
use crate::{Rng, bayer};

/// Pixels looked at before one is taken that is younger than half the mean age of its tile.
const TRIES: u32 = 4;

/// Places in the order, per tile.
pub(crate) struct Order {
    /// Pixels of a tile in their order, numbered row by row.
    order: [u8; TILE_PIXELS],
    place: Vec<u8>,
    /// Draws places instead of the order, if that is left out.
    random: Option<Rng>,
}

impl Order {
    /// Tiles are of 8×8 pixels; each begins somewhere else.
    pub(crate) fn new(tiles: usize, rng: &mut Rng) -> Order {
        let place = (0..tiles).map(|_| rng.next_u32() as u8).collect();
        let mut order = [0; TILE_PIXELS];
        for (within, (dx, dy)) in order.iter_mut().zip(bayer::order(3)) {
            *within = (8 * dy + dx) as u8;
        }
        Order { order, place, random: None }
    }

    /// Pixels are drawn at random from now on.
    pub(crate) fn forget(&mut self, rng: Rng) {
        self.random = Some(rng);
    }

    #[inline(always)]
    fn within(&self, tile: usize) -> usize {
        usize::from(self.order[usize::from(self.place[tile]) % TILE_PIXELS])
    }

    /// The next pixel of a tile, but another one near it where the border cuts the tile.
    #[inline]
    pub(crate) fn peek(&self, grid: &TileGrid, tile: usize) -> u32 {
        let last = grid.size.pixels() as u32 - 1;
        grid.pixel(Place(TILE_PIXELS * tile + self.within(tile))).min(last)
    }

    /// The next pixel of a tile, whatever it is.
    #[inline]
    pub(crate) fn next(&mut self, grid: &TileGrid, tile: usize) -> Place {
        loop {
            let within = self.within(tile);
            let place = &mut self.place[tile];
            *place = match &mut self.random {
                Some(rng) => rng.next_u32() as u8,
                None => place.wrapping_add(1),
            };
            if grid.is_whole() || grid.pixels_of(tile) >> within & 1 == 1 {
                return Place(TILE_PIXELS * tile + within);
            }
        }
    }

    /// The first, given with its age, or one of those after it: the first that is old enough, else the oldest. Ages are in half ticks.
    #[inline]
    pub(crate) fn old_enough(
        &mut self,
        now: Mark,
        traced: &Traced,
        enough: i32,
        (first, age): (Place, i32),
    ) -> Place {
        let (mut oldest, mut oldest_age) = (first, age);
        for _ in 1..TRIES {
            if oldest_age > enough {
                break;
            }
            let place = self.next(traced.grid(), first.tile());
            let age = traced.mark(place).age(now);
            if age > oldest_age {
                (oldest, oldest_age) = (place, age);
            }
        }
        oldest
    }
}

/// The age from which on pixels of a tile are old enough, in half ticks: half their mean age.
#[inline]
pub(super) fn enough(rates: &Rates, tile: usize) -> i32 {
    half_ticks(0.5 * rates.mean_age_secs(tile))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Canvas, Size, Time};

    #[test]
    fn every_pixel_of_a_cut_tile_has_its_turn() {
        let grid = TileGrid::new(Size::new(13, 11), 8);
        let mut order = Order::new(grid.len(), &mut Rng::new(1));
        for tile in 0..grid.len() {
            let pixels = grid.rect(tile).pixels() as usize;
            let turns = (0..2 * pixels).map(|_| grid.pixel(order.next(&grid, tile)));
            let turns: Vec<u32> = turns.collect();
            let mut once = turns[..pixels].to_vec();
            once.sort_unstable();
            once.dedup();
            assert_eq!(once.len(), pixels, "tile {tile}");
            assert!(once.iter().all(|&pixel| grid.tile_of(pixel) == tile));
            assert_eq!(turns[..pixels], turns[pixels..], "the same order again");
        }
    }

    #[test]
    fn the_young_are_passed_over_for_a_few_tries() {
        let size = Size::new(8, 8);
        let (grid, now) = (TileGrid::new(size, 8), Time::from_secs(1.0));
        let mut rates = Rates::new(grid.clone());
        for previous in [Time::ZERO; 99] {
            let (pixel, known, change, refinement) = (0, true, 0.0, None);
            let observed = crate::Observation { pixel, now, previous, known, change, refinement };
            rates.observe(0, &observed, 1.0);
        }
        let mut order = Order::new(1, &mut Rng::new(1));
        let turns: Vec<u32> = (0..64).map(|_| grid.pixel(order.next(&grid, 0))).collect();
        let mut canvas = Canvas::from_picture(size, vec![[0.0; 3]; 64]);
        let mut chosen = |canvas: &Canvas| {
            let (first, now) = (order.next(&grid, 0), Mark::at(now));
            let age = canvas.traced().mark(first).age(now);
            let place = order.old_enough(now, canvas.traced(), enough(&rates, 0), (first, age));
            grid.pixel(place)
        };
        canvas.replace(turns[0], Time::from_secs(0.9), [0.0; 3]);
        assert_eq!(chosen(&canvas), turns[1], "the first is younger than half a second");
        for &pixel in &turns[2..6] {
            canvas.replace(pixel, Time::from_secs(0.9), [0.0; 3]);
        }
        canvas.replace(turns[4], Time::from_secs(0.8), [0.0; 3]);
        assert_eq!(chosen(&canvas), turns[4], "the oldest of four young ones");
        assert_eq!(chosen(&canvas), turns[6]);
    }
}
