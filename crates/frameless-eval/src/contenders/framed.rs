//! `framed`: whole frames, double-buffered.
//!
//! Stands for every renderer that draws a full-resolution frame out of sight and shows it when it is finished: Embree's
//! and OptiX' tutorials, most ray tracers with an interactive window.
//!
//! Not handicapped: it loses no time between frames and none to display; where a frame takes less than a refresh it is
//! begun just in time, so that it is as fresh as it can be.

use frameless::{EngineError, Time};

use crate::contender::{Arena, Contender, Shown, encode};
use crate::metrics::Picture;

pub(crate) struct Framed<'a> {
    arena: Arena<'a>,
    /// Start of the frame on display, in seconds; `None`: the picture that the run starts with.
    shown_secs: Option<f64>,
    picture: Picture,
}

impl<'a> Framed<'a> {
    pub(crate) fn new(arena: Arena<'a>) -> Framed<'a> {
        Framed { arena, shown_secs: None, picture: encode(&arena.ideals.start) }
    }
}

impl Contender for Framed<'_> {
    fn show(&mut self, time: Time, shown: &mut Shown) -> Result<(), EngineError> {
        let start = newest_frame_start(
            time,
            self.arena.frame_secs(self.arena.size.pixels()),
            self.arena.refresh_secs(),
        );
        if start != self.shown_secs {
            self.shown_secs = start;
            if let Some(secs) = start {
                self.picture = encode(&self.arena.subject.ideal(secs, self.arena.size));
            }
        }
        shown.show_moment(&self.picture, self.shown_secs.unwrap_or(0.0), time);
        Ok(())
    }
}

/// When the newest frame that is finished at `time` was begun, if frames of `frame_secs` follow each other without a
/// pause, or, when there is time to spare, are begun just in time for the refresh.
pub(super) fn newest_frame_start(time: Time, frame_secs: f64, refresh_secs: f64) -> Option<f64> {
    let now = time.secs();
    if frame_secs <= refresh_secs {
        return Some(now - frame_secs);
    }
    // A frame that ends within a microsecond after the refresh belongs to it: times are rounded to nanoseconds.
    let finished = ((now + 1e-6) / frame_secs).floor();
    (finished >= 1.0).then_some((finished - 1.0) * frame_secs)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_shown_when_they_are_finished() {
        let start = |secs: f64| newest_frame_start(Time::from_secs(secs), 0.25, 1.0 / 60.0);
        assert_eq!(start(0.2), None);
        assert_eq!(start(0.25), Some(0.0));
        assert_eq!(start(0.49), Some(0.0));
        assert_eq!(start(0.5), Some(0.25));
    }

    #[test]
    fn fast_frames_are_begun_just_in_time() {
        let start = newest_frame_start(Time::from_secs(1.0), 0.001, 1.0 / 60.0).expect("finished");
        assert!((start - 0.999).abs() < 1e-9);
    }
}
