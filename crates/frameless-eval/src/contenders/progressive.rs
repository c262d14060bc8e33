//! `progressive`: clear on any change, low resolution while things change, then accumulate.
//!
//! Stands for today's viewers: Cycles' viewport, OSPRay Studio, three-gpu-pathtracer, ParaView's path tracer. Whenever
//! the camera, an object or a light has moved since the last frame, everything is thrown away and a frame is drawn at the
//! resolution that holds 30 Hz. As soon as nothing has moved, jittered samples accumulate at full
//! resolution, pass after pass, visible as they come over the low-resolution frame.
//!
//! Not handicapped: changes are seen within 1/120 s at rest and between frames in motion, a frame begins at once, upsampling is bilinear, the first pass goes through the pixel
//! centres, and no time is lost to display or denoising.

use frameless::{EngineError, Request, Rng, Size, Time};

use super::lowres::{fitting_size, requests_of, upsampled};
use crate::contender::{Arena, Contender, Shown, encode};
use crate::metrics::Picture;

pub(crate) struct Progressive<'a> {
    arena: Arena<'a>,
    rng: Rng,
    low: Size,
    /// Scene time of what is being drawn.
    drawn_secs: f64,
    /// Until when the renderer has been busy, in seconds.
    busy_until: f64,
    picture: Picture,
    /// Linear sums and counts of the accumulated samples, row-major.
    sums: Vec<([f32; 3], u32)>,
    /// Samples accumulated since the last change.
    accumulated: usize,
    /// When each pixel was traced last. At rest a sample shows the moment at which it is traced: nothing has changed since
    /// `drawn_secs`.
    traced_secs: Vec<f64>,
}

/// The frame rate that viewers hold while something changes.
const MOVING_HZ: f64 = 30.0;
/// At rest, changes are looked for this often.
const CHUNKS_PER_SEC: f64 = 120.0;

impl<'a> Progressive<'a> {
    pub(crate) fn new(arena: Arena<'a>) -> Progressive<'a> {
        Progressive {
            arena,
            rng: Rng::new(arena.seed),
            low: fitting_size(arena.size, arena.samples_per_sec / MOVING_HZ),
            drawn_secs: 0.0,
            busy_until: 0.0,
            picture: encode(&arena.ideals.start),
            sums: vec![([0.0; 3], 0); arena.size.pixels()],
            accumulated: 0,
            traced_secs: vec![0.0; arena.size.pixels()],
        }
    }

    /// When the next piece of work would be finished, and whether it is a low-resolution frame.
    fn plan(&self) -> (f64, bool) {
        let moved = !self.arena.subject.is_still(self.drawn_secs, self.busy_until);
        let low_secs = self.arena.frame_secs(self.low.pixels());
        let secs = if moved { low_secs } else { 1.0 / CHUNKS_PER_SEC };
        (self.busy_until + secs, moved)
    }

    fn draw_low(&mut self) {
        self.drawn_secs = self.busy_until;
        let requests = requests_of(self.low, self.arena.size);
        let rgb = self.arena.subject.trace(self.drawn_secs, self.arena.size, &requests);
        self.picture = upsampled(&encode(&rgb), self.low, self.arena.size);
        self.sums.fill(([0.0; 3], 0));
        self.accumulated = 0;
        self.traced_secs.fill(self.drawn_secs);
    }

    fn accumulate(&mut self, until: f64) {
        let rate = self.arena.samples_per_sec;
        let count = (until * rate).floor() as usize - (self.busy_until * rate).floor() as usize;
        let n = self.arena.size.pixels();
        let requests: Vec<Request> = (self.accumulated..self.accumulated + count)
            .map(|i| Request {
                pixel: (i % n) as u32,
                offset: if i < n {
                    [0.0; 2]
                } else {
                    [self.rng.unit_f32() - 0.5, self.rng.unit_f32() - 0.5]
                },
                sample_index: (i / n) as u32,
            })
            .collect();
        let rgb = self.arena.subject.trace(self.drawn_secs, self.arena.size, &requests);
        for (request, rgb) in requests.iter().zip(rgb) {
            let (sum, count) = &mut self.sums[request.pixel as usize];
            (0..3).for_each(|k| sum[k] += rgb[k]);
            *count += 1;
            let mean = sum.map(|s| s / *count as f32);
            self.picture[request.pixel as usize] = encode(&[mean])[0];
            self.traced_secs[request.pixel as usize] = self.busy_until;
        }
        self.accumulated += count;
    }
}

impl Contender for Progressive<'_> {
    fn show(&mut self, time: Time, shown: &mut Shown) -> Result<(), EngineError> {
        loop {
            let (finished, moved) = self.plan();
            if finished > time.secs() + 1e-6 {
                break;
            }
            if moved {
                self.draw_low();
            } else {
                self.accumulate(finished);
            }
            self.busy_until = finished;
        }
        shown.picture.clone_from(&self.picture);
        shown.age_secs.clear();
        shown.age_secs.extend(self.traced_secs.iter().map(|&secs| (time.secs() - secs) as f32));
        Ok(())
    }
}
