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

use crate::Sampler;

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
    Adaptive {
        /// Temporal against spatial accuracy, in [0, 1]; see [`Sampler::set_temporal`].
        temporal: f32,
        /// What an experiment leaves out; `None`: nothing.
        without: Option<AdaptiveStage>,
    },
}

/// [`SamplerKind::ADAPTIVE`].
impl Default for SamplerKind {
    fn default() -> SamplerKind {
        SamplerKind::ADAPTIVE
    }
}

impl SamplerKind {
    /// `change` with the measured defaults.
    pub const CHANGE: SamplerKind = SamplerKind::Change { w_d: DEFAULT_W_D, tile: DEFAULT_TILE };

    /// `adaptive` with the measured default.
    pub const ADAPTIVE: SamplerKind =
        SamplerKind::Adaptive { temporal: DEFAULT_TEMPORAL, without: None };

    /// Every kind with its default parameters.
    pub const ALL: [SamplerKind; 4] =
        [SamplerKind::Random, SamplerKind::Permutation, SamplerKind::CHANGE, SamplerKind::ADAPTIVE];

    /// The name used on the command line and in experiments.
    pub fn name(&self) -> &'static str {
        match self {
            SamplerKind::Random => "random",
            SamplerKind::Permutation => "permutation",
            SamplerKind::Change { .. } => "change",
            SamplerKind::Adaptive { .. } => "adaptive",
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
            SamplerKind::Adaptive { temporal, without } => {
                Box::new(Adaptive::new(temporal, seed).without(without))
            }
        }
    }
}
