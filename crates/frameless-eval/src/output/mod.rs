//! What an experiment leaves behind for people: stills, curves, videos.

mod folder;
mod plot;
mod strip;
mod text;
mod video;

pub(crate) use folder::OutputFolder;
pub(crate) use plot::plot_curves;
pub(crate) use strip::{Strip, strip_size, write_still};
pub(crate) use video::write_video;
