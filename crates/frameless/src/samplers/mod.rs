//! The samplers, one file each.

mod adaptive;
mod change;
mod permutation;
mod random;

pub(crate) use adaptive::DEFAULT_TEMPORAL;
pub use adaptive::{Adaptive, AdaptiveStage};
pub use change::{Change, DEFAULT_TILE, DEFAULT_W_D};
pub use permutation::Permutation;
pub use random::Random;

use crate::{Sampler, Weights};

/// The samplers that come with the crate, with their parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SamplerKind {
    /// [`Random`].
    Random,
    /// [`Permutation`].
    Permutation,
    /// [`Change`].
    Change {
        /// Weight of change against age, in [0, 1].
        w_d: f32,
        /// Side of a tile in pixels, at least 1.
        tile: u32,
    },
    /// [`Adaptive`].
    Adaptive(AdaptiveOptions),
}

/// [`SamplerKind::ADAPTIVE`].
impl Default for SamplerKind {
    fn default() -> SamplerKind {
        SamplerKind::ADAPTIVE
    }
}

/// What [`Adaptive`] is told; nothing of it makes it forget what it has learned, if it is told later.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AdaptiveOptions {
    /// Temporal against spatial accuracy, in [0, 1]; see [`Sampler::set_temporal`].
    pub temporal: f32,
    /// See [`Weights::with_contrast`]; in [−1, 1].
    pub contrast: f32,
    /// See [`Weights::with_flow`]; in [−1, 1].
    pub flow: f32,
    /// Strength of a gaze at the picture's middle with [`Gaze::RADIUS`](crate::Gaze::RADIUS); in [0, 1].
    pub gaze: f32,
    /// What an experiment leaves out; `None`: nothing.
    pub without: Option<AdaptiveStage>,
}

impl AdaptiveOptions {
    /// As measured; no weights, nothing left out.
    pub const DEFAULT: AdaptiveOptions = AdaptiveOptions {
        temporal: DEFAULT_TEMPORAL,
        contrast: 0.0,
        flow: 0.0,
        gaze: 0.0,
        without: None,
    };
}

impl Default for AdaptiveOptions {
    fn default() -> AdaptiveOptions {
        AdaptiveOptions::DEFAULT
    }
}

impl SamplerKind {
    /// `change` with the measured defaults.
    pub const CHANGE: SamplerKind = SamplerKind::Change { w_d: DEFAULT_W_D, tile: DEFAULT_TILE };

    /// `adaptive` with the measured default.
    pub const ADAPTIVE: SamplerKind = SamplerKind::Adaptive(AdaptiveOptions::DEFAULT);

    /// Every kind with its default parameters.
    pub const ALL: [SamplerKind; 4] =
        [SamplerKind::Random, SamplerKind::Permutation, SamplerKind::CHANGE, SamplerKind::ADAPTIVE];

    /// The name used on the command line and in experiments.
    pub fn name(&self) -> &'static str {
        match self {
            SamplerKind::Random => "random",
            SamplerKind::Permutation => "permutation",
            SamplerKind::Change { .. } => "change",
            SamplerKind::Adaptive(_) => "adaptive",
        }
    }

    /// The kind of that name, with default parameters.
    pub fn from_name(name: &str) -> Option<SamplerKind> {
        SamplerKind::ALL.into_iter().find(|kind| kind.name() == name)
    }

    /// A sampler of this kind; the same seed makes the same choices.
    pub fn build(&self, seed: u64) -> Box<dyn Sampler> {
        match *self {
            SamplerKind::Random => Box::new(Random::new(seed)),
            SamplerKind::Permutation => Box::new(Permutation::new(seed)),
            SamplerKind::Change { w_d, tile } => Box::new(Change::new(w_d, tile, seed)),
            SamplerKind::Adaptive(AdaptiveOptions { temporal, contrast, flow, gaze, without }) => {
                let mut adaptive = Adaptive::new(temporal, seed).without(without);
                adaptive.set_weights(&Weights::clamped(contrast, flow, gaze));
                Box::new(adaptive)
            }
        }
    }
}
