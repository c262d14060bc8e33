//! The held canvas as the display wants it: 8 bits per channel, encoded once per sample and not once per refresh.

use frameless::{Canvas, Display, Time};

/// The encoded picture, and which sample each of its pixels shows.
pub(crate) struct Shown {
    of: Of,
    rgba: Vec<[u8; 4]>,
    times: Vec<Time>,
}

/// What has to be the same for a pixel with the same time to show the same: how often the canvas has been resized, how
/// often its pixels were given another time without a sample, and the display.
type Of = (u32, u64, Display);

fn of(canvas: &Canvas, display: Display) -> Of {
    (canvas.generation(), canvas.updates(), display)
}

/// How old the picture is.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Ages {
    /// Mean over the pixels that show a sample, in seconds.
    pub mean_secs: f64,
    /// The oldest of them, in seconds.
    pub max_secs: f64,
    /// Pixels of which nothing is known, see [`Canvas::known`].
    pub unknown: usize,
}

impl Shown {
    /// Encodes all of the canvas.
    pub(crate) fn new(canvas: &Canvas, display: Display) -> Shown {
        Shown {
            of: of(canvas, display),
            rgba: canvas.rgb().iter().map(|&rgb| display.encode_rgba8(rgb)).collect(),
            times: canvas.time().collect(),
        }
    }

    /// Encodes what is new: the pixels with another time than last time, or all after a change of size or display, or
    /// of the picture under another reconstruction.
    ///
    /// A pixel's time can also fall behind the last call's: samples are as old as their batch.
    pub(crate) fn update(&mut self, canvas: &Canvas, display: Display) {
        if self.of != of(canvas, display) {
            *self = Shown::new(canvas, display);
            return;
        }
        let shown = self.rgba.iter_mut().zip(&mut self.times);
        for ((rgba, shown), (&rgb, time)) in shown.zip(canvas.rgb().iter().zip(canvas.time())) {
            if *shown != time {
                *shown = time;
                *rgba = display.encode_rgba8(rgb);
            }
        }
    }

    /// sRGB-encoded RGBA, row-major.
    pub(crate) fn rgba(&self) -> &[[u8; 4]] {
        &self.rgba
    }
}

/// Mean and largest age of a canvas.
pub(crate) fn ages(canvas: &Canvas, now: Time) -> Ages {
    let traced = canvas.time().filter(|&time| time != Time::ZERO);
    let (count, sum_nanos, oldest) =
        traced.fold((0u64, 0u128, now), |(count, sum, oldest), time| {
            (count + 1, sum + u128::from(now.0.saturating_sub(time.0)), oldest.min(time))
        });
    Ages {
        mean_secs: if count > 0 { sum_nanos as f64 * 1e-9 / count as f64 } else { 0.0 },
        max_secs: now.secs_since(oldest),
        unknown: canvas.known().filter(|&known| !known).count(),
    }
}
