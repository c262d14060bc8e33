//! Experiments: what is compared, read from TOML and checked once.
//!
//! ```toml
//! title = "The sketch's figures"
//! algorithms = ["random", "permutation", "change"]   # default: these three
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
use serde::Deserialize;

use crate::algorithm::Algorithm;
use crate::camera_path::{CameraPath, CameraSpec};
use crate::error::EvalError;
use crate::output::strip_size;

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

/// A scene of an experiment.
#[derive(Clone, Debug)]
pub struct SceneSpec {
    /// Unique in the experiment; made of letters, digits, `-` and `_`, since files are named after it.
    pub name: String,
    /// Where it comes from.
    pub source: SceneSource,
    /// A camera of the experiment's own; otherwise the scene's first.
    pub camera: Option<CameraPath>,
}

/// Where a scene comes from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum SceneSource {
    /// One of [`frameless_scene::BUILTIN_NAMES`].
    Builtin(String),
    /// A glTF file.
    File(PathBuf),
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ExperimentFile {
    title: String,
    #[serde(default = "default_algorithms")]
    algorithms: Vec<String>,
    samples_per_sec: Vec<f64>,
    #[serde(default = "default_seeds")]
    seeds: Vec<u64>,
    #[serde(default = "default_width")]
    width: u32,
    #[serde(default = "default_height")]
    height: u32,
    #[serde(default = "default_display_hz")]
    display_hz: u32,
    #[serde(default = "default_duration_secs")]
    duration_secs: f64,
    #[serde(default = "default_unscored_secs")]
    unscored_secs: f64,
    scenes: Vec<SceneTable>,
    #[serde(default)]
    output: OutputTable,
    equal_quality: Option<EqualQualityTable>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct SceneTable {
    scene: String,
    name: Option<String>,
    camera: Option<CameraSpec>,
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct OutputTable {
    #[serde(default)]
    stills_secs: Vec<f64>,
    #[serde(default)]
    show: Vec<String>,
    video: Option<bool>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct EqualQualityTable {
    algorithms: Vec<String>,
    opponents: Vec<String>,
    #[serde(default = "default_max_factor")]
    max_factor: f64,
}

fn default_max_factor() -> f64 {
    64.0
}
fn default_algorithms() -> Vec<String> {
    ["random", "permutation", "change"].map(String::from).to_vec()
}
fn default_seeds() -> Vec<u64> {
    vec![1]
}
fn default_width() -> u32 {
    512
}
fn default_height() -> u32 {
    384
}
fn default_display_hz() -> u32 {
    60
}
fn default_duration_secs() -> f64 {
    2.5
}
fn default_unscored_secs() -> f64 {
    0.5
}

// Least side, largest width and largest height of a video: the limits of the H.264 encoder, a little above its least.
const VIDEO_SIDES: (u32, u32, u32) = (64, 3840, 2160);

/// The name of the ideal instantaneous renderer in `show`, stills and videos.
pub const IDEAL: &str = "ideal";

// A picture of 16,384² pixels as f32 RGB takes 3 GiB; beyond that nobody means it.
const LARGEST_SIDE: u32 = 16_384;
const LONGEST_RUN_REFRESHES: f64 = 100_000.0;
// The ideal pictures of a scene are kept while its algorithms run: 12 bytes of colour and 1 of change per pixel and refresh.
const BYTES_PER_PIXEL: f64 = 13.0;
// A hundred times the sketch's rate; a second of more would take minutes to simulate.
const MOST_SAMPLES_PER_SEC: f64 = 1e8;
// Nobody waits for more.
const LARGEST_FACTOR: f64 = 4096.0;
const MOST_BYTES: f64 = 8.0 * (1u64 << 30) as f64;

impl Experiment {
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
        let file: ExperimentFile = toml::from_str(text).map_err(|error| {
            let before = error.span().map_or("", |span| &text[..span.start]);
            let line = before.matches('\n').count() + 1;
            let column = before.chars().rev().take_while(|&c| c != '\n').count() + 1;
            format!("line {line}, column {column}: {}", error.message())
        })?;
        check(file, folder)
    }
}

fn check(file: ExperimentFile, folder: &Path) -> Result<Experiment, String> {
    let sides = [file.width, file.height];
    if !sides.iter().all(|side| (1..=LARGEST_SIDE).contains(side)) {
        return Err(format!(
            "width and height must be 1 to {LARGEST_SIDE}, got {}×{}",
            file.width, file.height
        ));
    }
    if !(1..=1000).contains(&file.display_hz) {
        return Err(format!("display_hz must be 1 to 1000, got {}", file.display_hz));
    }
    let refreshes = (file.duration_secs * f64::from(file.display_hz)).round();
    let unscored = (file.unscored_secs * f64::from(file.display_hz)).round();
    let is_possible = (1.0..=LONGEST_RUN_REFRESHES).contains(&refreshes) && unscored >= 0.0;
    if !(is_possible && unscored < refreshes) {
        return Err(format!(
            "duration_secs must be at least one refresh, at most {LONGEST_RUN_REFRESHES} refreshes, and longer than \
             unscored_secs; got {} and {}",
            file.duration_secs, file.unscored_secs
        ));
    }
    let bytes = refreshes * f64::from(file.width) * f64::from(file.height) * BYTES_PER_PIXEL;
    if bytes > MOST_BYTES {
        return Err(format!(
            "the ideal pictures of {refreshes} refreshes at {}×{} take {:.1} GiB, more than the {:.0} GiB allowed; \
             make duration_secs, width or height smaller",
            file.width,
            file.height,
            bytes / f64::from(1u32 << 30),
            MOST_BYTES / f64::from(1u32 << 30)
        ));
    }
    let is_possible = |rate: &f64| *rate > 0.0 && *rate <= MOST_SAMPLES_PER_SEC;
    if let Some(rate) = file.samples_per_sec.iter().find(|rate| !is_possible(rate)) {
        return Err(format!(
            "samples_per_sec must be positive and at most {MOST_SAMPLES_PER_SEC}, got {rate:?}"
        ));
    }
    let algorithms: Vec<Algorithm> =
        file.algorithms.iter().map(|name| Algorithm::from_name(name)).collect::<Result<_, _>>()?;
    for (key, is_empty) in [
        ("samples_per_sec", file.samples_per_sec.is_empty()),
        ("seeds", file.seeds.is_empty()),
        ("algorithms", algorithms.is_empty()),
        ("scenes", file.scenes.is_empty()),
    ] {
        if is_empty {
            return Err(format!("{key} is empty: at least one is needed"));
        }
    }
    for (i, algorithm) in algorithms.iter().enumerate() {
        if algorithms[..i].contains(algorithm) {
            return Err(format!("algorithms: {:?} is there twice", algorithm.name()));
        }
    }
    let mut scenes: Vec<SceneSpec> = Vec::new();
    for table in file.scenes {
        let spec = check_scene(table, folder)?;
        if scenes.iter().any(|other| other.name == spec.name) {
            return Err(format!("two scenes are called {:?}; give one another name", spec.name));
        }
        scenes.push(spec);
    }
    let stills = file.output.stills_secs.iter().map(|&secs| {
        // Refresh k is at (k + 1) / hz.
        let k = (secs * f64::from(file.display_hz)).round() - 1.0;
        if k >= 0.0 && k < refreshes {
            return Ok(k as usize);
        }
        Err(format!("stills_secs: {secs} is not within the run of {} s", file.duration_secs))
    });
    let stills = stills.collect::<Result<_, _>>()?;
    let equal_quality = file.equal_quality.map(|table| checked_equal_quality(table, &algorithms));
    let equal_quality = equal_quality.transpose()?;
    let show = checked_show(file.output.show, &algorithms)?;
    let size = Size::new(file.width, file.height);
    let video = file.output.video.unwrap_or(true);
    if video {
        check_video(size, show.len())?;
    }
    Ok(Experiment {
        title: file.title,
        scenes,
        algorithms,
        samples_per_sec: file.samples_per_sec,
        seeds: file.seeds,
        size,
        display_hz: file.display_hz,
        refreshes: refreshes as usize,
        unscored: unscored as usize,
        stills,
        show,
        video,
        equal_quality,
    })
}

/// Whether the encoder takes a video of so many pictures side by side.
fn check_video(size: Size, pictures: usize) -> Result<(), String> {
    let Size { width, height } = strip_size(size, pictures);
    let fits = (VIDEO_SIDES.0..=VIDEO_SIDES.1).contains(&width)
        && (VIDEO_SIDES.0..=VIDEO_SIDES.2).contains(&height);
    if fits {
        return Ok(());
    }
    let (least, widest, highest) = VIDEO_SIDES;
    Err(format!(
        "{pictures} pictures side by side make a video of {width}×{height}, but it must be at least {least}×{least} and at \
         most {widest}×{highest}; set output.video = false, or name fewer in output.show"
    ))
}

fn check_scene(table: SceneTable, folder: &Path) -> Result<SceneSpec, String> {
    let (source, own_name) = if frameless_scene::BUILTIN_NAMES.contains(&table.scene.as_str()) {
        (SceneSource::Builtin(table.scene.clone()), table.scene.clone())
    } else if table.scene.ends_with(".glb") || table.scene.ends_with(".gltf") {
        let path = folder.join(&table.scene);
        let stem = path.file_stem().map(|stem| stem.to_string_lossy().into_owned());
        (SceneSource::File(path), stem.unwrap_or_default())
    } else {
        return Err(format!(
            "scene = {:?} is neither a built-in scene ({}) nor a .glb or .gltf file",
            table.scene,
            frameless_scene::BUILTIN_NAMES.join(", ")
        ));
    };
    let name = table.name.unwrap_or(own_name);
    if name.is_empty() || !name.chars().all(|c| c.is_ascii_alphanumeric() || "-_".contains(c)) {
        return Err(format!(
            "scene name {name:?}: only letters, digits, - and _ are allowed, since files are named after it; \
             set name = \"…\""
        ));
    }
    let camera =
        table.camera.map(|spec| spec.check().map_err(|e| format!("camera of {name:?}: {e}")));
    Ok(SceneSpec { name, source, camera: camera.transpose()? })
}

fn checked_show(show: Vec<String>, algorithms: &[Algorithm]) -> Result<Vec<String>, String> {
    let mut known: Vec<String> = algorithms.iter().map(Algorithm::name).collect();
    known.push(IDEAL.into());
    if let Some(stranger) = show.iter().find(|name| !known.contains(name)) {
        return Err(format!("show: {stranger:?} is not among {}", known.join(", ")));
    }
    Ok(if show.is_empty() { known } else { show })
}

fn checked_equal_quality(
    table: EqualQualityTable,
    known: &[Algorithm],
) -> Result<EqualQualitySpec, String> {
    if !(table.max_factor > 1.0 && table.max_factor <= LARGEST_FACTOR) {
        return Err(format!(
            "equal_quality.max_factor must be more than 1 and at most {LARGEST_FACTOR}, got {}",
            table.max_factor
        ));
    }
    let among = |key: &str, names: Vec<String>| -> Result<Vec<Algorithm>, String> {
        if names.is_empty() {
            return Err(format!("equal_quality.{key} is empty: at least one is needed"));
        }
        let find = |name: &String| {
            let algorithm = Algorithm::from_name(name)?;
            let is_known = known.contains(&algorithm);
            is_known
                .then_some(algorithm)
                .ok_or_else(|| format!("equal_quality.{key}: {name:?} is not among the algorithms"))
        };
        names.iter().map(find).collect()
    };
    Ok(EqualQualitySpec {
        algorithms: among("algorithms", table.algorithms)?,
        opponents: among("opponents", table.opponents)?,
        max_factor: table.max_factor,
    })
}
