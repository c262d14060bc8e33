//! Pixels that wait to be traced, in their order: large holes first, samples off their centre last, evenly spread in every part of the
//! order.

use crate::bayer;

/// Why a pixel is to be traced.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Hole {
    /// It has no sample, and little near it is known.
    Large,
    /// It has no sample, but its neighbours know enough for a good guess.
    Small,
    /// Its samples are not at its centre, and nothing moves that could have carried them there.
    OffCentre,
}

/// So few of a rank in the picture that a refresh with few samples reaches all parts of it: 192 in 512×384.
const BITS: u32 = 5;
const RANKS: usize = 1 << (2 * BITS);

/// Pixels that wait to be traced.
pub(super) struct Waiting {
    /// Of each kind.
    found: [Vec<u32>; 3],
    /// Bayer's order of 32×32 pixels, row by row.
    rank: [u16; RANKS],
}

impl Default for Waiting {
    fn default() -> Waiting {
        let side = 1 << BITS;
        let rank = |i| bayer::rank(i as u32 % side, i as u32 / side, BITS) as u16;
        Waiting { found: Default::default(), rank: std::array::from_fn(rank) }
    }
}

impl Waiting {
    pub(super) fn clear(&mut self) {
        self.found.iter_mut().for_each(Vec::clear);
    }

    /// How many have no sample.
    pub(super) fn unknown(&self) -> usize {
        self.found[Hole::Large as usize].len() + self.found[Hole::Small as usize].len()
    }

    /// Pixels behind all of the kind that have been found so far.
    #[inline(always)]
    pub(super) fn push(&mut self, hole: Hole, pixels: &[u32]) {
        self.found[hole as usize].extend_from_slice(pixels);
    }

    /// What others found after these.
    pub(super) fn append(&mut self, later: &mut Waiting) {
        for (found, later) in self.found.iter_mut().zip(&mut later.found) {
            found.append(later);
        }
    }

    /// The most urgent first, of a picture of that width; those of one kind and place in Bayer's order as they were found (counting sort).
    pub(super) fn order(&self, width: u32, ordered: &mut Vec<u32>) {
        ordered.resize(self.found.iter().map(Vec::len).sum(), 0);
        let mut rest = ordered.as_mut_slice();
        for found in &self.found {
            let (of_kind, others) = rest.split_at_mut(found.len());
            let mut next = [0; RANKS];
            self.with_ranks(width, found, |rank, _| next[rank] += 1);
            let mut before = 0;
            for next in &mut next {
                before += std::mem::replace(next, before);
            }
            self.with_ranks(width, found, |rank, pixel| {
                of_kind[next[rank]] = pixel;
                next[rank] += 1;
            });
            rest = others;
        }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn large_holes_come_first_and_each_kind_is_spread_evenly() {
        let (width, height) = (71, 48);
        let mut waiting = Waiting::default();
        let pixels: Vec<u32> = (0..width * height).collect();
        let kind = |pixel: u32| match pixel % 3 {
            0 => Hole::OffCentre,
            1 => Hole::Small,
            _ => Hole::Large,
        };
        pixels.iter().for_each(|&pixel| waiting.push(kind(pixel), &[pixel]));
        let mut sorted = pixels.clone();
        let place = |pixel: u32| bayer::rank(pixel % width % 32, pixel / width % 32, BITS);
        sorted.sort_by_key(|&pixel| (kind(pixel) as u8, place(pixel)));
        let mut ordered = vec![7; 10_000];
        waiting.order(width, &mut ordered);
        assert_eq!(ordered, sorted);
    }

    #[test]
    fn however_few_are_traced_of_a_large_hole_they_lie_all_over_it() {
        let mut waiting = Waiting::default();
        let (width, height) = (512u32, 384u32);
        waiting.push(Hole::Large, &(0..width * height).collect::<Vec<u32>>());
        let mut ordered = Vec::new();
        waiting.order(width, &mut ordered);
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
