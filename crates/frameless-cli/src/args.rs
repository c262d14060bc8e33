//! What the program can be asked, and the help that teaches it.

mod bench;
mod serve;

use std::path::PathBuf;

use clap::{Args as ClapArgs, Parser, Subcommand};
use frameless::{ReconstructionKind, Size, ToneMap};
use frameless_scene::{AnimationChoice, Pick};
use frameless_trace::{Integrator, Settings};

use crate::parse;

pub(crate) use bench::{BenchArgs, Benchmark};
pub(crate) use serve::ServeArgs;

const LONG_ABOUT: &str = "\
Frameless rendering: every sample is one pixel traced at the current time and shown at once.

There are no frames: a sampler chooses which pixels are worth tracing now, learns from what changed, and \
the picture is always as new as its newest sample. Without a subcommand a window opens on the scene \
`sphere`, or a web page is served where there is no display.";

const AFTER_HELP: &str = "\
Examples:
  frameless
      the moving sphere, in a window
  frameless view model.glb
      your own scene
  frameless serve model.glb
      the same on a web page: it prints the one address to open
  frameless view sphere --sampler random --reconstruction hold
      as it began in 1994: pixels chosen at random, each shown until its next sample
  frameless compare experiments/figures.toml --out out/figures
      how good is it? numbers, a report with curves, pictures and a video
  frameless render sphere --time 0.5 -o sphere.png
      the ideal picture at one moment

A SCENE is a glTF 2.0 file (.gltf or .glb) or the name of a built-in scene; see `frameless scenes`.

Exit code: 0 success, 2 bad input (arguments, a missing or broken file), 1 anything else (no display, a \
full disk). An error is one line on standard error that begins with `error:`. A picture or the folder of \
a comparison appears whole or not at all.";

#[derive(Parser)]
#[command(name = "frameless", version, about = "Frameless rendering", long_about = LONG_ABOUT)]
#[command(after_help = AFTER_HELP, max_term_width = 100)]
pub(crate) struct Args {
    #[command(subcommand)]
    pub(crate) command: Option<Command>,
}

#[derive(Subcommand)]
pub(crate) enum Command {
    View(ViewArgs),
    Serve(ServeArgs),
    Compare(CompareArgs),
    Render(RenderArgs),
    Trace(TraceArgs),
    Info(InfoArgs),
    Bench(BenchArgs),
    /// List the built-in scenes
    #[command(after_help = "Example:\n  frameless scenes")]
    Scenes,
}

/// Look at a scene in a window while it is being traced
///
/// Keys and mouse are explained in the window. Where there is no display, it is served as a web page, as by
/// `frameless serve`.
#[derive(ClapArgs)]
#[command(after_help = "Examples:
  frameless view
  frameless view model.glb --rate 900000 --temporal 0.8
  frameless view fox.glb --animation Run
  frameless view sphere --sampler change --reconstruction hold
      the algorithm of 2002
  frameless view sphere --size 512x384 --screenshot shot.png --after 3")]
pub(crate) struct ViewArgs {
    #[command(flatten)]
    pub(crate) look: LookArgs,

    /// Save the window's picture to this PNG file after --after seconds, and end
    #[arg(long, value_name = "FILE")]
    pub(crate) screenshot: Option<PathBuf>,

    /// When to save the screenshot, in seconds after the window has opened
    #[arg(long, value_name = "SECS", default_value = "3", value_parser = parse::wait_secs)]
    #[arg(requires = "screenshot")]
    pub(crate) after: f64,
}

/// What is looked at, and how it is traced.
#[derive(ClapArgs)]
pub(crate) struct LookArgs {
    /// A glTF file or a built-in scene
    #[arg(default_value = DEFAULT_SCENE)]
    pub(crate) scene: String,

    #[command(flatten)]
    pub(crate) choice: ChoiceArgs,

    /// Who chooses the pixels [default: adaptive]
    ///
    /// random: any pixel. permutation: every pixel once, then again. change: where colours have just changed (the
    /// sketch of 2002). adaptive: what has been uncovered, then moving edges, then where change has been learned to
    /// be fast.
    #[arg(long, value_name = "NAME", value_parser = sampler_names())]
    pub(crate) sampler: Option<String>,

