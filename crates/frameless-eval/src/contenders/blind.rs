//! A sampler that learns nothing, shown by `hold`: the same pictures as [`Frameless`](super::Frameless) makes, bit for bit, without
//! tracing samples that are replaced before anybody sees them.
//!
//! Whom a sampler chooses does not depend on what is seen there, so that choosing can run ahead; at every refresh each
//! pixel that has been chosen is traced once, at the last of its times. At 64 times the sketch's rate a picture of 512×384 is chosen
//! five times over from refresh to refresh.

use frameless::{Answer, Batch, Clock, Engine, EngineError, Request, Sampler, Time, Tracer};

use crate::contender::{Arena, Contender, Shown, encode};
use crate::metrics::Picture;

pub(crate) struct Blind<'a> {
    arena: Arena<'a>,
    engine: Engine<Notes>,
    picture: Picture,
}

/// Notes what was asked for, and answers black.
struct Notes {
    answer: Option<Answer>,
    /// Scene time at which each pixel was chosen last; NaN if not since the last refresh.
    chosen_secs: Vec<f64>,
    chosen: Vec<u32>,
}

impl<'a> Blind<'a> {
    pub(crate) fn new(arena: Arena<'a>, sampler: Box<dyn Sampler>) -> Blind<'a> {
        let notes = Notes {
            answer: None,
            chosen_secs: vec![f64::NAN; arena.size.pixels()],
            chosen: Vec::new(),
        };
        let clock = Clock::simulated(arena.samples_per_sec);
        let engine = Engine::new(arena.size, clock, sampler, notes);
        Blind { arena, engine, picture: encode(&arena.ideals.start) }
    }

    fn trace_chosen(&mut self) {
        let Notes { chosen, chosen_secs, .. } = self.engine.tracer_mut();
        let mut pixels = std::mem::take(chosen);
        pixels.sort_by(|&a, &b| chosen_secs[a as usize].total_cmp(&chosen_secs[b as usize]));
        let batches = pixels.chunk_by(|&a, &b| chosen_secs[a as usize] == chosen_secs[b as usize]);
        for batch in batches {
            let secs = chosen_secs[batch[0] as usize];
            let requests: Vec<Request> =
                batch.iter().map(|&pixel| Request::centre(pixel)).collect();
            let rgb = self.arena.subject.trace(secs, self.arena.size, &requests);
            for (&pixel, rgb) in batch.iter().zip(encode(&rgb)) {
                self.picture[pixel as usize] = rgb;
            }
        }
        for &pixel in &pixels {
            chosen_secs[pixel as usize] = f64::NAN;
        }
        pixels.clear();
        *chosen = pixels;
    }
}

impl Contender for Blind<'_> {
    fn show(&mut self, time: Time, shown: &mut Shown) -> Result<(), EngineError> {
        self.engine.run_until(time)?;
        self.trace_chosen();
        shown.picture.clone_from(&self.picture);
        let traced = self.engine.canvas().time();
        shown.age_secs.clear();
        shown.age_secs.extend(traced.map(|traced| time.secs_since(traced) as f32));
        Ok(())
    }
}

impl Tracer for Notes {
    fn submit(&mut self, batch: Batch) {
        for request in &batch.requests {
            let secs = &mut self.chosen_secs[request.pixel as usize];
            if secs.is_nan() {
                self.chosen.push(request.pixel);
            }
            *secs = batch.scene_secs;
        }
        let black = vec![[0.0; 3]; batch.requests.len()];
        self.answer = Some(Answer::to(batch, black, Vec::new()));
    }

    fn collect(&mut self, _wait: bool) -> Option<Answer> {
        self.answer.take()
    }
}

#[cfg(test)]
mod tests {
    use frameless::{ReconstructionKind, SamplerKind};

    use super::*;
    use crate::contenders::Frameless;
    use crate::experiment::Experiment;
    use crate::ideal::{Ideals, refresh_time};
    use crate::subject::Subject;

    #[test]
    fn nobody_can_tell_it_from_tracing_everything() {
        let text = "title = \"blind\"\nsamples_per_sec = [1]\nwidth = 32\nheight = 24\nduration_secs = 0.6\n\
                    [[scenes]]\nscene = \"mix\"\n[output]\nvideo = false";
        let experiment = Experiment::parse(text, std::path::Path::new("")).expect("valid");
        let subject = Subject::load(&experiment.scenes[0]).expect("built in");
        let ideals = Ideals::trace(&subject, &experiment, &|| (), &|| false).expect("not stopped");
        for (kind, samples_per_sec) in [
            (SamplerKind::Random, 10_000.0),
            (SamplerKind::Random, 300_000.0),
            (SamplerKind::Permutation, 100_000.0),
        ] {
            let (subject, ideals, size) = (&subject, &ideals, experiment.size);
            let arena = Arena { subject, ideals, size, display_hz: 60, samples_per_sec, seed: 7 };
            let mut blind = Blind::new(arena, kind.build(7));
            let mut seeing = Frameless::new(arena, kind.build(7), ReconstructionKind::Hold);
            let (mut a, mut b) = (Shown::default(), Shown::default());
            for k in 0..experiment.refreshes {
                blind.show(refresh_time(k, 60), &mut a).expect("finite");
                seeing.show(refresh_time(k, 60), &mut b).expect("finite");
                assert!(a.picture == b.picture && a.age_secs == b.age_secs, "refresh {k}");
            }
        }
    }
}
