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

use crate::bayer;
use crate::spare::{give_back, give_back_but};
use crate::tile::TileGrid;

/// Why a pixel is to be traced.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Hole {
    /// It has no sample.
    Unknown,
    /// Its samples are not at its centre, and nothing moves that could have carried them there.
    OffCentre,
}

/// So few of a rank in the picture that a refresh with few samples reaches all parts of it: 192 in 512×384.
const BITS: u32 = 5;
const RANKS: usize = 1 << (2 * BITS);

/// So much of the picture's mean contrast may be in any tile without having been seen. With 0.1 the error after a cut is 5 % higher, with
/// 0.01 hardly lower.
const UNSEEN: f32 = 0.03;
/// Classes of g, a factor of two each; in the first is what is infinite, in the last what is least.
const CLASSES: usize = 32;
/// log₂ of the g in the second: where a single pixel of a tile is known, g is 512 s.
const LARGEST: i32 = 10;

/// Pixels that wait to be traced.
pub(super) struct Waiting {
    /// Of each kind.
    found: [Vec<u32>; 2],
    doubted: Vec<u32>,
    /// Bayer's order of 32×32 pixels, row by row.
    rank: [u16; RANKS],
    /// Scratch memory: pixels' classes, and per tile how much is known.
    classes: Vec<u8>,
    known: Vec<u32>,
}

impl Default for Waiting {
    fn default() -> Waiting {
        let side = 1 << BITS;
        let rank = |i| bayer::rank(i as u32 % side, i as u32 / side, BITS) as u16;
        Waiting {
            found: Default::default(),
            doubted: Vec::new(),
            rank: std::array::from_fn(rank),
            classes: Vec::new(),
            known: Vec::new(),
        }
    }
}

impl Waiting {
    pub(super) fn clear(&mut self) {
        self.found.iter_mut().for_each(Vec::clear);
        self.doubted.clear();
    }

    /// How many have no sample.
    pub(super) fn unknown(&self) -> usize {
        self.found[Hole::Unknown as usize].len()
    }

    /// A pixel that has a sample is to be traced as if it had none, and nothing else that is known of its tile counts.
    pub(super) fn doubt(&mut self, pixel: u32) {
        self.doubted.push(pixel);
        self.push(Hole::Unknown, &[pixel]);
    }

    /// Pixels behind all of the kind that have been found so far.
    #[inline(always)]
    pub(super) fn push(&mut self, hole: Hole, pixels: &[u32]) {
        self.found[hole as usize].extend_from_slice(pixels);
    }

    /// What others found after these, who keep none.
    pub(super) fn append(&mut self, later: &mut Waiting) {
        for (found, later) in self.found.iter_mut().zip(&mut later.found) {
            match found.is_empty() {
                true => std::mem::swap(found, later),
                false => found.append(later),
            }
            give_back(found);
            give_back_but(later, found.len());
        }
    }

    /// The most urgent first; none of them waits here any more. `contrast`: of the tiles of `grid`.
    pub(super) fn order(&mut self, grid: &TileGrid, contrast: &[f32], ordered: &mut Vec<u32>) {
        ordered.clear();
        self.by_rank(Hole::Unknown, grid.size.width, ordered);
        self.classify(grid, contrast, ordered);
        let mut next = [0; CLASSES];
        self.classes.iter().for_each(|&class| next[usize::from(class)] += 1);
        add_up(&mut next);
        // There is room for them where they were found.
        let by_class = &mut self.found[Hole::Unknown as usize];
        for (&pixel, &class) in ordered.iter().zip(&self.classes) {
            let next = &mut next[usize::from(class)];
            by_class[*next] = pixel;
            *next += 1;
        }
        ordered.copy_from_slice(by_class);
        self.classes = Vec::new();
        self.by_rank(Hole::OffCentre, grid.size.width, ordered);
        give_back(ordered);
        self.clear();
    }

    /// The classes of pixels that are traced one after the other.
    fn classify(&mut self, grid: &TileGrid, contrast: &[f32], pixels: &[u32]) {
        self.classes.clear();
        if pixels.is_empty() {
            return;
        }
        self.count_known(grid);
        let mean = contrast.iter().sum::<f32>() / contrast.len() as f32;
        for &pixel in pixels {
            let tile = grid.tile_of(pixel);
            let known = &mut self.known[tile];
            let d2 = 64.0 / *known as f32;
            *known += 1;
            self.classes.push(class_of((contrast[tile] + UNSEEN * mean) * d2 * d2.sqrt()));
        }
    }

