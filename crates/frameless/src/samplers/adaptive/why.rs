//! Why each pixel was asked for last, four pixels to a byte: of a large picture even that is more than the nearer caches hold.

use crate::{Size, wide};

/// Who wanted it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Why {
    Tile = 0,
    Front = 1,
    Hole = 2,
    Late = 3,
}

/// One of every pixel.
pub(super) struct Reasons(Vec<u8>);

impl Reasons {
    /// All for their tiles.
    pub(super) fn new(size: Size) -> Reasons {
        Reasons(vec![0; size.pixels().div_ceil(4)])
    }

    #[inline]
    pub(super) fn of(&self, pixel: u32) -> Why {
        match self.0[pixel as usize / 4] >> (pixel % 4 * 2) & 3 {
            0 => Why::Tile,
            1 => Why::Front,
            2 => Why::Hole,
            _ => Why::Late,
        }
    }

    #[inline]
    pub(super) fn set(&mut self, pixel: u32, why: Why) {
        let (four, shift) = (&mut self.0[pixel as usize / 4], pixel % 4 * 2);
        *four = *four & !(3 << shift) | (why as u8) << shift;
    }

    /// Begin to fetch that of a pixel.
    #[inline]
    pub(super) fn prefetch(&self, pixel: u32) {
        wide::prefetch(&self.0, pixel as usize / 4);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neighbours_keep_their_own() {
        let mut reasons = Reasons::new(Size::new(5, 1));
        let all = [Why::Hole, Why::Front, Why::Tile, Why::Hole, Why::Front];
        for turn in 0..3 {
            let why = |pixel: u32| all[(pixel as usize + turn) % 5];
            (0..5).for_each(|pixel| reasons.set(pixel, why(pixel)));
            assert!((0..5).all(|pixel| reasons.of(pixel) == why(pixel)), "turn {turn}");
        }
    }
}
