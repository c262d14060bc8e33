//! Large holes show what the nearest pixel shows that is none.
//!
//! Two passes over the holes hand on the nearest known pixel from neighbour to neighbour, down and to the right, then up and to
//! the left (Danielsson 1980, "Euclidean distance mapping"): not always the very nearest, but at a cost that does not depend on
//! how large a hole is.

use crate::Size;

/// Nothing is known anywhere.
pub(super) const NOBODY: u32 = u32::MAX;

/// The pixels around one, the nearest first.
pub(super) const AROUND: [[i32; 2]; 8] =
    [[-1, 0], [0, -1], [1, 0], [0, 1], [-1, -1], [1, -1], [1, 1], [-1, 1]];

/// `source`: per pixel the nearest that is known. `holes`, in row-major order, are [`NOBODY`] before.
pub(super) fn nearest(size: Size, holes: &[u32], source: &mut [u32]) {
    for &hole in holes {
        hand_on(size, hole, [[-1, 0], [-1, -1], [0, -1], [1, -1]], source);
    }
    for &hole in holes.iter().rev() {
        hand_on(size, hole, [[1, 0], [1, 1], [0, 1], [-1, 1]], source);
    }
}

fn hand_on(size: Size, hole: u32, neighbours: [[i32; 2]; 4], source: &mut [u32]) {
    let (x, y) = size.xy(hole);
    let distance2 = |source: u32| {
        let (sx, sy) = size.xy(source);
        let (dx, dy) = (i64::from(sx) - i64::from(x), i64::from(sy) - i64::from(y));
        if source == NOBODY { i64::MAX } else { dx * dx + dy * dy }
    };
    let mut nearest = (distance2(source[hole as usize]), source[hole as usize]);
    for [dx, dy] in neighbours {
        if let Some(neighbour) = beside(size, x, y, dx, dy) {
            let known = source[neighbour as usize];
            if known != NOBODY && distance2(known) < nearest.0 {
                nearest = (distance2(known), known);
            }
        }
    }
    source[hole as usize] = nearest.1;
}

fn beside(size: Size, x: u32, y: u32, dx: i32, dy: i32) -> Option<u32> {
    let (x, y) = (x.checked_add_signed(dx)?, y.checked_add_signed(dy)?);
    (x < size.width && y < size.height).then(|| size.index(x, y))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_hole_finds_a_known_pixel_about_as_near_as_the_nearest() {
        let size = Size::new(40, 30);
        let mut rng = crate::Rng::new(1);
        let known: Vec<u32> = (0..30).map(|_| rng.below(size.pixels() as u32)).collect();
        let holes: Vec<u32> =
            (0..size.pixels() as u32).filter(|pixel| !known.contains(pixel)).collect();
        let mut source: Vec<u32> = (0..size.pixels() as u32).collect();
        holes.iter().for_each(|&hole| source[hole as usize] = NOBODY);
        nearest(size, &holes, &mut source);
        let distance = |a: u32, b: u32| {
            let ((ax, ay), (bx, by)) = (size.xy(a), size.xy(b));
            f64::from(ax.abs_diff(bx)).hypot(f64::from(ay.abs_diff(by)))
        };
        for pixel in 0..size.pixels() as u32 {
            let found = source[pixel as usize];
            assert!(known.contains(&found), "{pixel}: {found}");
            let least = known.iter().map(|&k| distance(pixel, k)).fold(f64::MAX, f64::min);
            assert!(distance(pixel, found) <= 1.5 * least + 1.0, "{pixel}");
        }
    }

    #[test]
    fn where_nothing_is_known_nobody_is_found() {
        let size = Size::new(3, 2);
        let mut source = [NOBODY; 6];
        nearest(size, &[0, 1, 2, 3, 4, 5], &mut source);
        assert_eq!(source, [NOBODY; 6]);
    }
}
