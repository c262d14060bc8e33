//! Reconstructions, one file each: how the picture is made of the samples.

mod contrast;
mod filter;
mod hold;
mod reproject;

pub use filter::Filter;
pub use hold::{Hold, hold, hold_into};
pub use reproject::{Reproject, ReprojectStage};

use crate::{Canvas, Display, Lighting, Pose, Rates, Refinement, Request, Size, Surface, Time};

/// The samples of one answer, in its order, just written to the canvas.
#[derive(Clone, Copy)]
pub struct Kept<'a> {
    /// When they were traced.
    pub now: Time,
    /// Of the picture.
    pub size: Size,
    /// Where.
    pub requests: &'a [Request],
    /// Linear RGB, as traced.
    pub new: &'a [[f32; 3]],
    /// Linear RGB that the canvas had there.
    pub old: &'a [[f32; 3]],
    /// What was hit; empty if the renderer cannot tell.
    pub surfaces: &'a [Surface],
    /// See [`crate::Tracer::is_noisy`].
    pub is_noisy: bool,
}

/// What the samples of one answer told, one entry each, in its order.
#[derive(Clone, Debug, Default)]
pub struct Findings {
    /// d = Σₖ (newₖ − shownₖ)² over display-referred sRGB: how far each was from what the picture showed there.
    pub changes: Vec<f32>,
    /// What those told that were added to others of a pixel at rest. May be empty: none was.
    pub refinements: Vec<Option<Refinement>>,
}

/// What a picture is made for.
#[derive(Clone, Copy)]
pub struct Refresh<'a> {
    /// When the picture will be looked at.
    pub now: Time,
    /// Where everything is then; `None` if the renderer cannot tell.
    pub pose: Option<&'a Pose>,
    /// The lights then; `None` if the renderer cannot tell, or nobody wants to know.
    pub lighting: Option<&'a Lighting>,
    /// How radiance is shown.
    pub display: &'a Display,
    /// See [`crate::Tracer::is_noisy`].
    pub is_noisy: bool,
    /// How fast each part of the picture changes; `None` if nobody has learned it.
    pub rates: Option<&'a Rates>,
    /// Whether the sampler wants to know [`Canvas::tile_motion`].
    pub wants_motion: bool,
    /// How many threads may work on the picture; it is the same with any number.
    pub threads: usize,
}

/// Makes pictures of samples.
pub trait Reconstruction: Send {
    /// Takes samples, and says what they told. `findings` are empty before.
    fn keep(&mut self, kept: &Kept<'_>, display: &Display, findings: &mut Findings);

    /// Where in its pixel each chosen sample is best taken at `now`; may move requests to neighbouring pixels.
    fn aim(&self, now: Time, canvas: &Canvas, requests: &mut [Request]) {
        let _ = (now, canvas, requests);
    }

    /// Whether a refresh needs no colours of the canvas, but for the first of a size.
    fn has_own_samples(&self) -> bool {
        false
    }

    /// Whether [`Refresh::lighting`] is of use.
    fn wants_lighting(&self) -> bool {
        false
    }

    /// Makes [`Reconstruction::picture`] anew, and tells the canvas what the pixels show by then.
    fn refresh(&mut self, refresh: &Refresh<'_>, canvas: &mut Canvas);

    /// The picture of the last refresh, display-referred sRGB in [0, 1], row-major; empty before the first.
    fn picture(&self) -> &[[f32; 3]];
}

/// The reconstructions that come with the crate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ReconstructionKind {
    /// [`Hold`].
    Hold,
    /// [`Filter`].
    Filter,
    /// [`Reproject`]. A renderer that returns no surfaces gets [`Hold`]'s picture of it.
    Reproject(ReprojectOptions),
}

/// What [`Reproject`] does beyond carrying samples along.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ReprojectOptions {
    /// Stored surfaces are shaded again with the present lights, if the renderer tells of them.
    pub relight: bool,
    /// 2×2 cells per pixel.
    pub deep: bool,
    /// Where the picture rests, jittered samples add up.
    pub antialias: bool,
    /// What an experiment leaves out; `None`: nothing.
    pub without: Option<ReprojectStage>,
}

