//! Pixels that wait to be traced, in their order.
//!
//! Adaptive refinement (Bergman et al. 1986; Painter and Sloan 1989): first a pixel of every tile of which nothing is known, then
//! those by which the error of the picture is expected to fall most,
//!
//! ```text
//! g = (s + 0.03 s̄) · d³,  d² = 64/n         s the tile's spatial contrast, s̄ its mean over the picture, n of its 64 pixels known by then
//! ```
//!
//! s is the squared difference of neighbours: of edges of height Δ, Δ² times their length per area. Between samples that are d
//! apart nobody knows where an edge is within d, so that a picture guessed from them has an error of about s · d, and a sample tells of
//! an area of d². What is finer than all samples shows no contrast: hence s̄. Pixels with about the same g (within a factor of
//! two) are spread evenly over the picture; samples off their centre come last.

use std::ops::Range;

use crate::bayer;
use crate::spare::give_back;
use crate::tile::TileGrid;
use crate::traced::TILE_PIXELS;

/// Bayer's order of 32×32 pixels: so few of a rank in the picture that a refresh with few samples reaches all parts of it, 192 in
/// 512×384. Of a pixel's rank the upper bits are its rank in the tile of 8×8, the lower ones that of the tile in 4×4 tiles.
const RANKS: usize = 1 << (TILE_BITS + OF_TILES_BITS);
const TILE_BITS: u32 = 6;
const OF_TILES_BITS: u32 = 4;

/// So much of the picture's mean contrast may be in any tile without having been seen. With 0.1 the error after a cut is 5 % higher, with
/// 0.01 hardly lower.
const UNSEEN: f32 = 0.03;
/// Classes of g, a factor of two each; in the first is what is infinite, in the last what is least.
const CLASSES: usize = 32;
/// log₂ of the g in the second: where a single pixel of a tile is known, g is 512 s.
const LARGEST: i32 = 10;

/// Pixels that wait to be traced.
pub(super) struct Waiting {
    grid: TileGrid,
    /// Of each tile, a bit for every pixel, row by row: those without a sample.
    unknown: Vec<u64>,
    /// The same: those whose samples are not at their centres, although nothing moves that could have carried them there.
    off_centre: Vec<u64>,
    /// Of each tile, whether nothing that is known of it counts.
    doubted: Vec<bool>,
    order: Order,
    /// Scratch memory: per pixel that waits its class and rank, and per class and rank where those that have it begin.
    keys: Vec<u16>,
    next: Vec<u32>,
}

/// Bayer's order, to be looked up.
struct Order {
    /// By a row of a tile and the bits of its pixels: the bits of their ranks.
    ranks: Box<[[u64; 256]; 8]>,
    /// By rank: the pixel's place in its tile, row by row.
    places: [u8; TILE_PIXELS],
    /// Of tiles in 4×4, row by row.
    of_tiles: [usize; 1 << OF_TILES_BITS],
}

impl Default for Order {
    fn default() -> Order {
        let mut order = Order {
            ranks: Box::new([[0; 256]; 8]),
            places: [0; TILE_PIXELS],
            of_tiles: std::array::from_fn(|i| bayer::rank(i as u32 % 4, i as u32 / 4, 2) as usize),
        };
        for place in 0..TILE_PIXELS {
            let (x, y) = (place % 8, place / 8);
            let rank = bayer::rank(x as u32, y as u32, 3);
            order.places[rank as usize] = place as u8;
            let with_it =
                order.ranks[y].iter_mut().enumerate().filter(|(bits, _)| bits >> x & 1 == 1);
            with_it.for_each(|(_, ranks)| *ranks |= 1 << rank);
        }
        order
    }
}

impl Order {
    /// From bits of a tile's pixels, row by row, to bits of their ranks.
    #[inline(always)]
    fn ranks(&self, pixels: u64) -> u64 {
        let rows = pixels.to_le_bytes();
        let ranks = self.ranks.iter().zip(rows).map(|(ranks, row)| ranks[usize::from(row)]);
        ranks.fold(0, |all, ranks| all | ranks)
    }

    /// The ranks in the picture of a tile's pixels, the first of them first.
    #[inline(always)]
    fn for_each(&self, grid: &TileGrid, tile: usize, pixels: u64, mut act: impl FnMut(usize)) {
        let [column, row] = grid.column_and_row(tile);
        let of_tile = self.of_tiles[(row % 4 * 4 + column % 4) as usize];
        let mut ranks = self.ranks(pixels);
        while ranks != 0 {
            act(of_tile | (ranks.trailing_zeros() as usize) << OF_TILES_BITS);
            ranks &= ranks - 1;
        }
    }
}