    /// How the picture is made of the samples [default: reproject+relight+antialias]
    ///
    /// hold: each pixel shows its newest sample. filter: a mean of the samples around, the younger the heavier.
    /// reproject: samples move with the surfaces that they hit; it may be followed by +relight (old samples are
    /// shaded with the present lights), +deep (four samples per pixel) and +antialias (samples add up where nothing
    /// moves).
    #[arg(long, value_name = "NAME", value_parser = parse::reconstruction)]
    pub(crate) reconstruction: Option<ReconstructionKind>,

    /// What the sampler `adaptive` spends its samples on [default: 0.5]
    ///
    /// From 0 (spatial: finishing what is there) to 1 (temporal: following what moves).
    #[arg(long, value_name = "0..1", value_parser = parse::fraction)]
    pub(crate) temporal: Option<f32>,

    /// Trace a picture of always the same size in pixels, whatever the window's [default: as the window, at most 640x480]
    #[arg(long, value_name = "WxH", value_parser = parse::size)]
    pub(crate) size: Option<Size>,

    /// At most so many samples per second [default: as many as the machine can]
    #[arg(long, value_name = "SAMPLES", value_parser = parse::positive)]
    pub(crate) rate: Option<f64>,

    /// Begin with this camera of the scene, counted from 0
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub(crate) camera: u32,

    /// Brighter (positive) or darker (negative) by so many powers of two
    #[arg(long, value_name = "STOPS", default_value = "0", value_parser = parse::stops)]
    #[arg(allow_negative_numbers = true)]
    pub(crate) exposure: f32,

    /// How what is brighter than white is brought into range: clip, neutral (Khronos PBR Neutral) or aces (as fitted by Hill)
    #[arg(long, value_name = "NAME", default_value = "clip", value_parser = parse::tone_map)]
    pub(crate) tone_map: ToneMap,

    #[command(flatten)]
    pub(crate) light: LightArgs,

    #[command(flatten)]
    pub(crate) environment: EnvironmentArgs,

    /// Trace with so many threads; 0: one per core
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub(crate) threads: usize,

    /// The seed of all random choices
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub(crate) seed: u64,
}

/// Which part of a glTF file.
#[derive(ClapArgs, Clone, Debug, Default, PartialEq, Eq)]
pub(crate) struct ChoiceArgs {
    /// Show this of the file's scenes: a number from 0, or a name [default: the one that the file names, else its first]
    #[arg(long = "scene", value_name = "N|NAME")]
    pub(crate) file_scene: Option<Pick>,

    /// Play this of the file's animations: a number from 0, a name, all or none [default: all at once; the first alone if two
    /// of them move the same thing]
    #[arg(long, value_name = "N|NAME|all|none")]
    pub(crate) animation: Option<AnimationChoice>,
}

/// The scene of `frameless` without arguments.
const DEFAULT_SCENE: &str = "sphere";

impl Default for ViewArgs {
    /// As if `frameless view` had been typed.
    fn default() -> ViewArgs {
        let look = LookArgs {
            scene: DEFAULT_SCENE.into(),
            choice: ChoiceArgs::default(),
            sampler: None,
            reconstruction: None,
            temporal: None,
            size: None,
            rate: None,
            camera: 0,
            exposure: 0.0,
            tone_map: ToneMap::default(),
            light: LightArgs::default(),
            environment: EnvironmentArgs::default(),
            threads: 0,
            seed: 1,
        };
        ViewArgs { look, screenshot: None, after: 3.0 }
    }
}

/// Measure algorithms against the ideal picture, or two results against each other
///
/// An EXPERIMENT is a TOML file that names scenes, algorithms and sample rates; `experiments/` has some.
/// Time is simulated: the same experiment gives the same numbers every time, on slow machines and fast ones.
/// Every finished run is kept in the folder: after Ctrl-C, or a change of the experiment, the same command
/// runs only what is missing.
///
/// A.json and B.json are the results.json of two comparisons. What changed from A to B is printed; if
/// anything got worse by more than the spread over the seeds (and by more than 0.5 %), the exit code is 1.
#[derive(ClapArgs)]
#[command(override_usage = "frameless compare <EXPERIMENT> --out <DIR> [--only <CELLS>]
       frameless compare <A.json> <B.json>")]
