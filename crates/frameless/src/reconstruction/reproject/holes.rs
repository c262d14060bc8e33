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
/// Kinds of holes times places in Bayer's order.
const CLASSES: usize = 3 * RANKS;

/// Pixels that wait to be traced.
pub(super) struct Waiting {
    /// The pixel, and its class.
    found: Vec<(u32, u16)>,
    /// Bayer's order of 32×32 pixels, row by row.
    rank: [u16; RANKS],
}

impl Default for Waiting {
    fn default() -> Waiting {
        let side = 1 << BITS;
        let rank = |i| bayer::rank(i as u32 % side, i as u32 / side, BITS) as u16;
        Waiting { found: Vec::new(), rank: std::array::from_fn(rank) }
    }
}

impl Waiting {
    pub(super) fn clear(&mut self) {
        self.found.clear();
    }

    /// How many.
    pub(super) fn len(&self) -> usize {
        self.found.len()
    }

    /// `pixel` is the one at (x, y).
    #[inline(always)]
    pub(super) fn push(&mut self, pixel: u32, x: u32, y: u32, hole: Hole) {
        let mask = (1 << BITS) - 1;
        let rank = self.rank[((y & mask) << BITS | x & mask) as usize];
        self.found.push((pixel, hole as u16 * RANKS as u16 + rank));
    }

    /// What others found after these.
    pub(super) fn append(&mut self, later: &mut Waiting) {
        self.found.append(&mut later.found);
    }

    /// The most urgent first; those of one class in the order in which they were found (counting sort).
    pub(super) fn order(&self, ordered: &mut Vec<u32>) {
        let mut next = [0; CLASSES];
        for &(_, class) in &self.found {
            next[class as usize] += 1;
        }
        let mut before = 0;
        for next in &mut next {
            before += std::mem::replace(next, before);
        }
        ordered.resize(self.found.len(), 0);
        for &(pixel, class) in &self.found {
            let next = &mut next[class as usize];
            ordered[*next] = pixel;
            *next += 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn however_few_are_traced_of_a_large_hole_they_lie_all_over_it() {
        let mut waiting = Waiting::default();
        let (width, height) = (512u32, 384u32);
        for (y, x) in (0..height).flat_map(|y| (0..width).map(move |x| (y, x))) {
            waiting.push(y * width + x, x, y, Hole::Large);
        }
        let mut ordered = Vec::new();
        waiting.order(&mut ordered);
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
