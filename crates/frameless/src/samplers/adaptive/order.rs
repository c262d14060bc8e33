//! Which pixel of a tile is next: Bayer's order, but those that are young for their tile are passed over.

use crate::rates::Rates;
use crate::tile::TileGrid;
use crate::{Canvas, Rng, Time, bayer, wide};

/// Pixels looked at before one is taken that is younger than half the mean age of its tile.
const TRIES: u32 = 4;

/// Places in the order, per tile.
pub(crate) struct Order {
    /// Pixels of a tile in their order, relative to its corner; as many as a power of two.
    order: Vec<(u32, u32)>,
    place: Vec<u8>,
    /// Draws places instead of the order, if that is left out.
    random: Option<Rng>,
}

impl Order {
    /// Tiles have sides of 2^`side_bits`, at most 16 pixels; each begins somewhere else.
    pub(crate) fn new(tiles: usize, side_bits: u32, rng: &mut Rng) -> Order {
        let place = (0..tiles).map(|_| rng.next_u32() as u8).collect();
        Order { order: bayer::order(side_bits), place, random: None }
    }

    /// Pixels are drawn at random from now on.
    pub(crate) fn forget(&mut self, rng: Rng) {
        self.random = Some(rng);
    }

    /// Begin to fetch the place of a tile.
    #[inline]
    pub(crate) fn prefetch(&self, tile: usize) {
        wide::prefetch(&self.place, tile);
    }

    /// The next pixel of a tile, but one near it where the border cuts the tile.
    #[inline]
    pub(crate) fn peek(&self, grid: &TileGrid, tile: usize) -> u32 {
        let rect = grid.rect(tile);
        let (dx, dy) = self.order[usize::from(self.place[tile]) & (self.order.len() - 1)];
        grid.size.index((rect.x0 + dx).min(rect.x1 - 1), (rect.y0 + dy).min(rect.y1 - 1))
    }

    /// The next pixel of a tile, whatever it is.
    #[inline]
    pub(crate) fn next(&mut self, grid: &TileGrid, tile: usize) -> u32 {
        let rect = grid.rect(tile);
        let place = &mut self.place[tile];
        loop {
            let (dx, dy) = self.order[usize::from(*place) & (self.order.len() - 1)];
            *place = match &mut self.random {
                Some(rng) => rng.next_u32() as u8,
                None => place.wrapping_add(1),
            };
            let (x, y) = (rect.x0 + dx, rect.y0 + dy);
            if x < rect.x1 && y < rect.y1 {
                return grid.size.index(x, y);
            }
        }
    }

    /// The first, given with its age, or one of those after it: the first that is old enough, else the oldest.
    #[inline]
    pub(crate) fn old_enough(
        &mut self,
        now: Time,
        canvas: &Canvas,
        rates: &Rates,
        (tile, first): (usize, (u32, u64)),
    ) -> u32 {
        let enough_nanos = (0.5e9 * rates.mean_age_secs(tile)) as u64;
        let (mut oldest, mut oldest_nanos) = first;
        for _ in 1..TRIES {
            if oldest_nanos > enough_nanos {
                break;
            }
            let pixel = self.next(&rates.grid, tile);
            let age_nanos = age_nanos(now, canvas, pixel);
            if age_nanos > oldest_nanos {
                (oldest, oldest_nanos) = (pixel, age_nanos);
            }
        }
        oldest
    }
}

/// Those of which nothing is known are the oldest. Looks at both in any case, without a branch to be guessed wrong.
#[inline]
pub(super) fn age_nanos(now: Time, canvas: &Canvas, pixel: u32) -> u64 {
    let unknown = u64::from(!canvas.known()[pixel as usize]);
    now.0.saturating_sub(canvas.time()[pixel as usize].0) | unknown.wrapping_neg()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Size;

    #[test]
    fn every_pixel_of_a_cut_tile_has_its_turn() {
        let grid = TileGrid::new(Size::new(13, 11), 8);
        let mut order = Order::new(grid.len(), 3, &mut Rng::new(1));
        for tile in 0..grid.len() {
            let pixels = grid.rect(tile).pixels() as usize;
            let turns: Vec<u32> = (0..2 * pixels).map(|_| order.next(&grid, tile)).collect();
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
        let mut order = Order::new(1, 3, &mut Rng::new(1));
        let turns: Vec<u32> = (0..64).map(|_| order.next(&grid, 0)).collect();
        let mut canvas = Canvas::from_picture(size, vec![[0.0; 3]; 64]);
        let mut chosen = |canvas: &Canvas| {
            let first = order.next(&grid, 0);
            order.old_enough(now, canvas, &rates, (0, (first, age_nanos(now, canvas, first))))
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