#[command(after_help = "Examples:
  frameless compare experiments/figures.toml --out out/figures
      numbers for programs (results.json), a report for people (report.html), curves, pictures, a video
  frameless compare experiments/suite.toml --out out/suite --only scene=sphere,algorithm=change,rate=900000
      a part of an experiment
  frameless compare results/figures.json out/figures/results.json
      did anything get worse?")]
pub(crate) struct CompareArgs {
    /// An experiment (a TOML file), or two results (JSON files, the older first)
    #[arg(value_name = "FILE", required = true, num_args = 1..=2)]
    pub(crate) files: Vec<PathBuf>,

    /// The folder for numbers, report and pictures; an earlier comparison there is replaced
    #[arg(long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,

    /// Run a part of the experiment: scene=, algorithm=, rate=, seed=, with commas between; a key may come
    /// twice
    #[arg(long, value_name = "CELLS")]
    pub(crate) only: Option<String>,
}

/// Trace the whole picture at one moment: the ideal that every algorithm is compared with
#[derive(ClapArgs)]
#[command(after_help = "Examples:
  frameless render sphere --time 0.5 -o sphere.png
  frameless render model.glb --time 0 --size 1920x1080 --camera 1 --exposure -1 -o model.png
  frameless render model.glb --env sky.hdr --env-rotation 90 --integrator path --samples 64 -o model.png")]
pub(crate) struct RenderArgs {
    /// A glTF file or a built-in scene
    pub(crate) scene: String,

    #[command(flatten)]
    pub(crate) choice: ChoiceArgs,

    /// The moment, in seconds of the scene's own time
    #[arg(long, value_name = "SECS", default_value = "0", value_parser = parse::finite)]
    #[arg(allow_negative_numbers = true)]
    pub(crate) time: f64,

    /// The PNG file to be written
    #[arg(short, long, value_name = "FILE")]
    pub(crate) out: PathBuf,

    /// Width and height in pixels
    #[arg(long, value_name = "WxH", default_value = "512x384", value_parser = parse::size)]
    pub(crate) size: Size,

    /// Which of the scene's cameras, counted from 0
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub(crate) camera: u32,

    /// Brighter (positive) or darker (negative) by so many powers of two
    #[arg(long, value_name = "STOPS", default_value = "0", value_parser = parse::stops)]
    #[arg(allow_negative_numbers = true)]
    pub(crate) exposure: f32,

    /// How what is brighter than white is brought into range: clip, neutral (Khronos PBR Neutral) or aces (as fitted by Hill)
    #[arg(long, value_name = "NAME", default_value = "clip", value_parser = parse::tone_map)]
    pub(crate) tone_map: ToneMap,

    #[command(flatten)]
    pub(crate) light: LightArgs,

    #[command(flatten)]
    pub(crate) environment: EnvironmentArgs,

    /// Samples per pixel: one at its centre, or so many spread over it
    #[arg(long, value_name = "N", default_value_t = 1)]
    #[arg(value_parser = clap::value_parser!(u32).range(1..=65_536))]
    pub(crate) samples: u32,
}

/// How light is followed.
#[derive(ClapArgs)]
pub(crate) struct LightArgs {
    /// How light is followed
    ///
    /// direct: lights seen directly and in mirrors, with hard shadows; without noise. path: light that has bounced any number of
    /// times, by random paths; noise goes away where the picture rests.
    #[arg(long, value_name = "NAME", default_value = "direct", value_parser = integrator_names())]
    pub(crate) integrator: String,

    /// After how many surfaces a path of light ends
    #[arg(long, value_name = "N", default_value_t = Settings::default().max_depth)]
    #[arg(value_parser = clap::value_parser!(u32).range(0..=1000))]
    pub(crate) max_depth: u32,
}

impl Default for LightArgs {
    fn default() -> LightArgs {
        let Settings { integrator, max_depth, .. } = Settings::default();
        LightArgs { integrator: integrator.name().to_owned(), max_depth }
    }
}

impl LightArgs {
    pub(crate) fn settings(&self) -> Settings {
        let integrator = Integrator::from_name(&self.integrator).unwrap_or_default();
        Settings { integrator, max_depth: self.max_depth, ..Settings::default() }
    }
}