    fn count_known(&mut self, grid: &TileGrid) {
        let Waiting { found: [unknown, _], doubted, known, .. } = self;
        known.clear();
        known.extend((0..grid.len()).map(|tile| grid.rect(tile).pixels()));
        unknown.iter().for_each(|&pixel| known[grid.tile_of(pixel)] -= 1);
        doubted.iter().for_each(|&pixel| known[grid.tile_of(pixel)] = 0);
    }

    /// Behind `ordered` those of a kind, by their place in Bayer's order and then as they were found (counting sort).
    fn by_rank(&self, kind: Hole, width: u32, ordered: &mut Vec<u32>) {
        let (found, first) = (&self.found[kind as usize], ordered.len());
        ordered.resize(first + found.len(), 0);
        let of_kind = &mut ordered[first..];
        let mut next = [0; RANKS];
        self.with_ranks(width, found, |rank, _| next[rank] += 1);
        add_up(&mut next);
        self.with_ranks(width, found, |rank, pixel| {
            of_kind[next[rank]] = pixel;
            next[rank] += 1;
        });
    }

    #[inline(always)]
    fn with_ranks(&self, width: u32, pixels: &[u32], mut act: impl FnMut(usize, u32)) {
        let mask = (1 << BITS) - 1;
        // Most are found row by row: where the row of the last one begins, and the row.
        let (mut row_start, mut row) = (0, 0);
        for &pixel in pixels {
            if pixel.wrapping_sub(row_start) >= width {
                row = pixel / width;
                row_start = row * width;
            }
            let place = ((row & mask) << BITS) | ((pixel - row_start) & mask);
            act(self.rank[place as usize] as usize % RANKS, pixel);
        }
    }
}

/// From how many there are of each to where each begins.
fn add_up(counts: &mut [usize]) {
    let mut before = 0;
    for count in counts {
        before += std::mem::replace(count, before);
    }
}

/// Of a g: 0 if it is infinite.
fn class_of(g: f32) -> u8 {
    // The exponent of a positive number.
    let log2 = (g.to_bits() >> 23) as i32 - 127;
    (LARGEST + 1 - log2).clamp(0, CLASSES as i32 - 1) as u8
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Size;

    const SIZE: Size = Size { width: 71, height: 48 };

    /// The order of holes of some kinds.
    fn ordered(
        size: Size,
        kind: impl Fn(u32) -> Option<Hole>,
        contrast: impl Fn(usize) -> f32,
    ) -> Vec<u32> {
        let (grid, mut waiting) = (TileGrid::new(size, 8), Waiting::default());
        for pixel in 0..size.pixels() as u32 {
            kind(pixel).into_iter().for_each(|kind| waiting.push(kind, &[pixel]));
        }
        let contrast: Vec<f32> = (0..grid.len()).map(contrast).collect();
        let mut ordered = vec![7; 10_000];
        waiting.order(&grid, &contrast, &mut ordered);
        ordered
    }

    #[test]
    fn each_waits_once_and_samples_off_their_centres_come_last_evenly_spread() {
        let kind =
            |pixel: u32| if pixel.is_multiple_of(3) { Hole::OffCentre } else { Hole::Unknown };
        let ordered = ordered(SIZE, |pixel| Some(kind(pixel)), |_| 0.01);
        let (unknown, off_centre) = ordered.split_at(SIZE.pixels() * 2 / 3);
        assert!(unknown.iter().all(|&pixel| kind(pixel) == Hole::Unknown));
        let rank = |pixel: u32| bayer::rank(pixel % 71 % 32, pixel / 71 % 32, BITS);
        assert!(off_centre.windows(2).all(|pair| rank(pair[0]) <= rank(pair[1])));
        let mut all = ordered.clone();
        all.sort_unstable();
        assert_eq!(all, (0..SIZE.pixels() as u32).collect::<Vec<_>>());
    }

    #[test]
    fn first_one_of_every_tile_then_more_where_contrast_is_greater() {
        let contrast = |tile: usize| if tile == 20 { 1.0 } else { 0.1 };
        let ordered = ordered(SIZE, |_| Some(Hole::Unknown), contrast);
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
        waiting.push(Hole::Unknown, &[0, 8]);
        (12..16).for_each(|pixel| waiting.doubt(pixel));
        let mut ordered = Vec::new();
        waiting.order(&grid, &[0.1, 0.01], &mut ordered);
        assert_eq!((ordered.len(), ordered[5]), (6, 0), "{ordered:?}");
    }

    #[test]
    fn however_few_are_traced_of_a_large_hole_they_lie_all_over_it() {
        let (width, height) = (512u32, 384u32);
        let ordered = ordered(Size::new(width, height), |_| Some(Hole::Unknown), |_| 0.01);
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
