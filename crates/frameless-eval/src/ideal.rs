//! The hypothetical instantaneous renderer: the whole picture at exactly each refresh's time, and what follows from it.

use std::sync::Arc;

use frameless::{Display, Request, Rng, Size, Time};
use rayon::prelude::*;

use crate::contender::encode;
use crate::experiment::{Action, EventSpec, Experiment};
use crate::metrics::{Picture, changed_region};
use crate::subject::Subject;

/// The ideal pictures of one scene.
pub struct Ideals {
    /// Linear RGB at time 0: every algorithm starts from it.
    pub start: Vec<[f32; 3]>,
    /// Display-referred sRGB at every refresh.
    pub pictures: Arc<[Picture]>,
    /// Per refresh: where the ideal has changed within [`CHANGED_WITHIN_SECS`].
    pub changed: Vec<Vec<bool>>,
    /// The scene's events, by time.
    pub events: Vec<IdealEvent>,
    /// The picture at rest; `None` if something moves until the end.
    pub at_rest: Option<IdealAtRest>,
}

/// What an event changes.
pub struct IdealEvent {
    /// Which one, and when.
    pub spec: EventSpec,
    /// The pixels that look different because of it, by number.
    pub changed: Vec<u32>,
    /// The refreshes at which somebody may be looked at who has not followed yet: from when the change is complete until the
    /// next event.
    pub refreshes: std::ops::Range<usize>,
}

/// What a renderer with all the time in the world would show once nothing moves any more.
pub struct IdealAtRest {
    /// The first refresh from which on nothing moves.
    pub since: usize,
    /// Display-referred sRGB, the mean of [`SAMPLES_AT_REST`] linear samples per pixel.
    pub picture: Picture,
}

/// How long a change counts as recent, for the RMSE over the changed region and for events that stop something.
const CHANGED_WITHIN_SECS: f64 = 0.1;

/// Samples per pixel of the picture at rest, in as many equal squares.
const SAMPLES_AT_REST: u32 = ROWS_AT_REST * ROWS_AT_REST;
const ROWS_AT_REST: u32 = 8;

/// Time of refresh `k`: (k + 1) / `display_hz`, rounded down like the clock's times, so that a batch that begins at a refresh
/// comes after it.
pub fn refresh_time(k: usize, display_hz: u32) -> Time {
    Time((k as u64 + 1) * 1_000_000_000 / u64::from(display_hz))
}

impl Ideals {
    /// Traces them on all cores; `done` is called after each refresh's picture. `None` if `stop` said so.
    pub fn trace(
        subject: &Subject,
        experiment: &Experiment,
        done: &(dyn Fn() + Sync),
        stop: &(dyn Fn() -> bool + Sync),
    ) -> Option<Ideals> {
        let size = experiment.size;
        let trace = |k: usize| {
            if stop() {
                return None;
            }
            let linear = subject.ideal(refresh_time(k, experiment.display_hz).secs(), size);
            done();
            Some(encode(&linear))
        };
        let pictures: Arc<[Picture]> =
            (0..experiment.refreshes).into_par_iter().map(trace).collect::<Option<_>>()?;
        let within = (CHANGED_WITHIN_SECS * f64::from(experiment.display_hz)).round() as usize;
        let changed = (0..pictures.len()).into_par_iter().map(|k| {
            let recent = pictures[k.saturating_sub(within)..k].iter().map(|p| &p[..]);
            changed_region(recent, &pictures[k])
        });
        let changed = changed.collect();
        let events = trace_events(subject, experiment, stop)?;
        let at_rest = match still_since(subject, experiment) {
            Some(since) => Some(trace_at_rest(subject, experiment, since, stop)?),
            None => None,
        };
        Some(Ideals { start: subject.ideal(0.0, size), changed, pictures, events, at_rest })
    }
}

