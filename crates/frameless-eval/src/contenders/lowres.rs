//! `lowres60`, `lowres30`: frames of so low a resolution that one is finished every refresh, or every other.
//!
//! Stands for viewers that scale their resolution to hold a frame rate (ParaView's and Blender's navigation modes, dynamic
//! resolution in games without temporal upsampling).
//!
//! Not handicapped: the resolution is the highest that fits, of any size; upsampling is bilinear, in display space, aligned by pixel
//! centres; where full resolution fits, frames are begun just in time. A frame shows the moment at which it was begun.

use frameless::{EngineError, Request, Size, Time};

use super::framed::newest_frame_start;
use crate::contender::{Arena, Contender, Shown, encode};
use crate::metrics::Picture;

pub(crate) struct LowRes<'a> {
    arena: Arena<'a>,
    low: Size,
    frame_secs: f64,
    refreshes_per_frame: u32,
    shown_secs: Option<f64>,
    picture: Picture,
}

impl<'a> LowRes<'a> {
    /// One frame every `refreshes_per_frame` refreshes.
    pub(crate) fn new(arena: Arena<'a>, refreshes_per_frame: u32) -> LowRes<'a> {
        let interval_secs = f64::from(refreshes_per_frame) * arena.refresh_secs();
        let low = fitting_size(arena.size, arena.samples_per_sec * interval_secs);
        // At reduced resolution a frame fills its interval: whatever rounding left over waits for the refresh.
        let frame_secs =
            if low == arena.size { arena.frame_secs(low.pixels()) } else { interval_secs };
        let picture = encode(&arena.ideals.start);
        LowRes { arena, low, frame_secs, refreshes_per_frame, shown_secs: None, picture }
    }
}

impl Contender for LowRes<'_> {
    fn show(&mut self, time: Time, shown: &mut Shown) -> Result<(), EngineError> {
        let refresh = (time.secs() * f64::from(self.arena.display_hz)).round() as u32;
        let interval_secs = f64::from(self.refreshes_per_frame) * self.arena.refresh_secs();
        if refresh.is_multiple_of(self.refreshes_per_frame) {
            let start = newest_frame_start(time, self.frame_secs, interval_secs);
            if let Some(secs) = start.filter(|_| start != self.shown_secs) {
                let requests = requests_of(self.low, self.arena.size);
                let rgb = self.arena.subject.trace(secs.max(0.0), self.arena.size, &requests);
                self.picture = upsampled(&encode(&rgb), self.low, self.arena.size);
            }
            self.shown_secs = start;
        }
        shown.show_moment(&self.picture, self.shown_secs.unwrap_or(0.0).max(0.0), time);
        Ok(())
    }
}

/// The largest size of the same shape with at most `samples` pixels, at least 1×1 and at most `full`.
pub(super) fn fitting_size(full: Size, samples: f64) -> Size {
    let scale = (samples / full.pixels() as f64).sqrt().min(1.0);
    let side = |side: u32| ((f64::from(side) * scale).floor() as u32).max(1);
    Size::new(side(full.width), side(full.height))
}

/// The rays through the pixel centres of a picture of size `low` that fills the same screen as `full`.
pub(super) fn requests_of(low: Size, full: Size) -> Vec<Request> {
    let place = |i: u32, low: u32, full: u32| {
        let position = (f64::from(i) + 0.5) * f64::from(full) / f64::from(low);
        let pixel = (position.floor() as u32).min(full - 1);
        (pixel, (position - f64::from(pixel) - 0.5) as f32)
    };
    let request = |pixel: u32| {
        let (i, j) = low.xy(pixel);
        let (x, dx) = place(i, low.width, full.width);
        let (y, dy) = place(j, low.height, full.height);
        Request { pixel: full.index(x, y), offset: [dx, dy], sample_index: 0 }
    };
    (0..low.pixels() as u32).map(request).collect()
}

/// Bilinear interpolation between the pixel centres of `low`, held constant beyond the outermost.
pub(super) fn upsampled(picture: &[[f32; 3]], low: Size, full: Size) -> Picture {
    if low == full {
        return picture.to_vec();
    }
    let place = |i: u32, low: u32, full: u32| {
        let position = (i as f32 + 0.5) * low as f32 / full as f32 - 0.5;
        let position = position.clamp(0.0, (low - 1) as f32);
        let first = position.floor() as u32;
        (first, (first + 1).min(low - 1), position - first as f32)
    };
    let columns: Vec<_> = (0..full.width).map(|x| place(x, low.width, full.width)).collect();
    let mut result = Vec::with_capacity(full.pixels());
    for y in 0..full.height {
        let (top, bottom, v) = place(y, low.height, full.height);
        for &(left, right, u) in &columns {
            let at = |x, y| picture[low.index(x, y) as usize];
            let mix = |a: [f32; 3], b: [f32; 3], t: f32| -> [f32; 3] {
                std::array::from_fn(|k| a[k] + (b[k] - a[k]) * t)
            };
            let upper = mix(at(left, top), at(right, top), u);
            let lower = mix(at(left, bottom), at(right, bottom), u);
            result.push(mix(upper, lower, v));
        }
    }
    result
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_size_fits_the_budget_and_the_shape() {
        let full = Size::new(512, 384);
        assert_eq!(fitting_size(full, 1e9), full);
        let low = fitting_size(full, 15_000.0);
        assert_eq!((low.width, low.height), (141, 106));
        assert!(low.pixels() <= 15_000 && (low.width + 1) * (low.height + 1) > 15_000);
        assert_eq!(fitting_size(full, 0.1), Size::new(1, 1));
    }

    #[test]
    fn rays_of_the_low_resolution_lie_at_its_pixel_centres() {
        let requests = requests_of(Size::new(2, 1), Size::new(6, 3));
        let positions: Vec<[f32; 2]> =
            requests.iter().map(|r| r.position_px(Size::new(6, 3))).collect();
        assert_eq!(positions, [[1.5, 1.5], [4.5, 1.5]]);
        let same = requests_of(Size::new(5, 4), Size::new(5, 4));
        assert_eq!(same, (0..20).map(Request::centre).collect::<Vec<_>>());
    }

    #[test]
    fn upsampling_keeps_ramps_and_constants() {
        let (low, full) = (Size::new(4, 2), Size::new(16, 8));
        let ramp: Picture = (0..8).map(|p| [(low.xy(p).0 as f32 + 0.5) / 4.0, 0.5, 0.0]).collect();
        for (pixel, c) in upsampled(&ramp, low, full).iter().enumerate() {
            let x = (full.xy(pixel as u32).0 as f32 + 0.5) / 16.0;
            // Held constant beyond the outermost pixel centres.
            assert!((c[0] - x.clamp(0.125, 0.875)).abs() < 1e-6 && c[1] == 0.5, "{pixel}: {c:?}");
        }
    }
}
