//! A frameless sampler shown by `hold`.

use frameless::{Canvas, Clock, Engine, EngineError, Sampler, Time};

use crate::contender::{Arena, Contender, Shown};
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
    fn show(&mut self, time: Time, shown: &mut Shown) -> Result<(), EngineError> {
        self.engine.run_until(time)?;
        let (canvas, display) = (self.engine.canvas(), self.engine.display());
        shown.picture.clear();
        shown.picture.extend(canvas.rgb().iter().map(|&rgb| display.encode(rgb)));
        shown.age_secs.clear();
        shown.age_secs.extend(canvas.time().iter().map(|&traced| time.secs_since(traced) as f32));
        Ok(())
    }
}
