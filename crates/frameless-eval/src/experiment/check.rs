//! From what the file says to what can be run.

use std::path::Path;

use frameless::Size;

use super::event::check_events;
use super::file::{EqualQualityTable, ExperimentFile, SceneTable};
use super::{EqualQualitySpec, Experiment, IDEAL, MetricsSpec, SceneSource, SceneSpec};
use crate::algorithm::Algorithm;
use crate::output::strip_size;

// Least side, largest width and largest height of a video: the limits of the H.264 encoder, a little above its least.
const VIDEO_SIDES: (u32, u32, u32) = (64, 3840, 2160);

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

/// The experiment that a file asks for, or what is wrong with it.
pub(super) fn check(file: ExperimentFile, folder: &Path) -> Result<Experiment, String> {
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
    let twice = [
        ("seeds", first_twice(&file.seeds).map(u64::to_string)),
        ("samples_per_sec", first_twice(&file.samples_per_sec).map(f64::to_string)),
    ];
    if let Some((key, Some(twice))) = twice.into_iter().find(|(_, twice)| twice.is_some()) {
        return Err(format!("{key}: {twice} is there twice"));
    }
    for (i, algorithm) in algorithms.iter().enumerate() {
        if algorithms[..i].contains(algorithm) {
            return Err(format!("algorithms: {:?} is there twice", algorithm.name()));
        }
    }
    let mut scenes: Vec<SceneSpec> = Vec::new();
    for table in file.scenes {
        let spec = check_scene(table, folder, file.duration_secs)?;
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
        metrics: MetricsSpec {
            ssim_every: file.metrics.ssim_every,
            flip_every: file.metrics.flip_every,
        },
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

fn check_scene(table: SceneTable, folder: &Path, duration_secs: f64) -> Result<SceneSpec, String> {
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
    let events = check_events(table.events, duration_secs)
        .map_err(|message| format!("events of {name:?}: {message}"))?;
    Ok(SceneSpec { name, source, camera: camera.transpose()?, events })
}

fn checked_show(show: Vec<String>, algorithms: &[Algorithm]) -> Result<Vec<String>, String> {
    let mut known: Vec<String> = algorithms.iter().map(Algorithm::name).collect();
    known.push(IDEAL.into());
    if let Some(stranger) = show.iter().find(|name| !known.contains(name)) {
        return Err(format!("show: {stranger:?} is not among {}", known.join(", ")));
    }
    Ok(if show.is_empty() { known } else { show })
}

fn first_twice<T: PartialEq>(values: &[T]) -> Option<&T> {
    values
        .iter()
        .enumerate()
        .find(|(i, value)| values[..*i].contains(value))
        .map(|(_, value)| value)
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
    let algorithms = among("algorithms", table.algorithms)?;
    let opponents = among("opponents", table.opponents)?;
    if let Some(alone) = algorithms.iter().find(|a| opponents.iter().all(|other| other == *a)) {
        return Err(format!("equal_quality: {} has no opponent but itself", alone.name()));
    }
    Ok(EqualQualitySpec { algorithms, opponents, max_factor: table.max_factor })
}
