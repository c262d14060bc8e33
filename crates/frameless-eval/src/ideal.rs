//! The hypothetical instantaneous renderer: the whole picture at exactly each refresh's time.

use frameless::{Display, Time};
use rayon::prelude::*;

use crate::experiment::Experiment;
use crate::metrics::{Picture, changed_region};
use crate::subject::Subject;

/// The ideal pictures of one scene.
pub struct Ideals {
    /// Linear RGB at time 0: every algorithm starts from it.
    pub start: Vec<[f32; 3]>,
    /// Display-referred sRGB at every refresh.
    pub pictures: Vec<Picture>,
    /// Per refresh: where the ideal has changed within [`CHANGED_WITHIN_SECS`].
    pub changed: Vec<Vec<bool>>,
}

/// How long a change counts as recent, for the RMSE over the changed region.
const CHANGED_WITHIN_SECS: f64 = 0.1;

/// Time of refresh `k`: (k + 1) / `display_hz`, rounded down like the clock's times, so that a batch that begins at a refresh
/// comes after it.
pub fn refresh_time(k: usize, display_hz: u32) -> Time {
    Time((k as u64 + 1) * 1_000_000_000 / u64::from(display_hz))
}

impl Ideals {
    /// Traces them on all cores; `done` is called after each picture. `None` if `stop` said so.
    pub fn trace(
        subject: &Subject,
        experiment: &Experiment,
        done: &(dyn Fn() + Sync),
        stop: &(dyn Fn() -> bool + Sync),
    ) -> Option<Ideals> {
        let size = experiment.size;
        let display = Display::default();
        let trace = |k: usize| {
            if stop() {
                return None;
            }
            let secs = refresh_time(k, experiment.display_hz).secs();
            let linear = subject.ideal(secs, size);
            done();
            Some(linear.into_iter().map(|rgb| display.encode(rgb)).collect())
        };
        let pictures: Vec<Picture> =
            (0..experiment.refreshes).into_par_iter().map(trace).collect::<Option<_>>()?;
        let within = (CHANGED_WITHIN_SECS * f64::from(experiment.display_hz)).round() as usize;
        let changed = (0..pictures.len()).into_par_iter().map(|k| {
            let recent = pictures[k.saturating_sub(within)..k].iter().map(|p| &p[..]);
            changed_region(recent, &pictures[k])
        });
        let changed = changed.collect();
        Some(Ideals { start: subject.ideal(0.0, size), changed, pictures })
    }
}

#[cfg(test)]
mod tests {
    use frameless::{BATCHES_PER_SEC, Clock, Engine, Function, SamplerKind, Size};

    use super::*;

    #[test]
    fn no_sample_is_traced_at_or_after_the_refresh_that_shows_it() {
        let per_refresh = u64::from(BATCHES_PER_SEC / 60);
        let black = Function::new(|batch: &frameless::Batch| vec![[0.0; 3]; batch.requests.len()]);
        let (clock, sampler) = (Clock::simulated(96_000.0), SamplerKind::Random.build(1));
        let mut engine = Engine::new(Size::new(8, 8), clock, sampler, black);
        for k in 0..150 {
            engine.run_until(refresh_time(k, 60)).expect("black is finite");
            assert_eq!(engine.counters().batches, (k as u64 + 1) * per_refresh, "refresh {k}");
        }
    }
}
