//! The tables of an experiment file as they stand there, with their defaults.

use serde::Deserialize;

use super::event::EventTable;
use crate::camera_path::CameraSpec;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ExperimentFile {
    pub(super) title: String,
    #[serde(default = "default_algorithms")]
    pub(super) algorithms: Vec<String>,
    pub(super) samples_per_sec: Vec<f64>,
    #[serde(default = "default_seeds")]
    pub(super) seeds: Vec<u64>,
    #[serde(default = "default_width")]
    pub(super) width: u32,
    #[serde(default = "default_height")]
    pub(super) height: u32,
    #[serde(default = "default_display_hz")]
    pub(super) display_hz: u32,
    #[serde(default = "default_duration_secs")]
    pub(super) duration_secs: f64,
    #[serde(default = "default_unscored_secs")]
    pub(super) unscored_secs: f64,
    pub(super) scenes: Vec<SceneTable>,
    #[serde(default)]
    pub(super) output: OutputTable,
    #[serde(default)]
    pub(super) metrics: MetricsTable,
    pub(super) equal_quality: Option<EqualQualityTable>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SceneTable {
    pub(super) scene: String,
    pub(super) name: Option<String>,
    pub(super) camera: Option<CameraSpec>,
    #[serde(default)]
    pub(super) events: Vec<EventTable>,
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct OutputTable {
    #[serde(default)]
    pub(super) stills_secs: Vec<f64>,
    #[serde(default)]
    pub(super) show: Vec<String>,
    pub(super) video: Option<bool>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct EqualQualityTable {
    pub(super) algorithms: Vec<String>,
    pub(super) opponents: Vec<String>,
    #[serde(default = "default_max_factor")]
    pub(super) max_factor: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct MetricsTable {
    #[serde(default = "default_every")]
    pub(super) ssim_every: usize,
    #[serde(default = "default_every")]
    pub(super) flip_every: usize,
}

impl Default for MetricsTable {
    fn default() -> MetricsTable {
        MetricsTable { ssim_every: default_every(), flip_every: default_every() }
    }
}

fn default_every() -> usize {
    15
}
fn default_max_factor() -> f64 {
    64.0
}
fn default_algorithms() -> Vec<String> {
    ["random", "change", "adaptive+reproject"].map(String::from).to_vec()
}
fn default_seeds() -> Vec<u64> {
    vec![1]
}
fn default_width() -> u32 {
    512
}
fn default_height() -> u32 {
    384
}
fn default_display_hz() -> u32 {
    60
}
fn default_duration_secs() -> f64 {
    2.5
}
fn default_unscored_secs() -> f64 {
    0.5
}
