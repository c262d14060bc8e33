//! In which order a batch is traced: neighbours together, so that they meet the same nodes while those are in the cache.

use frameless::{Request, Size};

/// Pixels per side of the tiles that are traced together.
const TILE: u32 = 16;

/// Indices of `requests`, tile by tile along a Hilbert curve, which never leaps, and along a Morton curve within each. Requests of one pixel
/// keep their order.
pub(crate) fn by_tile(requests: &[Request], size: Size, order: &mut Vec<u32>) {
    let bits = size.width.max(size.height).div_ceil(TILE).next_power_of_two().trailing_zeros();
    let key = |request: &Request| {
        let (x, y) = size.xy(request.pixel);
        let tile = hilbert(bits, x / TILE, y / TILE);
        u64::from(tile) << 8 | u64::from(morton(x % TILE, y % TILE))
    };
    let mut keyed: Vec<u64> =
        requests.iter().zip(0u64..).map(|(request, index)| key(request) << 32 | index).collect();
    keyed.sort_unstable();
    order.clear();
    order.extend(keyed.iter().map(|&k| k as u32));
}

/// The number of a square along the curve through 2^bits × 2^bits of them (Hilbert 1891, "Ueber die stetige Abbildung einer Linie auf ein
/// Flächenstück"): quarter by quarter, each turned so that it begins beside the end of the one before.
fn hilbert(bits: u32, mut x: u32, mut y: u32) -> u32 {
    let mut number = 0;
    for bit in (0..bits).rev() {
        let [right, up] = [x, y].map(|c| c >> bit & 1);
        number = number << 2 | (3 * right) ^ up;
        if up == 0 {
            if right == 1 {
                (x, y) = (!x, !y);
            }
            (x, y) = (y, x);
        }
    }
    number
}

/// The bits of two numbers below 16, interleaved.
fn morton(x: u32, y: u32) -> u32 {
    let spread = |v: u32| (v & 1) | (v & 2) << 1 | (v & 4) << 2 | (v & 8) << 3;
    spread(x) | spread(y) << 1
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_curve_visits_every_square_and_never_leaps() {
        for bits in 0..6 {
            let side = 1u32 << bits;
            let mut place = vec![None; (side * side) as usize];
            for (x, y) in (0..side * side).map(|k| (k % side, k / side)) {
                let number = hilbert(bits, x, y) as usize;
                assert_eq!(place[number].replace((x, y)), None, "{number} twice");
            }
            let way: Vec<(u32, u32)> = place.into_iter().flatten().collect();
            for pair in way.windows(2) {
                let [(x0, y0), (x1, y1)] = [pair[0], pair[1]];
                assert_eq!(x0.abs_diff(x1) + y0.abs_diff(y1), 1, "{pair:?}");
            }
        }
    }

    #[test]
    fn everything_is_there_once_and_requests_of_a_pixel_in_their_order() {
        let size = Size::new(100, 70);
        let requests: Vec<Request> =
            (0..7000).map(|k| Request::centre(k * 7919 % 3500 + k % 2 * 3500)).collect();
        let mut order = Vec::new();
        by_tile(&requests, size, &mut order);
        let mut sorted = order.clone();
        sorted.sort_unstable();
        assert!(sorted.into_iter().eq(0..7000));
        for pair in order.windows(2) {
            let [a, b] = [pair[0], pair[1]];
            assert!(requests[a as usize].pixel != requests[b as usize].pixel || a < b);
        }
    }
}