fn trace_events(
    subject: &Subject,
    experiment: &Experiment,
    stop: &(dyn Fn() -> bool + Sync),
) -> Option<Vec<IdealEvent>> {
    let events = subject.events();
    let first_refresh_at = |secs: f64| {
        // Refreshes are rounded down by up to a nanosecond.
        let is_before = |k: &usize| refresh_time(*k, experiment.display_hz).secs() + 1e-9 < secs;
        (0..experiment.refreshes).take_while(is_before).count()
    };
    let trace = |index: usize| {
        if stop() {
            return None;
        }
        let spec = events[index].clone();
        let next = events.iter().find(|other| other.at_secs > spec.at_secs);
        let end = next.map_or(experiment.refreshes, |next| first_refresh_at(next.at_secs));
        let first = first_refresh_at(spec.complete_secs());
        let changed = pixels_changed_by(subject, index, experiment.size);
        Some(IdealEvent { spec, changed, refreshes: first..end.max(first) })
    };
    (0..events.len()).into_par_iter().map(trace).collect()
}

/// The pixels whose ideal differs by more than 0.04 in a channel: with the event, when it is complete, from without it. What
/// stops, and what the scene does by itself, cannot be taken away: there, from the ideal 100 ms earlier.
fn pixels_changed_by(subject: &Subject, index: usize, size: Size) -> Vec<u32> {
    let event = &subject.events()[index];
    let secs = event.complete_secs();
    let before = match event.action {
        None | Some(Action::Stop) => subject.ideal((secs - CHANGED_WITHIN_SECS).max(0.0), size),
        Some(_) => subject.without_event(index).ideal(secs, size),
    };
    let (before, after) = (encode(&before), encode(&subject.ideal(secs, size)));
    let changed = changed_region([&before[..]], &after);
    (0..size.pixels() as u32).filter(|&pixel| changed[pixel as usize]).collect()
}

/// The first refresh from which on nothing moves; `None` if something does between the last two.
fn still_since(subject: &Subject, experiment: &Experiment) -> Option<usize> {
    let secs = |k: usize| refresh_time(k, experiment.display_hz).secs();
    let last = experiment.refreshes - 1;
    let is_still = |k: &usize| subject.is_still(secs(*k), secs(last));
    let still = (0..last).rev().take_while(is_still).count();
    (still > 0).then_some(last - still)
}

/// The mean of one sample at a random place in each of 8×8 squares of every pixel. The places are the same for every algorithm and
/// in every run.
fn trace_at_rest(
    subject: &Subject,
    experiment: &Experiment,
    since: usize,
    stop: &(dyn Fn() -> bool + Sync),
) -> Option<IdealAtRest> {
    let (size, display) = (experiment.size, Display::default());
    let secs = refresh_time(since, experiment.display_hz).secs();
    let trace_row = |y: u32| {
        if stop() {
            return None;
        }
        let pixels = size.index(0, y)..size.index(0, y) + size.width;
        let requests: Vec<Request> = pixels.flat_map(stratified).collect();
        let rgb = subject.trace(secs, size, &requests);
        let mean = |samples: &[[f32; 3]]| -> [f32; 3] {
            let sum = |k: usize| samples.iter().map(|rgb| rgb[k]).sum::<f32>();
            display.encode(std::array::from_fn(|k| sum(k) / samples.len() as f32))
        };
        Some(rgb.chunks_exact(SAMPLES_AT_REST as usize).map(mean).collect())
    };
    let rows: Vec<Picture> =
        (0..size.height).into_par_iter().map(trace_row).collect::<Option<_>>()?;
    Some(IdealAtRest { since, picture: rows.concat() })
}

fn stratified(pixel: u32) -> impl Iterator<Item = Request> {
    let mut rng = Rng::new(u64::from(pixel));
    (0..SAMPLES_AT_REST).map(move |i| {
        let mut place = |square: u32| (square as f32 + rng.unit_f32()) / ROWS_AT_REST as f32 - 0.5;
        let x = place(i % ROWS_AT_REST);
        Request { pixel, offset: [x, place(i / ROWS_AT_REST)], sample_index: i }
    })
}

#[cfg(test)]
mod tests {
    use frameless::{BATCHES_PER_SEC, Clock, Engine, Function, SamplerKind};

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

    #[test]
    fn each_square_of_a_pixel_has_one_sample() {
        let mut counts = [0; SAMPLES_AT_REST as usize];
        for Request { pixel, offset, .. } in stratified(7) {
            assert_eq!(pixel, 7);
            let [x, y] = offset.map(|o| ((o + 0.5) * ROWS_AT_REST as f32) as usize);
            counts[y * ROWS_AT_REST as usize + x] += 1;
        }
        assert_eq!(counts, [1; SAMPLES_AT_REST as usize]);
    }
}
