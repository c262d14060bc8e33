//! Reconstructions, one file each: how the picture is made of the samples.

mod contrast;
mod filter;
mod hold;
mod reproject;

pub use filter::Filter;
pub use hold::{Hold, hold, hold_into};
pub use reproject::Reproject;

use crate::{Canvas, Display, Pose, Rates, Request, Size, Surface, Time};

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
}

/// What a picture is made for.
#[derive(Clone, Copy)]
pub struct Refresh<'a> {
    /// When the picture will be looked at.
    pub now: Time,
    /// Where everything is then; `None` if the renderer cannot tell.
    pub pose: Option<&'a Pose>,
    /// How radiance is shown.
    pub display: &'a Display,
    /// How fast each part of the picture changes; `None` if nobody has learned it.
    pub rates: Option<&'a Rates>,
}

/// Makes pictures of samples.
pub trait Reconstruction: Send {
    /// Takes samples, and says how far each was from what the picture showed there: d = Σₖ (newₖ − shownₖ)² over
    /// display-referred sRGB. `changes` is empty before.
    fn keep(&mut self, kept: &Kept<'_>, display: &Display, changes: &mut Vec<f32>);

    /// Where in its pixel each chosen sample is best taken at `now`; may move requests to neighbouring pixels.
    fn aim(&self, now: Time, canvas: &Canvas, requests: &mut [Request]) {
        let _ = (now, canvas, requests);
    }

    /// The picture, display-referred sRGB in [0, 1], row-major. Also tells the canvas what the pixels show by then.
    fn refresh(&mut self, refresh: &Refresh<'_>, canvas: &mut Canvas, picture: &mut Vec<[f32; 3]>);
}

/// The reconstructions that come with the crate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ReconstructionKind {
    /// [`Hold`].
    Hold,
    /// [`Filter`].
    Filter,
    /// [`Reproject`].
    Reproject,
    /// [`Reproject`] with 2×2 cells per pixel.
    Deep,
}

impl ReconstructionKind {
    /// One of this kind, with nothing kept yet.
    pub fn build(&self) -> Box<dyn Reconstruction> {
        match self {
            ReconstructionKind::Hold => Box::new(Hold::default()),
            ReconstructionKind::Filter => Box::new(Filter::default()),
            ReconstructionKind::Reproject => Box::new(Reproject::new(1)),
            ReconstructionKind::Deep => Box::new(Reproject::new(2)),
        }
    }
}
