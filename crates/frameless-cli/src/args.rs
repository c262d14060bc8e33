//! What the program can be asked, and the help that teaches it.

mod bench;
mod light;
mod open;
mod serve;
mod view;

use std::path::PathBuf;

use clap::{Args as ClapArgs, CommandFactory, FromArgMatches, Parser, Subcommand};
use frameless::{Size, ToneMap};

use crate::parse;

pub(crate) use bench::{BenchArgs, Benchmark};
pub(crate) use light::LightArgs;
pub(crate) use open::{ChoiceArgs, LimitArgs, OpenArgs};
pub(crate) use serve::ServeArgs;
pub(crate) use view::{LookArgs, ViewArgs};

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

impl Args {
    /// Those of this program's command line.
    ///
    /// # Errors
    /// If they are none of it, or do not go together.
    pub(crate) fn checked() -> Result<Args, clap::Error> {
        let matches = Args::command().try_get_matches()?;
        let args = Args::from_arg_matches(&matches)?;
        if let (Some(Command::Bench(bench)), Some((_, given))) =
            (&args.command, matches.subcommand())
        {
            bench.what.check(given)?;
        }
        Ok(args)
    }
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
    pub(crate) open: OpenArgs,

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

    /// How what is brighter than white is brought into range: neutral (Khronos PBR Neutral), agx (as in Blender), aces (as fitted by Hill), or none: it is white
    #[arg(long, value_name = "NAME", default_value = ToneMap::default().name(), value_parser = parse::tone_map)]
    pub(crate) tone_map: ToneMap,

    #[command(flatten)]
    pub(crate) light: LightArgs,

    /// Samples per pixel: one at its centre, or so many spread over it
    #[arg(long, value_name = "N", default_value_t = 1)]
    #[arg(value_parser = clap::value_parser!(u32).range(1..=65_536))]
    pub(crate) samples: u32,
}

/// Trace one pixel and tell every step: the ray, what it hit, each light, the colour
#[derive(ClapArgs)]
#[command(after_help = "Example:
  frameless trace sphere --pixel 256,192 --time 0.5
  frameless trace model.glb --pixel 256,192 --integrator path --sample 7
      one path, surface by surface")]
pub(crate) struct TraceArgs {
    /// A glTF file or a built-in scene
    pub(crate) scene: String,

    #[command(flatten)]
    pub(crate) open: OpenArgs,

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

    /// Which sample of the pixel's sequence, counted from 0 [default: none of them but its centre, with the numbers of sample 0]
    #[arg(long, value_name = "N")]
    pub(crate) sample: Option<u32>,

    #[command(flatten)]
    pub(crate) light: LightArgs,
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

    #[command(flatten)]
    pub(crate) limits: LimitArgs,
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
        assert_eq!(typed.open.choice, default.open.choice);
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
