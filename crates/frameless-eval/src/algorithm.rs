//! Who competes, by name.

use frameless::{AdaptiveOptions, AdaptiveStage, ReconstructionKind, SamplerKind, Size};

use crate::contender::{Arena, Contender};
use crate::contenders::{
    Blind, Framed, FramedSingle, Frameless, LowRes, OracleHold, Progressive, Temporal,
};

/// A way of making pictures from samples.
#[derive(Clone, Debug, PartialEq)]
pub enum Algorithm {
    /// A frameless sampler, and how its samples are shown.
    Frameless(SamplerKind, ReconstructionKind),
    /// `framed`: whole frames, double-buffered.
    Framed,
    /// `framed-single`: whole frames, visible while they are drawn.
    FramedSingle,
    /// `lowres60` and `lowres30`: one frame of fitting resolution every so many refreshes.
    LowRes {
        /// 1 or 2.
        refreshes_per_frame: u32,
    },
    /// `progressive`: clear on any change, low resolution while things change, then accumulate.
    Progressive,
    /// `temporal`: jittered low-resolution frames that add up in a reprojected history.
    Temporal,
    /// `oracle-hold`: knows the ideal; the reference for held pictures.
    OracleHold,
}

/// The algorithms without parameters.
const PLAIN: [(&str, Algorithm); 7] = [
    ("framed", Algorithm::Framed),
    ("framed-single", Algorithm::FramedSingle),
    ("lowres60", Algorithm::LowRes { refreshes_per_frame: 1 }),
    ("lowres30", Algorithm::LowRes { refreshes_per_frame: 2 }),
    ("progressive", Algorithm::Progressive),
    ("temporal", Algorithm::Temporal),
    ("oracle-hold", Algorithm::OracleHold),
];

impl Algorithm {
    /// `random`, `permutation`, `change`, `framed`, `framed-single`, `lowres60`, `lowres30`, `progressive`,
    /// `temporal`, `oracle-hold`, `adaptive`; with parameters: `change(w_d=0.7,tile=8)`, `adaptive(temporal=0.5)`, and
    /// `adaptive` with strengths of [`frameless::Weights`]: `contrast=0.5`, `flow=0.5`, `gaze=0.5` (at the middle), or without a
    /// stage: `without=fronts`. After a sampler
    /// `+hold`, `+filter` or `+reproject` with its options, see [`ReconstructionKind::name`]; without, it is `+hold`.
    ///
    /// # Errors
    /// What was wanted, if the name is not one of these.
    pub fn from_name(name: &str) -> Result<Algorithm, String> {
        if let Some((_, algorithm)) = PLAIN.into_iter().find(|(plain, _)| *plain == name) {
            return Ok(algorithm);
        }
        let unknown = || {
            let samplers = SamplerKind::ALL.map(|kind| kind.name());
            let known: Vec<&str> =
                samplers.into_iter().chain(PLAIN.map(|(name, _)| name)).collect();
            format!(
                "unknown algorithm {name:?}; there are: {}; after a sampler +hold, +filter or +reproject, \
                 after that +relight, +deep, +antialias",
                known.join(", ")
            )
        };
        let (sampler, reconstruction) = split_reconstruction(name).ok_or_else(unknown)?;
        let kind = with_brackets(sampler).ok_or_else(unknown)?;
        Ok(Algorithm::Frameless(
            kind.map_err(|wrong| format!("algorithm {name:?}: {wrong}"))?,
            reconstruction,
        ))
    }

    /// The name that [`Algorithm::from_name`] understands.
    pub fn name(&self) -> String {
        match self {
            Algorithm::Frameless(sampler, reconstruction) => {
                let is_adaptive = matches!(sampler, SamplerKind::Adaptive { .. });
                match reconstruction {
                    ReconstructionKind::Hold if !is_adaptive => sampler_name(sampler),
                    other => format!("{}+{}", sampler_name(sampler), other.name()),
                }
            }
            plain => {
                let found = PLAIN.into_iter().find(|(_, algorithm)| algorithm == plain);
                found.expect("every other algorithm is listed").0.into()
            }
        }
    }

