//! The pictures of a scene at one rate: everybody side by side at the same instants, still and moving.
//!
//! The algorithms run once more, refresh by refresh beside each other, so that no more than a few pictures of each are in memory at
//! a time.

use std::path::Path;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};

use frameless::Display;

use super::cells::SceneKey;
use super::cost;
use super::progress::Work;
use super::store::Key;
use super::versions::versioned;
use crate::algorithm::Algorithm;
use crate::contender::{Arena, Shown};
use crate::error::EvalError;
use crate::experiment::{Experiment, IDEAL};
use crate::ideal::{Ideals, refresh_time};
use crate::metrics::Picture;
use crate::output::{Rgb8, Strip, Video, write_panel, write_still};
use crate::subject::Subject;

/// Pictures are made at one rate, the one in the middle (the lower of two): neither all alike nor all hopeless.
pub(crate) fn pictured_rate(experiment: &Experiment) -> f64 {
    let mut rates = experiment.samples_per_sec.clone();
    rates.sort_by(f64::total_cmp);
    rates[(rates.len() - 1) / 2]
}

/// The refreshes at which the report shows everybody: the experiment's stills, or else the middle of what is scored.
pub(crate) fn pictured_refreshes(experiment: &Experiment) -> Vec<usize> {
    if experiment.stills.is_empty() {
        return vec![(experiment.unscored + experiment.refreshes) / 2];
    }
    experiment.stills.clone()
}

/// Everything that the pictures depend on.
pub(super) fn key(experiment: &Experiment, scene: &SceneKey) -> Key {
    let names: Vec<String> = experiment.algorithms.iter().map(versioned).collect();
    scene.pictures(&format!(
        "at {} samples/s, seed {}, of {} at {:?}; {} stills and {} of {}",
        pictured_rate(experiment),
        experiment.seeds[0],
        names.join(", "),
        pictured_refreshes(experiment),
        experiment.stills.len(),
        if experiment.video { "a video" } else { "no video" },
        experiment.show.join(" "),
    ))
}

/// The work of making them.
pub(super) fn cost(experiment: &Experiment) -> u64 {
    let of_one = |algorithm: &Algorithm| {
        let refresh = cost::pictured_refresh(experiment, algorithm, pictured_rate(experiment));
        end(experiment, algorithm) as u64 * refresh
    };
    experiment.algorithms.iter().map(of_one).sum()
}

/// After this many refreshes nobody wants a picture of `algorithm` any more.
fn end(experiment: &Experiment, algorithm: &Algorithm) -> usize {
    if experiment.video && experiment.show.contains(&algorithm.name()) {
        return experiment.refreshes;
    }
    pictured_refreshes(experiment).iter().max().map_or(0, |last| last + 1)
}

/// Writes `video.mp4`, a strip per still and a panel per algorithm and pictured refresh into `folder`.
///
/// # Errors
/// If a picture cannot be traced or written, or `work` is to stop.
pub(super) fn make(
    experiment: &Experiment,
    subject: &Subject,
    ideals: &Ideals,
    folder: &Path,
    work: &Work,
) -> Result<(), EvalError> {
    let arena = Arena {
        subject,
        ideals,
        size: experiment.size,
        display_hz: experiment.display_hz,
        samples_per_sec: pictured_rate(experiment),
        seed: experiment.seeds[0],
    };
    let mut album = Album::new(experiment, folder)?;
    std::thread::scope(|scope| {
        let play_one = |algorithm: &'_ Algorithm| {
            let (sender, receiver) = sync_channel(1);
            let (algorithm, end) = (algorithm.clone(), end(experiment, algorithm));
            scope.spawn(move || play(&algorithm, arena, end, &sender));
            (end, receiver)
        };
        let players: Vec<(usize, Receiver<_>)> =
            experiment.algorithms.iter().map(play_one).collect();
        let last = players.iter().map(|(end, _)| *end).max().unwrap_or(0);
        for k in 0..last {
            if work.should_stop() {
                return Err(EvalError::Interrupted);
            }
            let mut pictures = Vec::with_capacity(players.len());
            for (algorithm, (end, player)) in experiment.algorithms.iter().zip(&players) {
                if k < *end {
                    // A player that has ended without a word has panicked, which the scope passes on.
                    pictures.push(player.recv().ok().transpose()?);
                    work.advance(cost::pictured_refresh(
                        experiment,
                        algorithm,
                        arena.samples_per_sec,
                    ));
                } else {
                    pictures.push(None);
                }
            }
            album.add(k, &rgb8(&ideals.pictures[k]), &pictures)?;
        }
        album.finish()
    })
}