impl Default for Waiting {
    fn default() -> Waiting {
        Waiting {
            grid: TileGrid::new(crate::Size::new(1, 1), 8),
            unknown: Vec::new(),
            off_centre: Vec::new(),
            doubted: Vec::new(),
            order: Order::default(),
            keys: Vec::new(),
            next: vec![0; (CLASSES + 1) * RANKS],
        }
    }
}

impl Waiting {
    /// Nobody waits. Tiles of 8×8 pixels.
    pub(super) fn begin(&mut self, grid: &TileGrid) {
        if self.grid != *grid {
            self.grid = grid.clone();
        }
        for tiles in [&mut self.unknown, &mut self.off_centre] {
            tiles.clear();
            tiles.resize(grid.len(), 0);
        }
        self.doubted.clear();
        self.doubted.resize(grid.len(), false);
    }

    /// Of each tile, a bit for every pixel, row by row: those without a sample, and those whose samples are not at their centres.
    pub(super) fn tiles(&mut self) -> [&mut [u64]; 2] {
        [&mut self.unknown, &mut self.off_centre]
    }

    /// How many have no sample.
    pub(super) fn unknown(&self) -> usize {
        self.unknown.iter().map(|pixels| pixels.count_ones() as usize).sum()
    }

    /// A pixel that has a sample is to be traced as if it had none, and nothing else that is known of its tile counts.
    pub(super) fn doubt(&mut self, pixel: u32) {
        let place = self.grid.place(pixel);
        self.doubted[place.tile()] = true;
        self.unknown[place.tile()] |= 1 << place.within();
    }

    /// The most urgent first. `contrast`: of the tiles.
    pub(super) fn order(&mut self, contrast: &[f32], ordered: &mut Vec<u32>) {
        ordered.clear();
        let keys = self.find_keys(contrast);
        add_up(&mut self.next[keys.clone()]);
        ordered.resize(self.keys.len(), 0);
        self.by_key(ordered);
        self.next[keys].fill(0);
        self.keys = Vec::new();
        give_back(ordered);
    }

    /// The keys of all who wait, tile by tile in the order of their ranks, and how many have each. Returns which keys there may be.
    fn find_keys(&mut self, contrast: &[f32]) -> Range<usize> {
        let Waiting { grid, unknown, off_centre, doubted, order, keys, next } = self;
        let unseen = UNSEEN * contrast.iter().sum::<f32>() / contrast.len().max(1) as f32;
        let distances = distances();
        let [mut first, mut end] = [usize::MAX, 0];
        let mut push = |class: usize, rank: usize| {
            let key = class * RANKS + rank;
            [first, end] = [first.min(key), end.max(key + 1)];
            keys.push(key as u16);
            next[key] += 1;
        };
        for tile in (0..grid.len()).filter(|&tile| unknown[tile] != 0) {
            // As if they were traced one after the other.
            let pixels =
                if doubted[tile] { u64::MAX } else { !grid.pixels_of(tile) | unknown[tile] };
            let mut farther = distances[pixels.count_zeros() as usize..].iter();
            let s = contrast[tile] + unseen;
            order.for_each(grid, tile, unknown[tile], |rank| {
                let [d2, d] = farther.next().copied().unwrap_or_default();
                push(class_of(s * d2 * d), rank);
            });
        }
        for tile in (0..grid.len()).filter(|&tile| off_centre[tile] != 0) {
            order.for_each(grid, tile, off_centre[tile], |rank| push(CLASSES, rank));
        }
        first.min(end)..end
    }

    /// Counting sort: `ordered` has room for all keys, and in `next` is where those of each begin.
    fn by_key(&mut self, ordered: &mut [u32]) {
        let Waiting { grid, unknown, off_centre, order, keys, next, .. } = self;
        let mut keys = keys.iter();
        for tiles in [unknown, off_centre] {
            for (tile, &pixels) in tiles.iter().enumerate().filter(|(_, pixels)| **pixels != 0) {
                let (corner, mut ranks) = (grid.corner(tile), order.ranks(pixels));
                for &key in keys.by_ref().take(pixels.count_ones() as usize) {
                    let place = order.places[ranks.trailing_zeros() as usize % TILE_PIXELS];
                    ranks &= ranks - 1;
                    let next = &mut next[usize::from(key)];
                    ordered[*next as usize] = corner + grid.step(usize::from(place));
                    *next += 1;
                }
            }
        }
    }
}

/// By how many pixels of a tile are known: d² and d.
fn distances() -> [[f32; 2]; TILE_PIXELS + 1] {
    std::array::from_fn(|known| {
        let d2 = TILE_PIXELS as f32 / known as f32;
        [d2, d2.sqrt()]
    })
}

