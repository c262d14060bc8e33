//! Frameless rendering: choose a pixel, trace it *now*, show it at once, and learn from what changed.
//!
//! The actors: a [`Tracer`] is a renderer; a [`Sampler`] chooses which pixels it traces next; the [`Canvas`] keeps the
//! newest sample of every pixel; the [`Engine`] is the loop between them, on a [`Clock`] that is real or simulated.
//! A [`Reconstruction`] makes a picture of the samples at any time. The defaults of [`SamplerKind`] and
//! [`ReconstructionKind`] are the best that there is; [`Engine::new`] begins with [`Hold`], which asks nothing of a renderer.
//!
//! ```
//! use frameless::{
//!     Batch, Clock, Engine, Function, ReconstructionKind, SamplerKind, Size, Time,
//! };
//!
//! // A renderer: any function from pixels and a time to linear RGB.
//! let render = |batch: &Batch| -> Vec<[f32; 3]> {
//!     let brightness = (batch.scene_secs as f32).sin().abs();
//!     batch.requests.iter().map(|_| [brightness; 3]).collect()
//! };
//! let sampler = SamplerKind::default().build(1);
//! let mut engine =
//!     Engine::new(Size::new(64, 48), Clock::simulated(100_000.0), sampler, Function::new(render));
//! engine.set_reconstruction(ReconstructionKind::default().build());
//! engine.run_until(Time::from_secs(0.5))?;
//! let srgb: &[[f32; 3]] = engine.refresh(Time::from_secs(0.5));
//! assert_eq!(srgb.len(), 64 * 48);
//! # Ok::<(), frameless::EngineError>(())
//! ```

mod add_up;
mod alias;
mod bands;
mod batch_length;
mod bayer;
mod beside;
mod bilinear;
mod canvas;
mod clock;
mod display;
mod engine;
mod lighting;
mod pages;
mod pose;
mod rates;
mod reconstruction;
mod replaced;
mod rng;
mod sample;
mod sampler;
mod samplers;
mod spare;
mod tile;
mod tile_pdf;
mod time;
mod timeline;
mod tone_map;
mod traced;
mod tracer;
mod weights;
mod wide;

pub use time::Time;

pub use sample::{Answer, Batch, Request, Size, Surface};

pub use sampler::{Insight, Observation, Refinement, Sampler};
pub use samplers::{
    Adaptive, AdaptiveOptions, AdaptiveStage, Change, DEFAULT_TILE, DEFAULT_W_D, Permutation,
    Random, SamplerKind,
};
pub use weights::{Gaze, WeightError, Weights};

pub use lighting::{Arriving, Light, Lighting, Placement};
pub use pose::{Deformed, Pose, Projected, Projection, Window};
pub use tracer::{Function, Tracer};

pub use canvas::Canvas;

pub use batch_length::BatchLength;
pub use clock::{BATCHES_PER_SEC, Clock, Real, Simulated};
pub use engine::{Counters, Engine, EngineError};
pub use timeline::Timeline;

pub use display::Display;
pub use rates::Rates;
pub use reconstruction::{
    Filter, Findings, Hold, Kept, Reconstruction, ReconstructionKind, Refresh, Reproject,
    ReprojectOptions, ReprojectStage, hold, hold_into,
};
pub use tone_map::ToneMap;

pub use pages::prefer_large_pages;
pub use rng::Rng;
