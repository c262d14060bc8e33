//! The contract between the loop and whoever decides which pixels are traced next.

use crate::{Canvas, Rates, Request, Time, Weights};

/// What became of one sample, as told to the sampler.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Observation {
    /// Which pixel was traced.
    pub pixel: u32,
    /// When it was traced, as [`Canvas::time`] has it.
    pub now: Time,
    /// When what the pixel showed had been traced; [`Time::ZERO`] if never.
    pub previous: Time,
    /// Whether anything was known of the pixel; if not, `change` says nothing. See [`Canvas::known`].
    pub known: bool,
    /// d = Σₖ (newₖ − oldₖ)² over display-referred sRGB in [0, 1], old being what the picture showed there: between 0 (nothing
    /// changed) and 3.
    pub change: f32,
    /// For a sample that was added to others of a pixel at rest; its `change` is 0, since it says nothing of change.
    pub refinement: Option<Refinement>,
}

/// What a sample told that was added to others of a pixel at rest, taken elsewhere in the pixel or with other random numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Refinement {
    /// An estimate of the variance of the pixel's samples: Σₖ (newₖ − meanₖ)² · n/(n + 1) over display-referred sRGB, for a mean of
    /// n samples.
    pub deviation: f32,
    /// Whether it is so far off that the pixel had better be looked at again.
    pub suspect: bool,
}

/// Chooses the pixels that are traced next.
///
/// The engine calls [`choose`](Sampler::choose) before every batch and [`observe`](Sampler::observe) once for the answers that have
/// come since, in a fixed order. Between the two any number of other batches may have been chosen, and
/// samples that were chosen may never be observed. Both are called from one thread.
///
/// The same calls give the same choices: all randomness comes from the seed given at construction.
pub trait Sampler: Send {
    /// Append `count` requests to `requests`. `canvas` is the picture so far; `now` is never earlier than
    /// any time in it. Its size may differ from call to call, see [`Canvas::generation`].
    fn choose(&mut self, now: Time, canvas: &Canvas, count: usize, requests: &mut Vec<Request>);

    /// Learn from samples that have just been written to `canvas`.
    fn observe(&mut self, canvas: &Canvas, observations: &[Observation]) {
        let _ = (canvas, observations);
    }

    /// Trade temporal against spatial accuracy from now on: 1 sends every sample where the picture changes now, 0 finishes
    /// what is there. What has been learned stays. Samplers that have no such choice ignore it.
    fn set_temporal(&mut self, temporal: f32) {
        let _ = temporal;
    }

    /// Count parts of the picture differently from now on. What has been learned stays. Samplers that know no weights ignore it.
    fn set_weights(&mut self, weights: &Weights) {
        let _ = weights;
    }

    /// Whether [`Canvas::tile_motion`] is of use.
    fn wants_motion(&self) -> bool {
        false
    }

    /// Whether it asks for further samples of pixels at rest ([`Canvas::samples`]) by itself. If not, the engine makes such of three in four
    /// of its requests for them, and does not tell it what became of those: they say nothing of change.
    fn refines(&self) -> bool {
        false
    }

    /// How fast each part of the picture changes, if the sampler learns it; reconstructions weigh samples with it.
    fn rates(&self) -> Option<&Rates> {
        None
    }

    /// What the sampler knows of the picture, for overlays and experiments. Slow; not for the loop.
    fn inspect(&self, now: Time, canvas: &Canvas) -> Insight {
        let _ = (now, canvas);
        Insight::default()
    }
}

/// A sampler's view of the picture. Empty where the sampler keeps no such thing.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Insight {
    /// Change d per pixel, row-major; in [0, 3].
    pub change: Vec<f32>,
    /// Probability per pixel that the next draw is this pixel, row-major; sums to 1.
    pub probability: Vec<f32>,
    /// Probability per pixel's tile that the next draw falls into the tile, row-major per pixel.
    pub tile_probability: Vec<f32>,
}
