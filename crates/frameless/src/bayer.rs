//! Bayer's order of the pixels in a square: any first part of it covers the square evenly (Bayer 1973, "An optimum method for
//! two-level rendition of continuous-tone pictures").

/// Place of pixel (x, y) in the order of a square of side 2^`bits`, repeated over the plane: the interleaved bits of x ⊕ y and
/// y, the lowest bit first.
pub(crate) const fn rank(x: u32, y: u32, bits: u32) -> u32 {
    let (mut rank, mut i) = (0, 0);
    while i < bits {
        let (x, y) = ((x >> i) & 1, (y >> i) & 1);
        rank |= (((x ^ y) << 1) | y) << (2 * (bits - 1 - i));
        i += 1;
    }
    rank
}

/// The pixels (x, y) of a square of side 2^`bits` in their order.
pub(crate) fn order(bits: u32) -> Vec<(u32, u32)> {
    let side = 1 << bits;
    let mut pixels: Vec<(u32, u32)> =
        (0..side).flat_map(|y| (0..side).map(move |x| (x, y))).collect();
    pixels.sort_by_key(|&(x, y)| rank(x, y, bits));
    pixels
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_order_of_two_by_two_and_evenness() {
        assert_eq!(order(1), [(0, 0), (1, 1), (1, 0), (0, 1)]);
        let order = order(3);
        // After every quarter each 4×4 quadrant has had as many pixels.
        for part in order.chunks(4) {
            let quadrants: Vec<u32> = part.iter().map(|&(x, y)| x / 4 + 2 * (y / 4)).collect();
            let mut sorted = quadrants.clone();
            sorted.sort_unstable();
            assert_eq!(sorted, [0, 1, 2, 3], "{part:?}");
        }
    }
}
