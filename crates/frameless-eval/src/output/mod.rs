//! What an experiment leaves behind for people: stills, curves, videos, the report.

mod chart;
mod folder;
mod panel;
mod report;
mod strip;
mod text;
mod video;

pub(crate) use folder::{OutputFolder, folder_in};
pub(crate) use panel::write_panel;
pub(crate) use report::{Instant, Report, ScenePictures, error_chart};
pub(crate) use strip::{Rgb8, Strip, strip_size, write_still};
pub(crate) use video::Video;