/// From how many there are of each to where each begins.
fn add_up(counts: &mut [u32]) {
    let mut before = 0;
    for count in counts {
        before += std::mem::replace(count, before);
    }
}

/// Of a g: 0 if it is infinite.
fn class_of(g: f32) -> usize {
    // The exponent of a positive number.
    let log2 = (g.to_bits() >> 23) as i32 - 127;
    (LARGEST + 1 - log2).clamp(0, CLASSES as i32 - 1) as usize
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Size;

    const SIZE: Size = Size { width: 71, height: 48 };

    fn set(tiles: &mut [u64], grid: &TileGrid, pixel: u32) {
        let place = grid.place(pixel);
        tiles[place.tile()] |= 1 << place.within();
    }

    /// The order of all pixels, those without a sample and the others, which are off their centres.
    fn ordered(
        size: Size,
        is_unknown: impl Fn(u32) -> bool,
        contrast: impl Fn(usize) -> f32,
    ) -> Vec<u32> {
        let (grid, mut waiting) = (TileGrid::new(size, 8), Waiting::default());
        waiting.begin(&grid);
        let [unknown, off_centre] = waiting.tiles();
        for pixel in 0..size.pixels() as u32 {
            set(if is_unknown(pixel) { &mut *unknown } else { &mut *off_centre }, &grid, pixel);
        }
        let contrast: Vec<f32> = (0..grid.len()).map(contrast).collect();
        let mut ordered = vec![7; 10_000];
        waiting.order(&contrast, &mut ordered);
        ordered
    }

    #[test]
    fn each_waits_once_and_samples_off_their_centres_come_last_evenly_spread() {
        let is_unknown = |pixel: u32| !pixel.is_multiple_of(3);
        let ordered = ordered(SIZE, is_unknown, |_| 0.01);
        let (unknown, off_centre) = ordered.split_at(SIZE.pixels() * 2 / 3);
        assert!(unknown.iter().all(|&pixel| is_unknown(pixel)));
        let rank = |pixel: u32| bayer::rank(pixel % 71 % 32, pixel / 71 % 32, 5);
        assert!(off_centre.windows(2).all(|pair| rank(pair[0]) <= rank(pair[1])));
        let mut all = ordered.clone();
        all.sort_unstable();
        assert_eq!(all, (0..SIZE.pixels() as u32).collect::<Vec<_>>());
    }

    #[test]
    fn first_one_of_every_tile_then_more_where_contrast_is_greater() {
        let contrast = |tile: usize| if tile == 20 { 1.0 } else { 0.1 };
        let ordered = ordered(SIZE, |_| true, contrast);
        let grid = TileGrid::new(SIZE, 8);
        let tiles: Vec<usize> = ordered.iter().map(|&pixel| grid.tile_of(pixel)).collect();
        let mut first = tiles[..grid.len()].to_vec();
        first.sort_unstable();
        assert_eq!(first, (0..grid.len()).collect::<Vec<_>>());
        // As many as n pixels of another tile are n · 9.7^(2/3) of tile 20, within the factor of two of a class: the third of one comes
        // after between 7 and 11 of the other.
        let third = (0..tiles.len()).filter(|&i| tiles[i] == 0).nth(2).expect("64 pixels");
        let before = tiles[..third].iter().filter(|&&tile| tile == 20).count();
        assert!((7..=11).contains(&before), "{before}");
    }

    #[test]
    fn where_samples_are_doubted_nothing_counts_as_known() {
        // Of both tiles a pixel has no sample; in the right one four are doubted.
        let (grid, mut waiting) = (TileGrid::new(Size::new(16, 8), 8), Waiting::default());
        waiting.begin(&grid);
        [0, 8].into_iter().for_each(|pixel| set(waiting.tiles()[0], &grid, pixel));
        (12..16).for_each(|pixel| waiting.doubt(pixel));
        let mut ordered = Vec::new();
        waiting.order(&[0.1, 0.01], &mut ordered);
        assert_eq!((ordered.len(), ordered[5]), (6, 0), "{ordered:?}");
    }

    #[test]
    fn however_few_are_traced_of_a_large_hole_they_lie_all_over_it() {
        let (width, height) = (512u32, 384u32);
        let ordered = ordered(Size::new(width, height), |_| true, |_| 0.01);
        let blocks = (width / 32 * height / 32) as usize;
        for part in ordered.chunks(blocks) {
            let mut reached = vec![false; blocks];
            part.iter().for_each(|&pixel| {
                reached[(pixel / width / 32 * (width / 32) + pixel % width / 32) as usize] = true;
            });
            assert!(reached.iter().all(|&reached| reached));
        }
    }
}
