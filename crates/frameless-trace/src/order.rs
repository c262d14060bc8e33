//! In which order a batch is traced: neighbours together, so that they meet the same nodes while those are in the cache.

use frameless::{Request, Size};

/// Pixels per side of the tiles that are traced together.
const TILE: u32 = 16;
/// So many bits say where a pixel is in its tile.
const WITHIN_BITS: u32 = 8;

/// Fewer requests than this are sorted by comparing them.
const FEW: usize = 256;
/// Bits of a digit at most: as many piles as the first cache has lines for.
const DIGIT_BITS: u32 = 10;

/// Finds the order, again and again; what it has made for a size of the picture it keeps.
#[derive(Default)]
pub(crate) struct Order {
    size: Option<Size>,
    columns: u32,
    /// Bits of the numbers of tiles.
    tile_bits: u32,
    /// Of every tile, row by row, its number along a Hilbert curve.
    tiles: Vec<u32>,
    keyed: Vec<u64>,
    sorted: Vec<u64>,
    requests: Vec<u32>,
}

impl Order {
    /// The one found last: indices of requests.
    pub(crate) fn requests(&self) -> &[u32] {
        &self.requests
    }

    /// Tile by tile along a Hilbert curve, which never leaps, and along a Morton curve within each. Requests of one pixel keep their order.
    pub(crate) fn by_tile(&mut self, requests: &[Request], size: Size) {
        self.number_tiles(size);
        let rows_per_pixel = 1.0 / f64::from(size.width);
        let (tiles, columns) = (&self.tiles, self.columns);
        self.keyed.clear();
        self.keyed.extend(requests.iter().zip(0u64..).map(|(request, index)| {
            // A half more than the pixel's number is never so near a whole row that rounding could pass it.
            let y = ((f64::from(request.pixel) + 0.5) * rows_per_pixel) as u32;
            let x = request.pixel - y * size.width;
            // The engine tells of a pixel that there is not, once it is answered.
            let tile = tiles.get((y / TILE * columns + x / TILE) as usize).copied().unwrap_or(0);
            let key = tile << WITHIN_BITS | morton(x % TILE, y % TILE);
            u64::from(key) << 32 | index
        }));
        if requests.len() < FEW {
            self.keyed.sort_unstable();
        } else {
            self.sort_by_digits(self.tile_bits + WITHIN_BITS);
        }
        self.requests.clear();
        self.requests.extend(self.keyed.iter().map(|&keyed| keyed as u32));
    }

    fn number_tiles(&mut self, size: Size) {
        if self.size.replace(size) == Some(size) {
            return;
        }
        let (columns, rows) = (size.width.div_ceil(TILE), size.height.div_ceil(TILE));
        let bits = columns.max(rows).next_power_of_two().trailing_zeros();
        (self.columns, self.tile_bits) = (columns, 2 * bits);
        self.tiles.clear();
        let places = (0..rows).flat_map(|y| (0..columns).map(move |x| (x, y)));
        self.tiles.extend(places.map(|(x, y)| hilbert(bits, x, y)));
    }

    /// By so many bits from bit 32 on, what is alike in the order in which it is: digit by digit from the last (Knuth, The Art of
    /// Computer Programming 3, §5.2.5).
    fn sort_by_digits(&mut self, bits: u32) {
        let digits = bits.div_ceil(DIGIT_BITS);
        let digit_bits = bits.div_ceil(digits);
        let mask = (1 << digit_bits) - 1;
        self.sorted.resize(self.keyed.len(), 0);
        for digit in 0..digits {
            let digit = |keyed: u64| (keyed >> (32 + digit * digit_bits)) as usize & mask;
            let mut ends = [0u32; 1 << DIGIT_BITS];
            self.keyed.iter().for_each(|&keyed| ends[digit(keyed)] += 1);
            let mut begin = 0;
            for end in &mut ends[..=mask] {
                begin += std::mem::replace(end, begin);
            }
            for &keyed in &self.keyed {
                let end = &mut ends[digit(keyed)];
                self.sorted[*end as usize] = keyed;
                *end += 1;
            }
            std::mem::swap(&mut self.keyed, &mut self.sorted);
        }
    }
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
    fn the_order_is_by_tile_then_place_then_request() {
        let mut order = Order::default();
        for (width, height, count) in
            [(100, 70, 7000), (100, 70, 100), (3840, 2160, 5000), (1, 1, 300)]
        {
            let size = Size::new(width, height);
            let last = size.pixels() as u32 - 1;
            let requests: Vec<Request> = (0..count)
                .map(|k| Request::centre((k * 7919 % (last / 2 + 1)) + k % 2 * last / 2))
                .collect();
            let bits = width.max(height).div_ceil(TILE).next_power_of_two().trailing_zeros();
            let key = |&request: &u32| {
                let (x, y) = size.xy(requests[request as usize].pixel);
                (hilbert(bits, x / TILE, y / TILE), morton(x % TILE, y % TILE), request)
            };
            let mut wanted: Vec<u32> = (0..count).collect();
            wanted.sort_by_key(key);
            order.by_tile(&requests, size);
            assert_eq!(order.requests(), wanted, "{size:?}");
        }
    }

    #[test]
    fn what_is_no_pixel_is_somewhere() {
        let mut order = Order::default();
        order.by_tile(&[u32::MAX, 70, 0].map(Request::centre), Size::new(7, 10));
        let mut all = order.requests().to_vec();
        all.sort_unstable();
        assert_eq!(all, [0, 1, 2]);
    }
}
