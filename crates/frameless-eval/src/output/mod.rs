//! What an experiment leaves behind for people: stills, curves, videos, the report.

mod folder;
mod panel;
mod plot;
mod strip;
mod text;
mod video;

pub(crate) use folder::{OutputFolder, folder_in};
pub(crate) use panel::{ERROR_GAIN, panel_files, write_panel};
pub(crate) use plot::plot_curves;
pub(crate) use strip::{Rgb8, Strip, strip_size, write_still};
pub(crate) use video::Video;
