//! In which order a batch is traced: neighbours together, so that they meet the same nodes while those are in the cache.

use frameless::{Request, Size};

/// Pixels per side of the tiles that are traced together.
const TILE: u32 = 16;

/// Indices of `requests`, tile by tile, along a Morton curve within each. Requests of one pixel keep their order.
pub(crate) fn by_tile(requests: &[Request], size: Size, order: &mut Vec<u32>) {
    let tiles_per_row = size.width.div_ceil(TILE);
    let key = |request: &Request| {
        let (x, y) = size.xy(request.pixel);
        let tile = y / TILE * tiles_per_row + x / TILE;
        u64::from(tile) << 8 | u64::from(morton(x % TILE, y % TILE))
    };
    let mut keyed: Vec<u64> =
        requests.iter().zip(0u64..).map(|(request, index)| key(request) << 32 | index).collect();
    keyed.sort_unstable();
    order.clear();
    order.extend(keyed.iter().map(|&k| k as u32));
}

/// The bits of two numbers below 16, interleaved.
fn morton(x: u32, y: u32) -> u32 {
    let spread = |v: u32| (v & 1) | (v & 2) << 1 | (v & 4) << 2 | (v & 8) << 3;
    spread(x) | spread(y) << 1
}