    /// Whether the seed makes a difference; one seed is enough for those where it makes none.
    pub fn is_seeded(&self) -> bool {
        match self {
            Algorithm::Frameless(..) | Algorithm::Progressive => true,
            Algorithm::Framed
            | Algorithm::FramedSingle
            | Algorithm::LowRes { .. }
            | Algorithm::Temporal
            | Algorithm::OracleHold => false,
        }
    }

    /// Another algorithm that shows exactly the same at this rate, if there is one; else this. Where a refresh has time for a
    /// whole picture, low resolution and temporal upsampling are plain frames.
    pub(crate) fn same_at(&self, size: Size, display_hz: u32, samples_per_sec: f64) -> Algorithm {
        let is_whole = samples_per_sec / f64::from(display_hz) >= size.pixels() as f64;
        match self {
            Algorithm::LowRes { refreshes_per_frame: 1 } | Algorithm::Temporal if is_whole => {
                Algorithm::Framed
            }
            other => other.clone(),
        }
    }

    /// The algorithm at work, at time 0.
    pub(crate) fn contender<'a>(&self, arena: Arena<'a>) -> Box<dyn Contender + 'a> {
        match *self {
            Algorithm::Frameless(
                kind @ (SamplerKind::Random | SamplerKind::Permutation),
                ReconstructionKind::Hold,
            ) => Box::new(Blind::new(arena, kind.build(arena.seed))),
            Algorithm::Frameless(kind, reconstruction) => {
                Box::new(Frameless::new(arena, kind.build(arena.seed), reconstruction))
            }
            Algorithm::Framed => Box::new(Framed::new(arena)),
            Algorithm::FramedSingle => Box::new(FramedSingle::new(arena)),
            Algorithm::LowRes { refreshes_per_frame } => {
                Box::new(LowRes::new(arena, refreshes_per_frame))
            }
            Algorithm::Progressive => Box::new(Progressive::new(arena)),
            Algorithm::Temporal => Box::new(Temporal::new(arena)),
            Algorithm::OracleHold => Box::new(OracleHold::contender(arena)),
        }
    }
}

/// A sampler by its name in those of algorithms, with its parameters: `change(w_d=0.7,tile=8)`.
///
/// # Errors
/// What was wanted, if there is no such sampler.
pub fn sampler_from_name(name: &str) -> Result<SamplerKind, String> {
    let unknown = || {
        let known = SamplerKind::ALL.map(|kind| kind.name()).join(", ");
        format!("wanted one of {known}; got {name:?}")
    };
    with_brackets(name).ok_or_else(unknown)?.map_err(|wrong| format!("{wrong}; got {name:?}"))
}

/// `None` if there is no sampler of that name.
fn with_brackets(name: &str) -> Option<Result<SamplerKind, String>> {
    match name.split_once('(') {
        None => SamplerKind::from_name(name).map(Ok),
        Some((head, rest)) => Some(with_parameters(SamplerKind::from_name(head)?, rest)),
    }
}

/// The sampler's name with its parameters, and how its samples are shown; `None` if there is no such reconstruction.
fn split_reconstruction(name: &str) -> Option<(&str, ReconstructionKind)> {
    match name.split_once('+') {
        Some((sampler, shown)) => Some((sampler, ReconstructionKind::from_name(shown)?)),
        None => Some((name, ReconstructionKind::Hold)),
    }
}

fn sampler_name(kind: &SamplerKind) -> String {
    match kind {
        SamplerKind::Change { w_d, tile } if *kind != SamplerKind::CHANGE => {
            format!("change(w_d={w_d},tile={tile})")
        }
        SamplerKind::Adaptive(options) => {
            let named = adaptive_parameters(options)
                .into_iter()
                .zip(adaptive_parameters(&Default::default()));
            let other = named.filter(|((_, value), (_, default))| value != default);
            let strengths = other.map(|((key, value), _)| format!("{key}={value}"));
            let without = options.without.map(|stage| format!("without={}", stage.name()));
            let given: Vec<String> = strengths.chain(without).collect();
            match given.is_empty() {
                true => kind.name().into(),
                false => format!("{}({})", kind.name(), given.join(",")),
            }
        }
        kind => kind.name().into(),
    }
}

