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

const BITS: u32 = 3;
const RANKS: usize = 1 << (2 * BITS);
/// Kinds of holes times places in Bayer's order.
const CLASSES: usize = 3 * RANKS;

/// Pixels that wait to be traced.
pub(super) struct Waiting {
    /// The pixel, and its class.
    found: Vec<(u32, u8)>,
    /// Bayer's order of 8×8 pixels, row by row.
    rank: [u8; RANKS],
}

impl Default for Waiting {
    fn default() -> Waiting {
        let side = 1 << BITS;
        let rank = |i| bayer::rank(i as u32 % side, i as u32 / side, BITS) as u8;
        Waiting { found: Vec::new(), rank: std::array::from_fn(rank) }
    }
}

impl Waiting {
    pub(super) fn clear(&mut self) {
        self.found.clear();
    }

    /// `pixel` is the one at (x, y).
    #[inline(always)]
    pub(super) fn push(&mut self, pixel: u32, x: u32, y: u32, hole: Hole) {
        let mask = (1 << BITS) - 1;
        let rank = self.rank[((y & mask) << BITS | x & mask) as usize];
        self.found.push((pixel, hole as u8 * RANKS as u8 + rank));
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