/// What is far away.
#[derive(ClapArgs, Debug)]
pub(crate) struct EnvironmentArgs {
    /// Light the scene by a Radiance picture (.hdr) of all that is far away, which is seen behind it, too
    ///
    /// Latitude and longitude; the middle column is seen along +x. It takes the place of light that is added to files without any.
    #[arg(long = "env", value_name = "FILE")]
    pub(crate) file: Option<PathBuf>,

    /// Turn the environment about the vertical, in degrees; positive turns what is along +z towards +x
    #[arg(long = "env-rotation", value_name = "DEGREES", default_value = "0")]
    #[arg(value_parser = parse::finite, allow_negative_numbers = true, requires = "file")]
    pub(crate) rotation_deg: f64,

    /// Multiply the environment's light
    #[arg(long = "env-strength", value_name = "FACTOR", default_value = "1")]
    #[arg(value_parser = parse::positive, requires = "file")]
    pub(crate) strength: f64,
}

impl Default for EnvironmentArgs {
    fn default() -> EnvironmentArgs {
        EnvironmentArgs { file: None, rotation_deg: 0.0, strength: 1.0 }
    }
}

fn integrator_names() -> clap::builder::PossibleValuesParser {
    clap::builder::PossibleValuesParser::new(Integrator::ALL.map(Integrator::name))
}

/// Trace one pixel and tell every step: the ray, what it hit, each light, the colour
#[derive(ClapArgs)]
#[command(after_help = "Example:
  frameless trace sphere --pixel 256,192 --time 0.5")]
pub(crate) struct TraceArgs {
    /// A glTF file or a built-in scene
    pub(crate) scene: String,

    #[command(flatten)]
    pub(crate) choice: ChoiceArgs,

    /// Column and row, counted from the top left
    #[arg(long, value_name = "X,Y", value_parser = parse::pixel)]
    pub(crate) pixel: (u32, u32),

    /// The moment, in seconds of the scene's own time
    #[arg(long, value_name = "SECS", default_value = "0", value_parser = parse::finite)]
    #[arg(allow_negative_numbers = true)]
    pub(crate) time: f64,

    /// Width and height of the picture that the pixel belongs to
    #[arg(long, value_name = "WxH", default_value = "512x384", value_parser = parse::size)]
    pub(crate) size: Size,

    /// Which of the scene's cameras, counted from 0
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub(crate) camera: u32,

    #[command(flatten)]
    pub(crate) environment: EnvironmentArgs,
}

/// Tell what is in a scene: shapes, materials, textures, cameras, lights, motion, and what was ignored
#[derive(ClapArgs)]
#[command(after_help = "Examples:
  frameless info sphere
  frameless info model.glb
      the names of its scenes and animations are what --scene and --animation take")]
pub(crate) struct InfoArgs {
    /// A glTF file or a built-in scene
    pub(crate) scene: String,

    #[command(flatten)]
    pub(crate) choice: ChoiceArgs,
}

fn sampler_names() -> clap::builder::PossibleValuesParser {
    frameless::SamplerKind::ALL.map(|kind| kind.name()).into()
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_arguments_are_consistent() {
        Args::command().debug_assert();
    }

    #[test]
    fn no_arguments_mean_what_view_means() {
        let Ok(Args { command: Some(Command::View(typed)) }) =
            Args::try_parse_from(["frameless", "view"])
        else {
            panic!("`frameless view` is refused");
        };
        let default = ViewArgs::default();
        assert_eq!((typed.screenshot, typed.after), (default.screenshot, default.after));
        let (typed, default) = (typed.look, default.look);
        assert_eq!(
            (typed.scene, typed.sampler, typed.size, typed.rate, typed.camera),
            (default.scene, default.sampler, default.size, default.rate, default.camera)
        );
        assert_eq!(typed.choice, default.choice);
        assert_eq!(
            (typed.reconstruction, typed.temporal),
            (default.reconstruction, default.temporal)
        );
        assert_eq!(
            (typed.exposure, typed.tone_map, typed.threads, typed.seed),
            (default.exposure, default.tone_map, default.threads, default.seed)
        );
    }
}
