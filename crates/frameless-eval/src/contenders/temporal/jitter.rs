//! Where the samples of a low-resolution frame lie: a regular grid, moved a little from frame to frame.

use frameless::{Request, Size};

/// Samples of its own that every pixel of the full picture gets until the grid lies where it lay first. AMD's FSR 2 takes
/// as many.
const PHASES_PER_PIXEL: f64 = 8.0;

/// How many frames it takes until the grid lies where it lay first.
fn phase_count(low: Size, full: Size) -> u32 {
    (PHASES_PER_PIXEL * full.pixels() as f64 / low.pixels() as f64).ceil() as u32
}

/// Shift of the whole grid in samples, each component in [−0.5, 0.5): the Halton sequence (2, 3), which leaves no gaps
/// however soon it is broken off. None at full resolution, where every pixel has a sample in every frame.
pub(super) fn jitter(frame: u32, low: Size, full: Size) -> [f32; 2] {
    if low == full {
        return [0.0; 2];
    }
    let index = frame % phase_count(low, full) + 1;
    [radical_inverse(index, 2) - 0.5, radical_inverse(index, 3) - 0.5]
}

/// The digits of `index` in `base`, mirrored at the point; in [0, 1).
fn radical_inverse(mut index: u32, base: u32) -> f32 {
    let (mut inverse, mut digit) = (0.0, 1.0);
    while index > 0 {
        digit /= f64::from(base);
        inverse += digit * f64::from(index % base);
        index /= base;
    }
    inverse as f32
}

/// One ray per sample of a picture of size `low` that fills the same screen as `full`, its grid shifted by `jitter`: through the
/// centre of the pixel of `full` that the sample lies in, since the ideal looks only there.
pub(super) fn jittered_requests(low: Size, full: Size, jitter: [f32; 2]) -> Vec<Request> {
    let place = |i: u32, jitter: f32, low: u32, full: u32| {
        let position = (i as f32 + 0.5 + jitter) * full as f32 / low as f32;
        (position as u32).min(full - 1)
    };
    let request = |sample: u32| {
        let (i, j) = low.xy(sample);
        let x = place(i, jitter[0], low.width, full.width);
        Request::centre(full.index(x, place(j, jitter[1], low.height, full.height)))
    };
    (0..low.pixels() as u32).map(request).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_numbers_of_the_halton_sequence() {
        let halves = [1, 2, 3, 4, 5].map(|i| radical_inverse(i, 2));
        assert_eq!(halves, [0.5, 0.25, 0.75, 0.125, 0.625]);
        let thirds = [1, 2, 3, 4].map(|i| radical_inverse(i, 3));
        assert_eq!(thirds, [1.0 / 3.0, 2.0 / 3.0, 1.0 / 9.0, 4.0 / 9.0]);
    }

    #[test]
    fn the_grid_comes_back_and_reaches_every_pixel() {
        let (low, full) = (Size::new(5, 4), Size::new(15, 12));
        let phases = phase_count(low, full);
        assert_eq!(phases, 72);
        assert_eq!(jitter(3, low, full), jitter(3 + phases, low, full));
        let mut hits = vec![0; full.pixels()];
        for frame in 0..phases {
            for request in jittered_requests(low, full, jitter(frame, low, full)) {
                hits[request.pixel as usize] += 1;
            }
        }
        assert!(hits.iter().all(|&hits| (6..=10).contains(&hits)), "{hits:?}");
    }

    #[test]
    fn at_full_resolution_every_pixel_is_hit_once() {
        let size = Size::new(7, 5);
        let requests = jittered_requests(size, size, jitter(9, size, size));
        assert_eq!(requests, (0..35).map(Request::centre).collect::<Vec<_>>());
    }
}
