//! How good was it: any algorithm at any rate against the ideal instantaneous renderer.
//!
//! An [`Experiment`] (TOML) names scenes, algorithms, rates and seeds. [`compare`] traces the ideal pictures once per
//! scene, runs every combination on the simulated clock, and writes numbers, curves, stills and videos.

mod algorithm;
mod camera_path;
mod compare;
mod contender;
mod contenders;
mod difference;
mod error;
mod experiment;
mod ideal;
#[cfg(test)]
mod made_up;
mod metrics;
mod output;
mod ranking;
mod record;
mod results;
mod results_file;
mod run;
mod script;
mod selection;
mod subject;

pub use algorithm::{Algorithm, sampler_from_name};
pub use camera_path::CameraPath;
pub use experiment::{
    Action, EqualQualitySpec, EventSpec, Experiment, Goal, IDEAL, MetricsSpec, Mover, SceneSource,
    SceneSpec,
};

pub use subject::{Subject, SubjectTracer};

pub use contender::{Arena, Contender, Shown};
pub use ideal::{IdealAtRest, IdealEvent, Ideals, refresh_time};
pub use run::{Cell, run, run_sampler};

pub use metrics::{Picture, changed_region, flip, mean, psnr_db, quantile, rmse, rmse_where, ssim};
pub use results::{
    AtRest, Bound, Curve, EqualQuality, EventResult, RESULTS_VERSION, Results, RunResult,
};

pub use compare::{Progress, compare};
pub use difference::{Difference, DifferenceRow, Measure, RunGroup, Verdict};
pub use error::EvalError;
pub use ranking::{Metric, Ranking, RankingRow};
pub use selection::Selection;
