//! `framed-single`: whole frames, single-buffered: visible while they are drawn, row by row.
//!
//! Stands for renderers that show their buffer as it fills (tile or scanline renderers, progress views). All rows of a frame
//! show the moment at which the frame was begun.
//!
//! Not handicapped: no time is lost between frames, and what is finished is shown at once.

use frameless::{EngineError, Request, Time};

use crate::contender::{Arena, Contender, Shown, encode};
use crate::metrics::Picture;

pub(crate) struct FramedSingle<'a> {
    arena: Arena<'a>,
    /// Samples drawn so far; sample i is pixel i mod n of frame i / n.
    drawn: u64,
    picture: Picture,
    /// Per pixel, when its frame was begun.
    frame_secs: Vec<f64>,
}

impl<'a> FramedSingle<'a> {
    pub(crate) fn new(arena: Arena<'a>) -> FramedSingle<'a> {
        let frame_secs = vec![0.0; arena.size.pixels()];
        FramedSingle { arena, drawn: 0, picture: encode(&arena.ideals.start), frame_secs }
    }

    /// Draws pixels `from..to` of frame number `frame`.
    fn draw(&mut self, frame: u64, from: usize, to: usize) {
        let secs = self.arena.frame_secs(self.arena.size.pixels()) * frame as f64;
        let requests: Vec<Request> = (from as u32..to as u32).map(Request::centre).collect();
        let rgb = self.arena.subject.trace(secs, self.arena.size, &requests);
        self.picture[from..to].copy_from_slice(&encode(&rgb));
        self.frame_secs[from..to].fill(secs);
    }
}

impl Contender for FramedSingle<'_> {
    fn show(&mut self, time: Time, shown: &mut Shown) -> Result<(), EngineError> {
        let n = self.arena.size.pixels() as u64;
        let due = (time.secs() * self.arena.samples_per_sec).floor() as u64;
        // Rows that would be drawn over again before anybody sees them need not be traced.
        self.drawn = self.drawn.max(due.saturating_sub(n));
        while self.drawn < due {
            let (frame, from) = (self.drawn / n, self.drawn % n);
            let to = (from + due - self.drawn).min(n);
            self.draw(frame, from as usize, to as usize);
            self.drawn += to - from;
        }
        shown.picture.clone_from(&self.picture);
        let age_secs = |frame_secs: f64| (time.secs() - frame_secs) as f32;
        shown.age_secs.clear();
        shown.age_secs.extend(self.frame_secs.iter().map(|&secs| age_secs(secs)));
        Ok(())
    }
}
