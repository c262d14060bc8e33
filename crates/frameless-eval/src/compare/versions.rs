//! Versions of the code that runs depend on, so that a change of one contender lets the runs of the others stand.

use frameless::{ReconstructionKind, SamplerKind};

use crate::algorithm::Algorithm;

/// Increased whenever a built-in scene, a tracer, the clock, a metric or the way pictures are made gives other results for the same
/// input: no run from before is used again.
pub(super) const WORLD_VERSION: u32 = 10;

/// Whoever shares code that is no other's.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Family {
    /// Contenders that know nothing of samplers, the oracle among them.
    Frames,
    /// The samplers that learn from colours at most, shown by `hold`.
    Held,
    /// Sampler `adaptive`, and everybody's samples under `filter` and `reproject`.
    Adaptive,
}

impl Family {
    fn of(algorithm: &Algorithm) -> Family {
        match algorithm {
            Algorithm::Frameless(SamplerKind::Adaptive(_), _) => Family::Adaptive,
            Algorithm::Frameless(_, ReconstructionKind::Hold) => Family::Held,
            Algorithm::Frameless(..) => Family::Adaptive,
            _ => Family::Frames,
        }
    }

    /// Increased whenever a member gives other results for the same input.
    fn version(self) -> u32 {
        match self {
            Family::Frames => 1,
            Family::Held => 1,
            Family::Adaptive => 9,
        }
    }
}

/// An algorithm and which version of it.
pub(super) fn versioned(algorithm: &Algorithm) -> String {
    let family = Family::of(algorithm);
    format!("{} ({family:?} version {})", algorithm.name(), family.version())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn family(name: &str) -> Family {
        Family::of(&Algorithm::from_name(name).expect(name))
    }

    #[test]
    fn a_change_of_adaptive_or_of_a_reconstruction_leaves_the_opponents_alone() {
        for name in [
            "adaptive+hold",
            "adaptive+reproject+relight",
            "change+filter",
            "permutation+reproject",
        ] {
            assert_eq!(family(name), Family::Adaptive, "{name}");
        }
        for name in ["random", "permutation", "change", "change(w_d=0.5,tile=8)"] {
            assert_eq!(family(name), Family::Held, "{name}");
        }
        for name in
            ["framed", "framed-single", "lowres30", "progressive", "temporal", "oracle-hold"]
        {
            assert_eq!(family(name), Family::Frames, "{name}");
        }
    }
}
