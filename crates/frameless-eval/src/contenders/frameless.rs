//! A frameless sampler with one of the reconstructions.

use frameless::{
    Answer, Canvas, Clock, Engine, EngineError, ReconstructionKind, Request, Sampler, Time,
};

use crate::contender::{Arena, Contender, Shown};
use crate::subject::SubjectTracer;

/// The product itself, on the simulated clock.
pub(crate) struct Frameless<'a> {
    engine: Engine<SubjectTracer<'a>>,
    started: Option<EngineError>,
}

impl<'a> Frameless<'a> {
    pub(crate) fn new(
        arena: Arena<'a>,
        sampler: Box<dyn Sampler>,
        reconstruction: ReconstructionKind,
    ) -> Frameless<'a> {
        let canvas = Canvas::from_picture(arena.size, arena.ideals.start.clone());
        let clock = Clock::simulated(arena.samples_per_sec);
        let surfaces =
            !matches!(reconstruction, ReconstructionKind::Hold | ReconstructionKind::Filter);
        let tracer = arena.subject.tracer(surfaces);
        let mut engine = Engine::with_canvas(canvas, clock, sampler, tracer);
        engine.set_reconstruction(reconstruction.build());
        let mut started = None;
        if surfaces {
            // Everybody starts with the whole picture at time 0; whoever uses surfaces knows those, too.
            let requests: Vec<Request> =
                (0..arena.size.pixels() as u32).map(Request::centre).collect();
            let (rgb, surfaces) = arena.subject.trace_surfaces(0.0, arena.size, &requests);
            let (now, size) = (Time::ZERO, arena.size);
            let start = Answer { batch: 0, now, scene_secs: 0.0, size, requests, rgb, surfaces };
            started = engine.start_with(&start).err();
        }
        Frameless { engine, started }
    }
}

impl Contender for Frameless<'_> {
    fn show(&mut self, time: Time, shown: &mut Shown) -> Result<(), EngineError> {
        if let Some(error) = self.started.take() {
            return Err(error);
        }
        self.engine.run_until(time)?;
        shown.picture.clear();
        shown.picture.extend_from_slice(self.engine.refresh(time));
        let traced = self.engine.canvas().time();
        shown.age_secs.clear();
        shown.age_secs.extend(traced.map(|traced| time.secs_since(traced) as f32));
        Ok(())
    }
}
