//! Experiments: what is compared, read from TOML and checked once.
//!
//! ```toml
//! title = "The sketch's figures"
//! algorithms = ["random", "change", "adaptive+reproject"]   # default: these three
//! samples_per_sec = [900_000]
//! seeds = [1]                                         # default
//! width = 512                                         # default
//! height = 384                                        # default
//! display_hz = 60                                     # default
//! duration_secs = 2.5                                 # default
//! unscored_secs = 0.5                                 # default: the start is not scored
//!
//! [[scenes]]
//! scene = "sphere"        # built-in, or a glTF file relative to this file's folder
//! name = "sphere"         # default: the scene's own name
//! # camera = { orbit = { target = [0, 1, 0], radius = 4, height = 1, degrees_per_sec = 30 } }
//! # camera = { keyframes = [{ time = 0, eye = [0, 1, 4], target = [0, 1, 0] }, …], yfov_degrees = 50 }
//!
//! [[scenes.events]]       # what happens suddenly: how long does each algorithm take to follow?
//! at_secs = 1.0           # after the start, before the end
//! name = "lamp off"       # unique in the scene; without an action it names what the scene itself does then
//! light = { index = 0, factor = 0.0 }     # at most one of: light = …, and
//! # move = { node = "box", by = [0.1, 0, 0], over_secs = 0.5 }   # or light = 0 for node, to = […] for by
//! # cut = { eye = [0, 1, 4], target = [0, 1, 0] }
//! # stop = true           # scene and camera path stand still from then on
//!
//! [metrics]               # SSIM and FLIP at every so many-th refresh; 0: not at all
//! ssim_every = 15         # default
//! flip_every = 15         # default
//!
//! [output]
//! stills_secs = [1.0]     # which instants are shown as pictures
//! show = ["random", "change", "ideal"]   # side by side, in stills and video; default: everything
//! video = true            # default
//!
//! [equal_quality]         # how many times more samples/s does each opponent need for the same mean RMSE? default: not asked
//! algorithms = ["change"]             # whose quality is to be reached; all of them among the algorithms above
//! opponents = ["random"]              # who needs more; likewise
//! max_factor = 64                     # default: the opponent's rate is scanned up to so many times the algorithm's
//! ```
//!
//! Unknown keys are refused.

use std::path::{Path, PathBuf};

use frameless::Size;

use crate::algorithm::Algorithm;
use crate::camera_path::CameraPath;
use crate::error::EvalError;

mod check;
mod event;
mod file;

pub use event::{Action, EventSpec, Goal, Mover};

/// A checked experiment.
#[derive(Clone, Debug)]
pub struct Experiment {
    /// For people.
    pub title: String,
    /// What is looked at; at least one.
    pub scenes: Vec<SceneSpec>,
    /// Who competes; at least one.
    pub algorithms: Vec<Algorithm>,
    /// Samples per second, positive; at least one.
    pub samples_per_sec: Vec<f64>,
    /// At least one.
    pub seeds: Vec<u64>,
    /// In pixels.
    pub size: Size,
    /// Refreshes of the display per second.
    pub display_hz: u32,
    /// Refreshes in a run; refresh k is at (k + 1) / display_hz.
    pub refreshes: usize,
    /// The first so many refreshes are not scored.
    pub unscored: usize,
    /// Instants shown as stills, as refresh indices.
    pub stills: Vec<usize>,
    /// Names shown side by side in stills and video; "ideal" among them.
    pub show: Vec<String>,
    /// Whether videos are made.
    pub video: bool,
    /// How often the costly metrics are taken.
    pub metrics: MetricsSpec,
    /// Who is compared at equal quality; `None` if nobody.
    pub equal_quality: Option<EqualQualitySpec>,
}

/// How many times more samples per second does each opponent need for the mean RMSE of each algorithm?
#[derive(Clone, Debug, PartialEq)]
pub struct EqualQualitySpec {
    /// Whose quality is to be reached: some of [`Experiment::algorithms`], at least one.
    pub algorithms: Vec<Algorithm>,
    /// Who needs more: some of [`Experiment::algorithms`], at least one.
    pub opponents: Vec<Algorithm>,
    /// The opponent's rate is scanned up to so many times the algorithm's; more than 1.
    pub max_factor: f64,
}

/// How often SSIM and FLIP are taken, which cost more than tracing the picture: at every so many-th refresh; 0: never.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MetricsSpec {
    /// Refreshes from one SSIM to the next.
    pub ssim_every: usize,
    /// Refreshes from one FLIP to the next.
    pub flip_every: usize,
}

impl MetricsSpec {
    /// Neither SSIM nor FLIP: for runs of which only the error counts.
    pub const ERROR_ONLY: MetricsSpec = MetricsSpec { ssim_every: 0, flip_every: 0 };
}

/// A scene of an experiment.
#[derive(Clone, Debug)]
pub struct SceneSpec {
    /// Unique in the experiment; made of letters, digits, `-` and `_`, since files are named after it.
    pub name: String,
    /// Where it comes from.
    pub source: SceneSource,
    /// A camera of the experiment's own; otherwise the scene's first.
    pub camera: Option<CameraPath>,
    /// What happens suddenly, by time.
    pub events: Vec<EventSpec>,
}

/// Where a scene comes from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum SceneSource {
    /// One of [`frameless_scene::BUILTIN_NAMES`].
    Builtin(String),
    /// A glTF file.
    File(PathBuf),
}

/// The name of the ideal instantaneous renderer in `show`, stills and videos.
pub const IDEAL: &str = "ideal";

impl Experiment {
    /// The same without the costly metrics.
    pub(crate) fn with_error_only(&self) -> Experiment {
        Experiment { metrics: MetricsSpec::ERROR_ONLY, ..self.clone() }
    }

    /// Reads and checks an experiment file. Scene files are found relative to its folder; they are not opened yet.
    ///
    /// # Errors
    /// If the file cannot be read, is not TOML, has an unknown key, or asks for something impossible; the message
    /// names the file and the line or key.
    pub fn read(path: &Path) -> Result<Experiment, EvalError> {
        let text = std::fs::read_to_string(path)
            .map_err(|source| EvalError::Unreadable { path: path.to_path_buf(), source })?;
        let folder = path.parent().unwrap_or(Path::new(""));
        Experiment::parse(&text, folder)
            .map_err(|message| EvalError::Invalid { path: path.to_path_buf(), message })
    }

    /// As [`Experiment::read`], from text. The error says what is wrong and where in the text.
    pub fn parse(text: &str, folder: &Path) -> Result<Experiment, String> {
        let file: file::ExperimentFile = toml::from_str(text).map_err(|error| {
            let before = error.span().map_or("", |span| &text[..span.start]);
            let line = before.matches('\n').count() + 1;
            let column = before.chars().rev().take_while(|&c| c != '\n').count() + 1;
            format!("line {line}, column {column}: {}", error.message())
        })?;
        check::check(file, folder)
    }
}
