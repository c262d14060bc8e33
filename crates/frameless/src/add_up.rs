//! Adds up what rests for samplers that do not: they name pixels, and three of four looks at one at rest take its next sample instead of
//! its first again.
//!
//! One look in four is at the centre as before, and finds change. So the mean of a picture at rest is that of three quarters of the
//! samples, and what changes is found a third of the time later.

use crate::{Canvas, Observation, Request};

/// One look in so many finds change.
const LOOKS_PER_CHECK: u32 = 4;

/// How often pixels at rest have been asked for.
#[derive(Default)]
pub(crate) struct AddUp {
    /// Which canvas, and how often a reconstruction had said what its pixels show.
    of: (u32, u64),
    looks: Vec<u32>,
    told: Vec<Observation>,
}

impl AddUp {
    /// Makes further samples of requests for pixels at rest that want them.
    pub(crate) fn turn(&mut self, canvas: &Canvas, requests: &mut [Request]) {
        let wanted = canvas.samples_wanted();
        if wanted == 0 {
            return;
        }
        self.look(canvas);
        for request in requests.iter_mut().filter(|request| request.sample_index == 0) {
            let n = canvas.samples()[request.pixel as usize];
            if n > 0 && n < wanted {
                let looks = &mut self.looks[request.pixel as usize];
                *looks += 1;
                if !looks.is_multiple_of(LOOKS_PER_CHECK) {
                    *request =
                        Request::in_sequence(request.pixel, *looks - *looks / LOOKS_PER_CHECK);
                }
            }
        }
    }

    fn look(&mut self, canvas: &Canvas) {
        let of = (canvas.generation(), canvas.updates());
        if std::mem::replace(&mut self.of, of) == of {
            return;
        }
        self.looks.resize(canvas.size().pixels(), 0);
        // Who has begun anew begins the sequence anew.
        for (looks, n) in self.looks.iter_mut().zip(canvas.samples()) {
            *looks = if *n > 1 { *looks } else { 0 };
        }
    }

    /// What the sampler is told: not of what was added, which says nothing of change.
    pub(crate) fn told<'a>(&'a mut self, observations: &'a [Observation]) -> &'a [Observation] {
        if observations.iter().all(|observed| observed.refinement.is_none()) {
            return observations;
        }
        self.told.clear();
        self.told.extend(observations.iter().filter(|observed| observed.refinement.is_none()));
        &self.told
    }
}