/// Sends what `algorithm` shows at the first `end` refreshes, until nobody listens any more.
fn play(
    algorithm: &Algorithm,
    arena: Arena,
    end: usize,
    pictures: &SyncSender<Result<Rgb8, EvalError>>,
) {
    let mut contender = algorithm.contender(arena);
    let mut shown = Shown::default();
    for k in 0..end {
        let outcome = contender.show(refresh_time(k, arena.display_hz), &mut shown);
        let has_failed = outcome.is_err();
        let picture = outcome.map(|()| rgb8(&shown.picture)).map_err(EvalError::from);
        if pictures.send(picture).is_err() || has_failed {
            return;
        }
    }
}

fn rgb8(picture: &Picture) -> Rgb8 {
    picture.iter().map(|c| c.map(Display::quantize)).collect()
}

/// What becomes of the pictures.
struct Album<'a> {
    experiment: &'a Experiment,
    folder: &'a Path,
    names: Vec<String>,
    refreshes: Vec<usize>,
    strip: Strip,
    video: Option<Video>,
}

impl<'a> Album<'a> {
    fn new(experiment: &'a Experiment, folder: &'a Path) -> Result<Album<'a>, EvalError> {
        let strip = Strip::new(experiment.size, &experiment.show);
        let create = || Video::create(&folder.join(VIDEO), strip.size(), experiment.display_hz);
        let video = experiment.video.then(create).transpose()?;
        let names = experiment.algorithms.iter().map(Algorithm::name).collect();
        let refreshes = pictured_refreshes(experiment);
        Ok(Album { experiment, folder, names, refreshes, strip, video })
    }

    /// Everybody's pictures at refresh `k`, in the order of the algorithms; `None` of those that are not wanted any more.
    fn add(&mut self, k: usize, ideal: &Rgb8, pictures: &[Option<Rgb8>]) -> Result<(), EvalError> {
        if self.refreshes.contains(&k) {
            let size = self.experiment.size;
            write_panel(&self.folder.join(panel_name(k, None)), size, ideal, ideal)?;
            for (i, picture) in pictures.iter().enumerate() {
                if let Some(picture) = picture {
                    write_panel(&self.folder.join(panel_name(k, Some(i))), size, picture, ideal)?;
                }
            }
        }
        let is_still = self.experiment.stills.contains(&k);
        if !is_still && self.video.is_none() {
            return Ok(());
        }
        let shown = self.experiment.show.iter().filter_map(|name| match name.as_str() {
            IDEAL => Some(ideal),
            name => pictures[self.names.iter().position(|known| known == name)?].as_ref(),
        });
        let image = self.strip.assemble(shown);
        if is_still {
            write_still(&self.folder.join(still_name(self.experiment, k)), &image)?;
        }
        match &mut self.video {
            Some(video) => video.push(&image),
            None => Ok(()),
        }
    }

    fn finish(self) -> Result<(), EvalError> {
        self.video.map_or(Ok(()), Video::finish)
    }
}

/// The file of the video.
pub(crate) const VIDEO: &str = "video.mp4";

/// The file of the still at refresh `k`: `1000ms.png` at 1 s.
pub(crate) fn still_name(experiment: &Experiment, k: usize) -> String {
    format!("{}ms.png", refresh_time(k, experiment.display_hz).0 / 1_000_000)
}

/// The file of one algorithm's picture and error at refresh `k`, or of the ideal's.
pub(crate) fn panel_name(k: usize, algorithm: Option<usize>) -> String {
    match algorithm {
        Some(i) => format!("panel-{k}-{i}"),
        None => format!("panel-{k}-{IDEAL}"),
    }
}
