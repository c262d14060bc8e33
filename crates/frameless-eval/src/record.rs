//! What is written down about a run while it goes on.

use crate::contender::Shown;
use crate::experiment::Experiment;
use crate::ideal::{IdealEvent, Ideals, refresh_time};
use crate::metrics::{differ, flip, rmse, rmse_where, ssim};
use crate::results::{AtRest, Curve, EventResult, RunResult};
use crate::run::Cell;

/// A pixel has followed an event when no channel is farther from the ideal than this.
const FOLLOWED_WITHIN: f32 = 0.05;
/// An event has been followed when this part of the pixels that it changed have.
const FOLLOWED_PART: f64 = 0.9;
/// Which percentile tells of the bad moments: of values that are bad when high, and when low.
const HIGH_TAIL: f64 = 0.95;
const LOW_TAIL: f64 = 0.05;

/// The measurements of a run so far.
pub(crate) struct Record<'a> {
    experiment: &'a Experiment,
    ideals: &'a Ideals,
    rmse: Vec<f64>,
    rmse_changed: Vec<Option<f64>>,
    ssim: Vec<Option<f64>>,
    flip: Vec<Option<f64>>,
    age_secs: Vec<f64>,
    oldest_secs: f64,
    /// Per event, when it had been followed.
    followed_secs: Vec<Option<f64>>,
    rmse_at_rest: Vec<f64>,
}

impl<'a> Record<'a> {
    pub(crate) fn new(experiment: &'a Experiment, ideals: &'a Ideals) -> Record<'a> {
        Record {
            experiment,
            ideals,
            rmse: Vec::new(),
            rmse_changed: Vec::new(),
            ssim: Vec::new(),
            flip: Vec::new(),
            age_secs: Vec::new(),
            oldest_secs: 0.0,
            followed_secs: vec![None; ideals.events.len()],
            rmse_at_rest: Vec::new(),
        }
    }

    /// Measures what was shown at refresh `k`.
    pub(crate) fn add(&mut self, k: usize, shown: &Shown) {
        let (picture, ideal) = (&shown.picture, &self.ideals.pictures[k]);
        let (width, metrics) = (self.experiment.size.width as usize, self.experiment.metrics);
        let is_due = |every: usize| every > 0 && (k + 1).is_multiple_of(every);
        self.rmse.push(rmse(picture, ideal));
        self.rmse_changed.push(rmse_where(&self.ideals.changed[k], picture, ideal));
        if is_due(metrics.ssim_every) {
            self.ssim.push(ssim(ideal, picture, width));
        }
        if is_due(metrics.flip_every) {
            self.flip.push(Some(flip(ideal, picture, width)));
        }
        self.add_ages(k, &shown.age_secs);
        for (event, followed) in self.ideals.events.iter().zip(&mut self.followed_secs) {
            if followed.is_none()
                && event.refreshes.contains(&k)
                && has_followed(event, picture, ideal)
            {
                *followed = Some(refresh_time(k, self.experiment.display_hz).secs());
            }
        }
        if let Some(rest) = self.ideals.at_rest.as_ref().filter(|rest| k >= rest.since) {
            self.rmse_at_rest.push(rmse(picture, &rest.picture));
        }
    }

    fn add_ages(&mut self, k: usize, age_secs: &[f32]) {
        let sum: f64 = age_secs.iter().map(|&age| f64::from(age)).sum();
        self.age_secs.push(sum / age_secs.len() as f64);
        if k >= self.experiment.unscored {
            let oldest = age_secs.iter().fold(0.0, |a: f32, &b| a.max(b));
            self.oldest_secs = self.oldest_secs.max(f64::from(oldest));
        }
    }

    /// The run is over.
    pub(crate) fn finish(self, cell: &Cell) -> RunResult {
        let Experiment { size, display_hz, refreshes, unscored, metrics, .. } = *self.experiment;
        let curve = |values, tail| Curve::new(values, 1, unscored, tail);
        let events = self.ideals.events.iter().zip(self.followed_secs);
        let at_rest = self.ideals.at_rest.as_ref();
        RunResult {
            scene: cell.scene.clone(),
            algorithm: cell.algorithm.name(),
            samples_per_sec: cell.samples_per_sec,
            seed: cell.seed,
            width: size.width,
            height: size.height,
            display_hz,
            refreshes,
            psnr_db: Curve::psnr_db(&self.rmse, unscored),
            rmse: curve(self.rmse.into_iter().map(Some).collect(), HIGH_TAIL),
            rmse_changed: curve(self.rmse_changed, HIGH_TAIL),
            ssim: Curve::new(self.ssim, metrics.ssim_every, unscored, LOW_TAIL),
            flip: Curve::new(self.flip, metrics.flip_every, unscored, HIGH_TAIL),
            age_secs: curve(self.age_secs.into_iter().map(Some).collect(), HIGH_TAIL),
            oldest_secs: self.oldest_secs,
            events: events.map(|(event, followed)| event_result(event, followed)).collect(),
            at_rest: at_rest.map(|rest| AtRest {
                since_secs: refresh_time(rest.since, display_hz).secs(),
                rmse: self.rmse_at_rest,
            }),
        }
    }
}

