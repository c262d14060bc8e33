//! How old large holes are taken to be: as the nearest pixel that is none. What they show: [`smooth`](super::smooth).
//!
//! Two passes over the holes hand on the nearest known pixel from neighbour to neighbour, down and to the right, then up and to
//! the left (Danielsson 1980, "Euclidean distance mapping"): not always the very nearest, but at a cost that does not depend on
//! how large a hole is.

use crate::Size;
use crate::tile::TileGrid;
use crate::traced::{Mark, TileMarks};

/// Nothing is known anywhere.
const NOBODY: u32 = u32::MAX;

/// The pixels around one, the nearest first.
pub(super) const AROUND: [[i32; 2]; 8] =
    [[-1, 0], [0, -1], [1, 0], [0, 1], [-1, -1], [1, -1], [1, 1], [-1, 1]];

/// Holes that are not beside samples.
pub(super) struct Far<'a> {
    pub(super) size: Size,
    /// Row by row.
    pub(super) pixels: Vec<u32>,
    /// A bit for each of eight pixels of a row.
    eights: &'a [u8],
    /// Eights in a row.
    columns: usize,
}

impl<'a> Far<'a> {
    pub(super) fn new(size: Size, eights: &'a [u8]) -> Far<'a> {
        let columns = size.width.div_ceil(8) as usize;
        let mut pixels = Vec::new();
        for (y, row) in (0..).zip(eights.chunks(columns)) {
            // Mostly there are none.
            if row.iter().fold(0, |any, eight| any | eight) != 0 {
                let bits = (0..size.width).filter(|&x| row[x as usize / 8] >> (x % 8) & 1 == 1);
                pixels.extend(bits.map(|x| size.index(x, y)));
            }
        }
        Far { size, pixels, eights, columns }
    }

    #[inline]
    pub(super) fn has(&self, x: usize, y: usize) -> bool {
        self.eights[y * self.columns + x / 8] >> (x % 8) & 1 == 1
    }
}

/// `marks`, those of samples where pixels show some, and else of the first pixel [`AROUND`] that does, become those of the nearest known pixel
/// in the holes that are `far`.
pub(super) fn nearest(grid: &TileGrid, far: &Far<'_>, marks: &mut [TileMarks]) {
    // Meanwhile holes hold the number of the pixel instead.
    let mut sources = Sources { grid, far, marks };
    far.pixels.iter().for_each(|&hole| sources.set(hole, NOBODY));
    for &hole in &far.pixels {
        sources.hand_on(hole, [[-1, 0], [-1, -1], [0, -1], [1, -1]]);
    }
    for &hole in far.pixels.iter().rev() {
        sources.hand_on(hole, [[1, 0], [1, 1], [0, 1], [-1, 1]]);
    }
    for &hole in &far.pixels {
        let mark = match sources.get(hole) {
            NOBODY => Mark::default(),
            source => Mark(sources.get(source)),
        };
        sources.set(hole, mark.of_unknown().0);
    }
}

/// See [`nearest`].
struct Sources<'a> {
    grid: &'a TileGrid,
    far: &'a Far<'a>,
    marks: &'a mut [TileMarks],
}

