//! `temporal`: jittered low-resolution frames at 60 Hz that add up in a full-resolution history: temporal upsampling.
//!
//! Stands for what game engines do: Unreal's TAAU and TSR, AMD's FSR 2, Intel's XeSS, NVIDIA's DLSS in their classic form. Each
//! refresh a frame is traced, of the resolution that fits, its grid shifted a little from frame to frame
//! ([`jitter`](mod@jitter)). Every pixel of the display looks up where its surface was in the frame before
//! ([`low_frame`]), takes the colour that the history had there ([`history`]) unless the present samples contradict it
//! ([`clip`]), and adds the present samples, those near its centre most ([`resolve`]). Sources: Karis, "High quality temporal
//! supersampling", SIGGRAPH courses 2014; Salvi, "An excursion in temporal supersampling", GDC 2016; Yang, Liu and Salvi, "A survey
//! of temporal antialiasing techniques", Computer Graphics Forum 39(2), 2020.
//!
//! Not handicapped, and beyond what engines do where that lowers its error against an ideal with one sample at each pixel's centre:
//!
//! - Rays go through pixel centres, not between them. Where nothing moves the history is thus the ideal, without the blur and
//!   flicker that jitter otherwise leaves.
//! - Motion is exact, of rigid and deforming objects and of the sky, and interpolated per object; object and depth are known for every
//!   pixel of the history; silhouettes are as sharp as the display, and other objects do not bleed over them.
//! - A sample that differs from a sharp history at the very same place casts doubt on the history around: switched lights
//!   and shadows show at once, whereas textures are not mistaken for changes.
//! - Choosing, filtering and display cost no time. Where full resolution fits, this is `framed`, begun just in time.
//! - The few parameters were tried out on some of the built-in scenes; what is known of others than these stands in
//!   docs/evaluation.md, with a setting that is better by 4 %.
//!
//! A frame shows the moment at which it was begun, as in `lowres60`: nothing is extrapolated. The age of a pixel is the mean over
//! what was blended into it, by weight.

mod clip;
mod history;
mod jitter;
mod low_frame;
mod resolve;

use frameless::{EngineError, Pose, Request, Size, Time};

use self::history::{History, Past};
use self::jitter::{jitter, jittered_requests};
use self::low_frame::LowFrame;
use self::resolve::{Resolve, Tuning};
use super::framed::newest_frame_start;
use super::lowres::fitting_size;
use crate::contender::{Arena, Contender, Shown, encode};

const TUNING: Tuning =
    Tuning { kernel_px: 0.35, resampled: 0.8, gamma: 6.0, slack: 0.02, doubt: 0.02 };

pub(crate) struct Temporal<'a> {
    arena: Arena<'a>,
    low: Size,
    frame_secs: f64,
    /// Frames traced so far.
    frames: u32,
    /// Where everything was in the newest frame.
    pose: Pose,
    history: History,
    /// Memory of the history before.
    spare: Vec<Past>,
}

impl<'a> Temporal<'a> {
    pub(crate) fn new(arena: Arena<'a>) -> Temporal<'a> {
        let refresh_secs = arena.refresh_secs();
        let low = fitting_size(arena.size, arena.samples_per_sec * refresh_secs);
        // As in `lowres60`: at reduced resolution a frame fills its interval.
        let frame_secs =
            if low == arena.size { arena.frame_secs(low.pixels()) } else { refresh_secs };
        let pose = arena.subject.pose(0.0, arena.size);
        let history = start(&arena, &pose);
        Temporal { arena, low, frame_secs, frames: 0, pose, history, spare: Vec::new() }
    }

    /// Traces the frame that shows the moment `secs` and adds it to the history.
    fn draw(&mut self, secs: f64) {
        let (subject, full) = (self.arena.subject, self.arena.size);
        let jitter = jitter(self.frames, self.low, full);
        let requests = jittered_requests(self.low, full, jitter);
        let (rgb, surfaces) = subject.trace_surfaces(secs, full, &requests);
        let pose = subject.pose(secs, full);
        let frame = LowFrame::new(
            (self.low, full, jitter),
            &requests,
            (&rgb, &surfaces),
            (&pose, &self.pose),
        );
        let resolve = Resolve::new(&frame, &self.history, secs, TUNING);
        let mut pixels = std::mem::take(&mut self.spare);
        pixels.clear();
        for y in 0..full.height {
            pixels.extend((0..full.width).map(|x| resolve.pixel(x, y)));
        }
        self.spare = std::mem::replace(&mut self.history.pixels, pixels);
        self.pose = pose;
        self.frames += 1;
    }
}

/// The picture that everybody starts with, as a history.
fn start(arena: &Arena<'_>, pose: &Pose) -> History {
    let size = arena.size;
    let requests: Vec<Request> = (0..size.pixels() as u32).map(Request::centre).collect();
    let (_, surfaces) = arena.subject.trace_surfaces(0.0, size, &requests);
    let past = |(colour, surface): ([f32; 3], &frameless::Surface)| Past {
        colour,
        weight: 1.0,
        object: surface.object,
        inverse_depth: pose.project(surface).map_or(0.0, |there| there.depth.recip()),
        secs: 0.0,
    };
    let pixels = encode(&arena.ideals.start).into_iter().zip(&surfaces).map(past).collect();
    History { size, pixels }
}

impl Contender for Temporal<'_> {
    fn show(&mut self, time: Time, shown: &mut Shown) -> Result<(), EngineError> {
        if let Some(secs) = newest_frame_start(time, self.frame_secs, self.arena.refresh_secs()) {
            self.draw(secs.max(0.0));
        }
        shown.picture.clear();
        shown.picture.extend(self.history.pixels.iter().map(|past| past.colour));
        shown.age_secs.clear();
        let age = |past: &Past| time.secs() as f32 - past.secs;
        shown.age_secs.extend(self.history.pixels.iter().map(age));
        Ok(())
    }
}
