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

/// Measure how fast this machine runs the loop
///
/// Speeds are measured in alternating rounds of one run, and given as medians with the smallest and the
/// largest round. Close other programs first.
#[derive(ClapArgs)]
#[command(args_override_self = true)]
#[command(after_help = "Examples:
  frameless bench engine
  frameless bench engine --scene model.glb --threads 1
  frameless bench edit --scene model.glb --object Chair --rounds 3
  frameless bench latency --scene model.glb --size 1280x720
  frameless bench sampler --json
  frameless bench rays --scene generated --rounds 5

Options by benchmark, besides --json:
  engine, sampler, latency  --scene --animation --size --threads --rounds --secs
  scaling                   --scene --animation --size --rounds --secs
  load                      --scene --animation --size --threads --rounds
  edit                      --scene --animation --size --threads --rounds --object
  still                     --scene --animation --size --threads --rounds --samples
                            --integrator --max-depth --aperture --focus
  rays                      --scene --animation --size --rounds --embree
  display                   --size --threads --rounds --secs")]
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

impl Benchmark {
    /// Its options, by their ids; beside `json`.
    fn options(self) -> &'static [&'static str] {
        match self {
            Benchmark::Engine | Benchmark::Sampler | Benchmark::Latency => {
                &["scene", "animation", "size", "threads", "rounds", "secs"]
            }
            Benchmark::Scaling => &["scene", "animation", "size", "rounds", "secs"],
            Benchmark::Load => &["scene", "animation", "size", "threads", "rounds"],
            Benchmark::Edit => &["scene", "animation", "size", "threads", "rounds", "object"],
            Benchmark::Still => &[
                "scene",
                "animation",
                "size",
                "threads",
                "rounds",
                "samples",
                "integrator",
                "max_depth",
                "aperture",
                "focus",
            ],
            Benchmark::Rays => &["scene", "animation", "size", "rounds", "embree", "detail"],
            Benchmark::Display => &["size", "threads", "rounds", "secs"],
        }
    }

    /// Refuses options that this benchmark would not heed: who gives one would take the numbers for something that they are not.
    ///
    /// # Errors
    /// If there is one among those given.
    pub(super) fn check(self, given: &ArgMatches) -> Result<(), clap::Error> {
        let dashed = |id: &str| format!("--{}", id.replace('_', "-"));
        let heeds = |id: &str| self.options().contains(&id);
        let is_given = |id: &str| given.value_source(id) == Some(ValueSource::CommandLine);
        let all = Benchmark::value_variants().iter().flat_map(|benchmark| benchmark.options());
        let Some(other) = all.copied().find(|id| is_given(id) && !heeds(id)) else {
            return Ok(());
        };
        let name = self.to_possible_value().map_or_else(String::new, |v| v.get_name().to_owned());
        let options: Vec<String> = self.options().iter().map(|id| dashed(id)).collect();
        let (other, options) = (dashed(other), options.join(", "));
        let text = format!("bench {name} has no {other}; it has {options} and --json");
        Err(clap::Error::raw(ErrorKind::ArgumentConflict, text))
    }
}
