//! Why each pixel was asked for last: two bits, those of a tile beside each other.

use crate::traced::Place;
use crate::wide;

/// Who wanted it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Why {
    Tile = 0,
    Front = 1,
    Hole = 2,
    Late = 3,
}

/// One of every pixel: of each tile the lower bits of its 64 pixels, and the upper ones.
pub(super) struct Reasons(Vec<[u64; 2]>);

impl Reasons {
    /// All for their tiles.
    pub(super) fn new(tiles: usize) -> Reasons {
        Reasons(vec![[0; 2]; tiles])
    }

    #[inline]
    pub(super) fn of(&self, place: Place) -> Why {
        let [low, high] = self.0[place.tile()].map(|bits| bits >> place.within() & 1);
        match low | high << 1 {
            0 => Why::Tile,
            1 => Why::Front,
            2 => Why::Hole,
            _ => Why::Late,
        }
    }

    #[inline]
    pub(super) fn set(&mut self, place: Place, why: Why) {
        self.set_all(place.tile(), 1 << place.within(), why);
    }

    /// Of all pixels of a tile whose bits are set.
    #[inline]
    pub(super) fn set_all(&mut self, tile: usize, pixels: u64, why: Why) {
        let (low, high) = ((why as u64 & 1).wrapping_neg(), (why as u64 >> 1).wrapping_neg());
        let [lower, upper] = &mut self.0[tile];
        *lower = *lower & !pixels | low & pixels;
        *upper = *upper & !pixels | high & pixels;
    }

    /// Begin to fetch those of a tile.
    #[inline]
    pub(super) fn prefetch(&self, tile: usize) {
        wide::prefetch(&self.0, tile);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neighbours_keep_their_own() {
        let mut reasons = Reasons::new(2);
        let all = [Why::Hole, Why::Front, Why::Tile, Why::Late, Why::Front];
        for turn in 0..3 {
            let why = |place: usize| all[(place + turn) % 5];
            (0..128).for_each(|place| reasons.set(Place(place), why(place)));
            assert!((0..128).all(|place| reasons.of(Place(place)) == why(place)), "turn {turn}");
        }
        reasons.set_all(1, 0b101, Why::Late);
        let after = [64, 65, 66].map(|place| reasons.of(Place(place)));
        assert_eq!(after, [Why::Late, all[67 % 5], Why::Late]);
    }
}
