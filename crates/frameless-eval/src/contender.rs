//! Whoever makes pictures with a limited number of samples per second.

use frameless::{Display, EngineError, Size, Time};

use crate::ideal::Ideals;
use crate::metrics::Picture;
use crate::subject::Subject;

/// A renderer in competition: what a display would show at every refresh.
///
/// The run calls [`show`](Contender::show) once per refresh, in order. By then the contender may have traced rate · time samples, none
/// of them at a time later than the refresh.
pub trait Contender {
    /// What the display shows at `time`; whatever `shown` held before is overwritten.
    ///
    /// # Errors
    /// If the tracer returns a colour that is not finite.
    fn show(&mut self, time: Time, shown: &mut Shown) -> Result<(), EngineError>;
}

/// What a display shows at a refresh.
#[derive(Clone, Debug, Default)]
pub struct Shown {
    /// The picture.
    pub picture: Picture,
    /// Per pixel, how long before the refresh the moment was that it shows, in seconds; as many as pixels. Everybody starts
    /// with the picture of time 0, which is of age t at time t.
    pub age_secs: Vec<f32>,
}

impl Shown {
    /// A picture that shows the moment `secs` everywhere.
    pub(crate) fn show_moment(&mut self, picture: &Picture, secs: f64, now: Time) {
        self.picture.clone_from(picture);
        self.age_secs.clear();
        self.age_secs.resize(picture.len(), (now.secs() - secs) as f32);
    }
}

/// What every contender is given.
#[derive(Clone, Copy)]
pub struct Arena<'a> {
    /// What is looked at.
    pub subject: &'a Subject,
    /// The ideal pictures: their start, and for oracles all of them.
    pub ideals: &'a Ideals,
    /// Of the picture.
    pub size: Size,
    /// Refreshes of the display per second.
    pub display_hz: u32,
    /// How many samples may be traced per second.
    pub samples_per_sec: f64,
    /// Of whatever is random.
    pub seed: u64,
}

impl Arena<'_> {
    /// Seconds from refresh to refresh.
    pub(crate) fn refresh_secs(&self) -> f64 {
        1.0 / f64::from(self.display_hz)
    }

    /// Seconds that a frame of so many samples takes.
    pub(crate) fn frame_secs(&self, samples: usize) -> f64 {
        samples as f64 / self.samples_per_sec
    }
}

/// Linear RGB as the display shows it.
pub(crate) fn encode(rgb: &[[f32; 3]]) -> Picture {
    let display = Display::default();
    rgb.iter().map(|&rgb| display.encode(rgb)).collect()
}
