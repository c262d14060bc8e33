//! Holes in the order in which they are filled: large ones first, those off their centre last, evenly spread in every part of the order.

use super::gather::Hole;
use crate::{Size, bayer};

const BITS: u32 = 3;

/// The pixels that are holes.
pub(super) fn order(holes: &[Hole], size: Size, ordered: &mut Vec<u32>) {
    const RANKS: usize = 1 << (2 * BITS);
    let mut by_rank: [[Vec<u32>; RANKS]; 3] =
        std::array::from_fn(|_| std::array::from_fn(|_| Vec::new()));
    for (pixel, &hole) in holes.iter().enumerate() {
        let kind = match hole {
            Hole::No => continue,
            Hole::Large => 0,
            Hole::Small => 1,
            Hole::OffCentre => 2,
        };
        let (x, y) = size.xy(pixel as u32);
        by_rank[kind][bayer::rank(x, y, BITS) as usize].push(pixel as u32);
    }
    ordered.clear();
    by_rank.iter().flatten().for_each(|pixels| ordered.extend(pixels));
}
