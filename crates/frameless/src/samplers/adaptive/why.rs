//! Why each pixel was asked for last: two bits, those of a tile beside each other.

/// Who wanted it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Why {
    Tile = 0,
    Front = 1,
    Hole = 2,
    Late = 3,
}

/// One of every pixel of a tile: the lower bits of its 64 pixels, and the upper ones. At first all are for the tile.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Reasons([u64; 2]);

impl Reasons {
    /// Of the pixel at a place `within` the tile.
    #[inline(always)]
    pub(super) fn of(self, within: usize) -> Why {
        let [low, high] = self.0.map(|bits| bits >> within & 1);
        match low | high << 1 {
            0 => Why::Tile,
            1 => Why::Front,
            2 => Why::Hole,
            _ => Why::Late,
        }
    }

    /// Of all pixels whose bits are set.
    #[inline(always)]
    pub(super) fn set(&mut self, pixels: u64, why: Why) {
        let (low, high) = ((why as u64 & 1).wrapping_neg(), (why as u64 >> 1).wrapping_neg());
        let [lower, upper] = &mut self.0;
        *lower = *lower & !pixels | low & pixels;
        *upper = *upper & !pixels | high & pixels;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neighbours_keep_their_own() {
        let mut reasons = Reasons::default();
        let all = [Why::Hole, Why::Front, Why::Tile, Why::Late, Why::Front];
        for turn in 0..3 {
            let why = |place: usize| all[(place + turn) % 5];
            (0..64).for_each(|place| reasons.set(1 << place, why(place)));
            assert!((0..64).all(|place| reasons.of(place) == why(place)), "turn {turn}");
        }
        reasons.set(0b101, Why::Late);
        let after = [0, 1, 2].map(|place| reasons.of(place));
        assert_eq!(after, [Why::Late, all[3], Why::Late]);
    }
}