impl Sources<'_> {
    fn get(&self, pixel: u32) -> u32 {
        let place = self.grid.place(pixel);
        self.marks[place.tile()].0[place.within()]
    }

    fn set(&mut self, pixel: u32, to: u32) {
        let place = self.grid.place(pixel);
        self.marks[place.tile()].0[place.within()] = to;
    }

    /// The nearest known pixel, as far as that has been handed on; of a hole beside samples the first that has some.
    fn of(&self, x: u32, y: u32) -> u32 {
        let size = self.far.size;
        let pixel = size.index(x, y);
        if self.far.has(x as usize, y as usize) {
            return self.get(pixel);
        }
        let mut around = AROUND.iter().filter_map(|&[dx, dy]| beside(size, x, y, dx, dy));
        let has_samples = |pixel: u32| Mark(self.get(pixel)).is_known();
        let mut known = |&(x, y): &(u32, u32)| {
            !self.far.has(x as usize, y as usize) && has_samples(size.index(x, y))
        };
        match has_samples(pixel) {
            true => pixel,
            false => around.find(&mut known).map_or(NOBODY, |(x, y)| size.index(x, y)),
        }
    }

    fn hand_on(&mut self, hole: u32, neighbours: [[i32; 2]; 4]) {
        let size = self.far.size;
        let (x, y) = size.xy(hole);
        let distance2 = |source: u32| {
            let (sx, sy) = size.xy(source);
            let (dx, dy) = (i64::from(sx) - i64::from(x), i64::from(sy) - i64::from(y));
            if source == NOBODY { i64::MAX } else { dx * dx + dy * dy }
        };
        let own = self.get(hole);
        let mut nearest = (distance2(own), own);
        for [dx, dy] in neighbours {
            if let Some((x, y)) = beside(size, x, y, dx, dy) {
                let known = self.of(x, y);
                if known != NOBODY && distance2(known) < nearest.0 {
                    nearest = (distance2(known), known);
                }
            }
        }
        self.set(hole, nearest.1);
    }
}

fn beside(size: Size, x: u32, y: u32, dx: i32, dy: i32) -> Option<(u32, u32)> {
    let (x, y) = (x.checked_add_signed(dx)?, y.checked_add_signed(dy)?);
    (x < size.width && y < size.height).then_some((x, y))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The pixels whose marks the others have after [`nearest`]: ticks are pixels' numbers.
    fn sources(size: Size, known: &[u32]) -> Vec<Option<u32>> {
        let grid = TileGrid::new(size, 8);
        let mut marks = vec![TileMarks([0; 64]); grid.len()];
        let mut eights = vec![0; (size.width.div_ceil(8) * size.height) as usize];
        for pixel in 0..size.pixels() as u32 {
            let (place, (x, y)) = (grid.place(pixel), size.xy(pixel));
            let around = AROUND.iter().filter_map(|&[dx, dy]| beside(size, x, y, dx, dy));
            let first = around.map(|(x, y)| size.index(x, y)).find(|pixel| known.contains(pixel));
            let mark = match first {
                _ if known.contains(&pixel) => Mark::of_tick(pixel),
                Some(first) => Mark::of_tick(first).of_unknown(),
                None => {
                    eights[(y * size.width.div_ceil(8) + x / 8) as usize] |= 1 << (x % 8);
                    Mark::default()
                }
            };
            marks[place.tile()].0[place.within()] = mark.0;
        }
        nearest(&grid, &Far::new(size, &eights), &mut marks);
        let source = |pixel: u32| {
            let place = grid.place(pixel);
            let mark = Mark(marks[place.tile()].0[place.within()]);
            assert_eq!(mark.is_known(), known.contains(&pixel));
            (!known.is_empty()).then_some(mark.0 >> 1)
        };
        (0..size.pixels() as u32).map(source).collect()
    }

    #[test]
    fn every_hole_finds_a_known_pixel_about_as_near_as_the_nearest() {
        let size = Size::new(40, 30);
        let mut rng = crate::Rng::new(1);
        let known: Vec<u32> = (0..30).map(|_| rng.below(size.pixels() as u32)).collect();
        let distance = |a: u32, b: u32| {
            let ((ax, ay), (bx, by)) = (size.xy(a), size.xy(b));
            f64::from(ax.abs_diff(bx)).hypot(f64::from(ay.abs_diff(by)))
        };
        for (pixel, found) in (0..).zip(sources(size, &known)) {
            let found = found.expect("some are known");
            assert!(known.contains(&found), "{pixel}: {found}");
            let least = known.iter().map(|&k| distance(pixel, k)).fold(f64::MAX, f64::min);
            assert!(distance(pixel, found) <= 1.5 * least + 1.0, "{pixel}");
        }
    }

    #[test]
    fn where_nothing_is_known_nobody_is_found() {
        assert_eq!(sources(Size::new(3, 2), &[]), [None; 6]);
    }
}
