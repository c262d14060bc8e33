//! What `frameless view` takes, and with it whatever looks at a scene while it runs.

use std::path::PathBuf;

use clap::Args as ClapArgs;
use frameless::{ReconstructionKind, Size, ToneMap};

use super::{LightArgs, OpenArgs};
use crate::parse;

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
    pub(crate) open: OpenArgs,

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

    /// How what is brighter than white is brought into range: neutral (Khronos PBR Neutral), agx (as in Blender), aces (as fitted by Hill), or none: it is white
    #[arg(long, value_name = "NAME", default_value = ToneMap::default().name(), value_parser = parse::tone_map)]
    pub(crate) tone_map: ToneMap,

    #[command(flatten)]
    pub(crate) light: LightArgs,

    /// Trace with so many threads; 0: one per core
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub(crate) threads: usize,

    /// The seed of all random choices
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub(crate) seed: u64,
}

/// The scene of `frameless` without arguments.
pub(super) const DEFAULT_SCENE: &str = "sphere";

impl Default for ViewArgs {
    /// As if `frameless view` had been typed.
    fn default() -> ViewArgs {
        let look = LookArgs {
            scene: DEFAULT_SCENE.into(),
            open: OpenArgs::default(),
            sampler: None,
            reconstruction: None,
            temporal: None,
            size: None,
            rate: None,
            camera: 0,
            exposure: 0.0,
            tone_map: ToneMap::default(),
            light: LightArgs::default(),
            threads: 0,
            seed: 1,
        };
        ViewArgs { look, screenshot: None, after: 3.0 }
    }
}

fn sampler_names() -> clap::builder::PossibleValuesParser {
    frameless::SamplerKind::ALL.map(|kind| kind.name()).into()
}
