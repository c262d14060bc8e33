//! What `frameless bench` takes.

use std::path::PathBuf;

use clap::error::ErrorKind;
use clap::parser::ValueSource;
use clap::{ArgMatches, Args as ClapArgs, ValueEnum};
use frameless::Size;
use frameless_scene::AnimationChoice;

use super::view::DEFAULT_SCENE;
use super::{ChoiceArgs, LightArgs};
use crate::parse;

const EXAMPLES: &str = "Examples:
  frameless bench engine
  frameless bench engine --scene model.glb --threads 1
  frameless bench edit --scene model.glb --object Chair --rounds 3
  frameless bench latency --scene model.glb --size 1280x720
  frameless bench sampler --json
  frameless bench rays --scene generated --rounds 5";

/// Measure how fast this machine runs the loop
///
/// Speeds are measured in alternating rounds of one run, and given as medians with the smallest and the
/// largest round. Close other programs first.
#[derive(ClapArgs)]
#[command(args_override_self = true)]
#[command(after_help = after_help())]
pub(crate) struct BenchArgs {
    /// What to measure
    #[arg(value_enum)]
    pub(crate) what: Benchmark,

    /// A glTF file or a built-in scene [default: sphere; `display` and `rays` have scenes of their own]
    #[arg(long)]
    scene: Option<String>,

    /// Which of the file's animations are played, as for `view`
    #[arg(long, value_name = "N|NAME|all|none")]
    animation: Option<AnimationChoice>,

    /// Of `edit`: the name of the object that jumps [default: of those that cover 1 % to 10 % of the picture the largest]
    #[arg(long, value_name = "NAME")]
    object: Option<String>,

    /// Of `still`: how light is followed
    #[command(flatten)]
    pub(crate) light: LightArgs,

    /// Of `still`: samples per pixel
    #[arg(long, value_name = "N", default_value_t = 8)]
    #[arg(value_parser = clap::value_parser!(u32).range(1..=65_536))]
    pub(crate) samples: u32,

    /// Size of the picture in pixels
    #[arg(long, value_name = "WxH", default_value = "512x384", value_parser = parse::size)]
    pub(crate) size: Size,

    /// Threads that trace; 0: one per core
    #[arg(long, default_value_t = 0)]
    pub(crate) threads: usize,

    /// How often everything is measured
    #[arg(long, default_value_t = 9, value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub(crate) rounds: u32,

    /// Length of a measurement in seconds
    #[arg(long, default_value_t = 0.5, value_parser = parse::positive)]
    pub(crate) secs: f64,

    /// Of `rays`: Embree 4's library [default: that of Python's embreex, or the system's]
    #[arg(long, value_name = "FILE")]
    pub(crate) embree: Option<PathBuf>,

    /// Of `rays`: how many triangles its own scenes have, of those that they have by default
    #[arg(long, value_name = "PART", default_value_t = 1.0, hide = true, value_parser = parse::positive)]
    detail: f64,

    /// Print one JSON object, {"rows": [{name, value, min, max, unit, conditions}]}
    #[arg(long)]
    pub(crate) json: bool,
}

impl BenchArgs {
    /// What is traced.
    pub(crate) fn scene(&self) -> &str {
        self.scene.as_deref().unwrap_or(DEFAULT_SCENE)
    }

    /// What is traced, if it was named.
    pub(crate) fn named_scene(&self) -> Option<&str> {
        self.scene.as_deref()
    }

    /// Of the triangles of scenes made by code.
    pub(crate) fn detail(&self) -> f32 {
        self.detail as f32
    }

    /// What jumps, if it was named.
    pub(crate) fn object(&self) -> Option<&str> {
        self.object.as_deref()
    }

    /// What of it moves.
    pub(crate) fn choice(&self) -> ChoiceArgs {
        ChoiceArgs { file_scene: None, animation: self.animation.clone() }
    }
}

/// The benchmarks.
#[derive(Clone, Copy, ValueEnum)]
pub(crate) enum Benchmark {
    /// The whole loop on the real clock: samples per second of every sampler
    Engine,
    /// The samplers alone: nanoseconds per sample beside the renderer
    Sampler,
    /// The picture alone: nanoseconds per pixel of a refresh
    Display,
    /// An object jumps by 10 cm: seconds until what it changes is right again, with paths
    Edit,
    /// Whole pictures: samples per second without a loop
    Still,
    /// Bare rays: how many per second on one thread, beside Embree 4 where it is found
    Rays,
    /// Input: milliseconds until the first pixel shows it
    Latency,
    /// More threads: how many times as fast the loop is
    Scaling,
    /// Opening a scene: seconds until its first pixel, and the memory that it takes
    Load,
}

/// Examples, and which benchmark heeds which options.
fn after_help() -> String {
    let lines = Benchmark::value_variants().iter().map(|benchmark| {
        let options: Vec<String> = benchmark.options().map(dashed).collect();
        format!("\n  {:8} {}", benchmark.name(), options.join(" "))
    });
    format!("{EXAMPLES}\n\nOptions by benchmark, besides --json:{}", lines.collect::<String>())
}

/// An option as it is written.
fn dashed(id: &str) -> String {
    format!("--{}", id.replace('_', "-"))
}

impl Benchmark {
    fn name(self) -> String {
        let value = self.to_possible_value().expect("none of them is hidden");
        value.get_name().to_owned()
    }

    /// The ids of the options that it heeds, beside `json`, and beside `detail` of `rays`, which is for tests.
    fn options(self) -> impl Iterator<Item = &'static str> {
        let common = match self {
            Benchmark::Display => "size rounds",
            _ => "scene animation size rounds",
        };
        let own = match self {
            Benchmark::Engine | Benchmark::Sampler | Benchmark::Latency | Benchmark::Display => {
                "threads secs"
            }
            Benchmark::Scaling => "secs",
            Benchmark::Load => "threads",
            Benchmark::Edit => "threads object",
            Benchmark::Still => "threads samples integrator max_depth aperture focus",
            Benchmark::Rays => "embree",
        };
        common.split(' ').chain(own.split(' '))
    }

    /// Refuses options that this benchmark would not heed: who gives one would take the numbers for something that they are not.
    ///
    /// # Errors
    /// If there is one among those given.
    pub(super) fn check(self, given: &ArgMatches) -> Result<(), clap::Error> {
        let heeds = |id: &str| self.options().any(|heeded| heeded == id);
        let is_given = |id: &str| given.value_source(id) == Some(ValueSource::CommandLine);
        let mut all = Benchmark::value_variants().iter().flat_map(|benchmark| benchmark.options());
        let Some(other) = all.find(|id| is_given(id) && !heeds(id)) else { return Ok(()) };
        let options: Vec<String> = self.options().map(dashed).collect();
        let (name, other, options) = (self.name(), dashed(other), options.join(", "));
        let text = format!("bench {name} has no {other}; it has {options} and --json");
        Err(clap::Error::raw(ErrorKind::ArgumentConflict, text))
    }
}