fn has_followed(event: &IdealEvent, picture: &[[f32; 3]], ideal: &[[f32; 3]]) -> bool {
    let follows =
        |&&pixel: &&u32| !differ(&picture[pixel as usize], &ideal[pixel as usize], FOLLOWED_WITHIN);
    let following = event.changed.iter().filter(follows).count();
    following > 0 && following as f64 >= FOLLOWED_PART * event.changed.len() as f64
}

fn event_result(event: &IdealEvent, followed_secs: Option<f64>) -> EventResult {
    let complete_secs = event.spec.complete_secs();
    EventResult {
        name: event.spec.name.clone(),
        secs: event.spec.at_secs,
        changed_pixels: event.changed.len(),
        // A refresh may lie a nanosecond before the event that it shows.
        latency_secs: followed_secs.map(|secs| (secs - complete_secs).max(0.0)),
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::experiment::EventSpec;

    #[test]
    fn latency_by_hand() {
        // Ten pixels, all of which an event at refresh 3 turns from black to white.
        let text = "title = \"t\"\nsamples_per_sec = [1]\nwidth = 5\nheight = 2\nduration_secs = 0.2\n\
                    unscored_secs = 0\n[output]\nvideo = false\n[[scenes]]\nscene = \"sphere\"";
        let experiment = Experiment::parse(text, Path::new("")).expect("valid");
        let picture = |white: usize| -> Vec<[f32; 3]> {
            (0..10).map(|pixel| [if pixel < white { 0.951 } else { 0.0 }; 3]).collect()
        };
        let spec = EventSpec { at_secs: 4.0 / 60.0, name: "it".into(), action: None };
        let changed = (0..10).collect();
        let ideals = Ideals {
            start: picture(0),
            pictures: (0..12).map(|k| vec![[if k < 3 { 0.0 } else { 1.0 }; 3]; 10]).collect(),
            changed: vec![vec![false; 10]; 12],
            events: vec![IdealEvent { spec, changed, refreshes: 3..12 }],
            at_rest: None,
        };
        let mut record = Record::new(&experiment, &ideals);
        for (k, white) in [0, 0, 10, 0, 8, 9, 10, 10, 10, 10, 10, 10].into_iter().enumerate() {
            record.add(k, &Shown { picture: picture(white), age_secs: vec![k as f32; 10] });
        }
        let cell = Cell {
            scene: "sphere".into(),
            algorithm: crate::Algorithm::Framed,
            samples_per_sec: 1.0,
            seed: 1,
        };
        let result = record.finish(&cell);
        let latency_secs = result.events[0].latency_secs.expect("followed");
        assert!((latency_secs - 2.0 / 60.0).abs() < 1e-8, "{latency_secs}");
        assert_eq!((result.events[0].changed_pixels, result.oldest_secs), (10, 11.0));
        assert_eq!(result.age_secs.values, (0..12).map(|k| Some(f64::from(k))).collect::<Vec<_>>());
        // Equal pictures have no PSNR, and pictures of 5×2 pixels no SSIM.
        assert_eq!((result.psnr_db.values[0], result.rmse.values[0]), (None, Some(0.0)));
        assert!(result.psnr_db.mean.is_some() && result.rmse_changed.mean.is_none());
        assert_eq!((result.ssim.values, result.ssim.mean), (vec![], None));
    }
}
