//! A frameless sampler shown by `hold`.

use frameless::{Canvas, Clock, Engine, EngineError, Sampler, Time};

use crate::contender::{Arena, Contender};
use crate::metrics::Picture;
use crate::subject::SubjectTracer;

/// The product itself, on the simulated clock.
pub(crate) struct Frameless<'a> {
    engine: Engine<SubjectTracer<'a>>,
}

impl<'a> Frameless<'a> {
    pub(crate) fn new(arena: Arena<'a>, sampler: Box<dyn Sampler>) -> Frameless<'a> {
        let canvas = Canvas::from_picture(arena.size, arena.ideals.start.clone());
        let clock = Clock::simulated(arena.samples_per_sec);
        Frameless {
            engine: Engine::with_canvas(canvas, clock, sampler, arena.subject.tracer(false)),
        }
    }
}

impl Contender for Frameless<'_> {
    fn show(&mut self, time: Time, picture: &mut Picture) -> Result<(), EngineError> {
        self.engine.run_until(time)?;
        let (rgb, display) = (self.engine.canvas().rgb(), self.engine.display());
        picture.clear();
        picture.extend(rgb.iter().map(|&rgb| display.encode(rgb)));
        Ok(())
    }
}