/// `reproject+relight+antialias`: the best that there is, wherever the renderer tells of surfaces.
impl Default for ReconstructionKind {
    fn default() -> ReconstructionKind {
        ReconstructionKind::Reproject(ReprojectOptions {
            relight: true,
            deep: false,
            antialias: true,
            without: None,
        })
    }
}

impl ReconstructionKind {
    /// [`Reproject`] without options.
    pub const REPROJECT: ReconstructionKind = ReconstructionKind::Reproject(ReprojectOptions {
        relight: false,
        deep: false,
        antialias: false,
        without: None,
    });

    /// The name used on the command line and in experiments: `hold`, `filter`, `reproject`, the last with what
    /// it leaves out (`reproject(without=aim)`) and followed by `+relight`, `+deep`, `+antialias` as far as they are on.
    pub fn name(&self) -> String {
        match self {
            ReconstructionKind::Hold => "hold".into(),
            ReconstructionKind::Filter => "filter".into(),
            ReconstructionKind::Reproject(options) => {
                let named = [
                    ("+relight", options.relight),
                    ("+deep", options.deep),
                    ("+antialias", options.antialias),
                ];
                let on = named.iter().filter(|(_, is_on)| *is_on).map(|(name, _)| *name);
                let kind = match options.without {
                    Some(stage) => format!("reproject(without={})", stage.name()),
                    None => "reproject".into(),
                };
                std::iter::once(kind.as_str()).chain(on).collect()
            }
        }
    }

    /// The kind of that name; options in any order.
    pub fn from_name(name: &str) -> Option<ReconstructionKind> {
        let mut parts = name.split('+');
        let mut options = ReprojectOptions::default();
        let mut kind = parts.next()?;
        if let Some((head, stage)) = kind.split_once("(without=") {
            options.without = Some(ReprojectStage::from_name(stage.strip_suffix(')')?)?);
            kind = head;
        }
        for part in parts {
            let option = match part {
                "relight" => &mut options.relight,
                "deep" => &mut options.deep,
                "antialias" => &mut options.antialias,
                _ => return None,
            };
            if std::mem::replace(option, true) {
                return None;
            }
        }
        match kind {
            "reproject" => Some(ReconstructionKind::Reproject(options)),
            _ if options != ReprojectOptions::default() => None,
            "hold" => Some(ReconstructionKind::Hold),
            "filter" => Some(ReconstructionKind::Filter),
            _ => None,
        }
    }

    /// One of this kind, with nothing kept yet.
    pub fn build(&self) -> Box<dyn Reconstruction> {
        match *self {
            ReconstructionKind::Hold => Box::new(Hold::default()),
            ReconstructionKind::Filter => Box::new(Filter::default()),
            ReconstructionKind::Reproject(options) => Box::new(Reproject::new(options)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_there_and_back() {
        for name in
            ["hold", "filter", "reproject", "reproject+deep", "reproject+relight+deep+antialias"]
        {
            let kind = ReconstructionKind::from_name(name).expect(name);
            assert_eq!(kind.name(), name);
        }
        for stage in ReprojectStage::ALL {
            let name = format!("reproject(without={})+relight", stage.name());
            let kind = ReconstructionKind::from_name(&name).expect(&name);
            assert_eq!(kind.name(), name);
        }
        let other_order =
            ReconstructionKind::from_name("reproject+deep+relight").expect("any order");
        assert_eq!(other_order.name(), "reproject+relight+deep");
        for name in [
            "",
            "held",
            "hold+deep",
            "reproject+",
            "reproject+deep+deep",
            "+deep",
            "reproject(without=aim",
            "reproject(without=fronts)",
            "filter(without=aim)",
        ] {
            assert_eq!(ReconstructionKind::from_name(name), None, "{name}");
        }
    }
}