/// Name and value of all numbers that `adaptive` is told.
fn adaptive_parameters(options: &AdaptiveOptions) -> [(&'static str, f32); 4] {
    let AdaptiveOptions { temporal, contrast, flow, gaze, without: _ } = *options;
    [("temporal", temporal), ("contrast", contrast), ("flow", flow), ("gaze", gaze)]
}

/// `text` is what stands behind the opening bracket.
fn with_parameters(kind: SamplerKind, text: &str) -> Result<SamplerKind, String> {
    let example = match kind {
        SamplerKind::Change { .. } => "change(w_d=0.9,tile=16)",
        SamplerKind::Adaptive { .. } => "adaptive(temporal=0.5) or adaptive(without=fronts)",
        _ => return Err(format!("{} has no parameters", kind.name())),
    };
    let wrong = || format!("wanted {example}");
    let mut kind = kind;
    for parameter in text.strip_suffix(')').ok_or_else(wrong)?.split(',') {
        let (key, value) = parameter.split_once('=').ok_or_else(wrong)?;
        let value = value.trim();
        match (&mut kind, key.trim()) {
            (SamplerKind::Change { w_d, .. }, "w_d") => {
                *w_d = value.parse().map_err(|_| wrong())?
            }
            (SamplerKind::Change { tile, .. }, "tile") => {
                *tile = value.parse().map_err(|_| wrong())?
            }
            (SamplerKind::Adaptive(options), "without") => {
                options.without = Some(AdaptiveStage::from_name(value).ok_or_else(wrong)?)
            }
            (SamplerKind::Adaptive(options), key) => {
                let parameter = match key {
                    "temporal" => &mut options.temporal,
                    "contrast" => &mut options.contrast,
                    "flow" => &mut options.flow,
                    "gaze" => &mut options.gaze,
                    _ => return Err(wrong()),
                };
                *parameter = value.parse().map_err(|_| wrong())?
            }
            _ => return Err(wrong()),
        }
    }
    match kind {
        SamplerKind::Change { w_d, tile } if !(0.0..=1.0).contains(&w_d) || tile == 0 => {
            Err("w_d must be in [0, 1] and tile at least 1".to_owned())
        }
        SamplerKind::Adaptive(AdaptiveOptions { temporal, contrast, flow, gaze, .. }) => {
            let is_part = [temporal, gaze].iter().all(|part| (0.0..=1.0).contains(part));
            let is_strength = [contrast, flow].iter().all(|s| (-1.0..=1.0).contains(s));
            let ranges = "temporal and gaze must be in [0, 1], contrast and flow in [-1, 1]";
            let is_valid = is_part && is_strength;
            is_valid.then_some(kind).ok_or_else(|| ranges.to_owned())
        }
        kind => Ok(kind),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_there_and_back() {
        let plain = PLAIN.map(|(name, _)| name);
        let samplers = [
            "random",
            "permutation",
            "change",
            "change(w_d=0.5,tile=8)",
            "change+filter",
            "permutation+reproject",
            "adaptive+hold",
            "adaptive+reproject",
            "adaptive+reproject+deep",
            "adaptive(temporal=0.25)+reproject+relight",
            "adaptive(contrast=-0.5,gaze=1)+reproject",
            "adaptive(without=fronts)+reproject",
            "adaptive(without=holes)+reproject",
            "adaptive(without=rates)+reproject",
            "adaptive(temporal=0.25,without=bayer)+reproject(without=aim)+deep",
        ];
        for name in plain.into_iter().chain(samplers) {
            assert_eq!(Algorithm::from_name(name).expect(name).name(), name);
        }
        assert_eq!(
            Algorithm::from_name("change+hold").expect("hold is what it is").name(),
            "change"
        );
    }

    #[test]
    fn nonsense_is_refused_by_name() {
        for name in [
            "",
            "chance",
            "random(w_d=1)",
            "change(w_d=2)",
            "change(tile=0)",
            "change(x=1)",
            "change(temporal=1)",
            "adaptive(temporal=2)",
            "adaptive(gaze=-1)",
            "adaptive(flow=NaN)",
            "adaptive(speed=1)",
            "adaptive+deep",
            "adaptive(without=aim)",
            "adaptive+reproject(without=rates)",
            "change(w_d",
        ] {
            let message = Algorithm::from_name(name).expect_err(name);
            assert!(message.contains(&format!("{name:?}")), "{message}");
        }
    }
}
