//! Who is best: algorithms by scenes, for one metric at one rate.

use crate::results::{Results, RunResult};

/// What is looked at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Metric {
    /// Mean RMSE.
    Rmse,
    /// 95th percentile of the RMSE.
    RmseP95,
    /// Mean RMSE over the changed region.
    RmseChanged,
    /// Mean PSNR.
    Psnr,
    /// Mean SSIM.
    Ssim,
    /// Mean FLIP.
    Flip,
    /// Mean age of a pixel.
    Age,
}

impl Metric {
    /// All of them, the most important first.
    pub const ALL: [Metric; 7] = [
        Metric::Rmse,
        Metric::RmseP95,
        Metric::RmseChanged,
        Metric::Psnr,
        Metric::Ssim,
        Metric::Flip,
        Metric::Age,
    ];

    /// As people call it.
    pub fn name(self) -> &'static str {
        match self {
            Metric::Rmse => "RMSE",
            Metric::RmseP95 => "RMSE, 95th percentile",
            Metric::RmseChanged => "RMSE of changed region",
            Metric::Psnr => "PSNR",
            Metric::Ssim => "SSIM",
            Metric::Flip => "FLIP",
            Metric::Age => "Age",
        }
    }

    /// What it says, in a sentence.
    pub fn explanation(self) -> &'static str {
        match self {
            Metric::Rmse => {
                "Root mean squared error against the ideal over all pixels and channels, sRGB in [0, 1]; lower is better."
            }
            Metric::RmseP95 => {
                "The RMSE that one refresh in twenty exceeds: the bad moments; lower is better."
            }
            Metric::RmseChanged => {
                "RMSE over the pixels whose ideal has changed by more than 0.04 within the last 100 ms; lower is better."
            }
            Metric::Psnr => {
                "Peak signal-to-noise ratio in dB, of the mean squared error; higher is better."
            }
            Metric::Ssim => {
                "Structural similarity to the ideal (Wang et al. 2004), 1 for equal pictures; higher is better."
            }
            Metric::Flip => {
                "Difference that an eye sees when flipping between both (Andersson et al. 2020), 0 to 1; lower is better."
            }
            Metric::Age => {
                "How long ago the moment was that a pixel shows, in milliseconds, mean over pixels and refreshes. What is \
                 reprojected or predicted may be old and right."
            }
        }
    }

    /// Whether more is better.
    pub fn is_higher_better(self) -> bool {
        matches!(self, Metric::Psnr | Metric::Ssim)
    }

    /// With so many decimals, in the unit of the explanation.
    pub fn shown(self, value: f64) -> String {
        match self {
            Metric::Rmse | Metric::RmseP95 | Metric::RmseChanged | Metric::Flip | Metric::Ssim => {
                format!("{value:.4}")
            }
            Metric::Psnr => format!("{value:.2}"),
            Metric::Age => format!("{:.1}", value * 1000.0),
        }
    }

    /// The value of one run.
    pub fn of(self, run: &RunResult) -> Option<f64> {
        let curve = match self {
            Metric::RmseP95 => return run.rmse.p95,
            Metric::Rmse => &run.rmse,
            Metric::RmseChanged => &run.rmse_changed,
            Metric::Psnr => &run.psnr_db,
            Metric::Ssim => &run.ssim,
            Metric::Flip => &run.flip,
            Metric::Age => &run.age_secs,
        };
        curve.mean
    }

    /// Means over scenes are geometric where ratios count, so that no scene outweighs the others; decibels are logarithms
    /// already, and SSIM is no ratio.
    pub fn is_mean_geometric(self) -> bool {
        !matches!(self, Metric::Psnr | Metric::Ssim)
    }
}

/// A table of algorithms by scenes, the best algorithm first.
#[derive(Clone, Debug, PartialEq)]
pub struct Ranking {
    /// What the columns are.
    pub scenes: Vec<String>,
    /// Sorted by `mean`; those without come last, in the results' order.
    pub rows: Vec<RankingRow>,
}

/// One algorithm.
#[derive(Clone, Debug, PartialEq)]
pub struct RankingRow {
    /// Its name.
    pub algorithm: String,
    /// Mean over the seeds, per scene; `None` where it was not measured.
    pub by_scene: Vec<Option<f64>>,
    /// Over all scenes, geometric or arithmetic as [`Metric::is_mean_geometric`] says; `None` unless every scene has a value.
    pub mean: Option<f64>,
}

impl Ranking {
    /// Of the runs at one rate.
    pub fn new(results: &Results, samples_per_sec: f64, metric: Metric) -> Ranking {
        let scenes = results.scenes();
        let row = |algorithm: String| {
            let by_scene: Vec<Option<f64>> = scenes
                .iter()
                .map(|scene| {
                    let runs = results.seeds_of(scene, &algorithm, samples_per_sec);
                    mean_of(runs.filter_map(|run| metric.of(run)))
                })
                .collect();
            let all: Option<Vec<f64>> = by_scene.iter().copied().collect();
            let mean = all.and_then(|all| {
                if metric.is_mean_geometric() { geometric_mean(&all) } else { mean_of(all) }
            });
            RankingRow { algorithm, by_scene, mean }
        };
        let mut rows: Vec<RankingRow> = results.algorithms().into_iter().map(row).collect();
        let sign = if metric.is_higher_better() { -1.0 } else { 1.0 };
        let order = |row: &RankingRow| row.mean.map_or(f64::INFINITY, |mean| sign * mean);
        rows.sort_by(|a, b| order(a).total_cmp(&order(b)));
        Ranking { scenes, rows }
    }
}

impl Results {
    /// The scenes' names, in the order of their runs.
    pub fn scenes(&self) -> Vec<String> {
        distinct(self.runs.iter().map(|run| run.scene.clone()))
    }

    /// The algorithms' names, in the order of their runs.
    pub fn algorithms(&self) -> Vec<String> {
        distinct(self.runs.iter().map(|run| run.algorithm.clone()))
    }

    /// The rates, in the order of their runs.
    pub fn rates(&self) -> Vec<f64> {
        distinct(self.runs.iter().map(|run| run.samples_per_sec))
    }

    /// The runs that differ by their seed only.
    pub fn seeds_of<'a>(
        &'a self,
        scene: &'a str,
        algorithm: &'a str,
        samples_per_sec: f64,
    ) -> impl Iterator<Item = &'a RunResult> {
        self.runs.iter().filter(move |run| {
            run.scene == scene
                && run.algorithm == algorithm
                && run.samples_per_sec == samples_per_sec
        })
    }
}

fn distinct<T: PartialEq>(all: impl Iterator<Item = T>) -> Vec<T> {
    let mut distinct = Vec::new();
    for one in all {
        if !distinct.contains(&one) {
            distinct.push(one);
        }
    }
    distinct
}

fn mean_of(values: impl IntoIterator<Item = f64>) -> Option<f64> {
    crate::metrics::mean(values)
}

/// exp(mean of logarithms); 0 if one of the values is, `None` of none.
pub(crate) fn geometric_mean(values: &[f64]) -> Option<f64> {
    mean_of(values.iter().map(|value| value.ln())).map(f64::exp)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::made_up::results_of;

    #[test]
    fn the_best_comes_first_and_means_are_over_all_scenes() {
        let results = results_of(&[
            ("sphere", "framed", &[0.1]),
            ("sphere", "change", &[0.03, 0.05]),
            ("sphere", "new", &[0.01]),
            ("many", "framed", &[0.4]),
            ("many", "change", &[0.09]),
        ]);
        let ranking = Ranking::new(&results, 900_000.0, Metric::Rmse);
        assert_eq!(ranking.scenes, ["sphere", "many"]);
        let names: Vec<&str> = ranking.rows.iter().map(|row| row.algorithm.as_str()).collect();
        assert_eq!(names, ["change", "framed", "new"], "`new` lacks a scene");
        let means: Vec<Option<f64>> = ranking.rows.iter().map(|row| row.mean).collect();
        assert!((means[0].expect("both") - 0.06).abs() < 1e-12, "√(0.04 · 0.09)");
        assert!((means[1].expect("both") - 0.2).abs() < 1e-12);
        assert_eq!(means[2], None);
        assert!(
            Ranking::new(&results, 1.0, Metric::Rmse).rows.iter().all(|row| row.mean.is_none())
        );
    }

    #[test]
    fn geometric_means_by_hand() {
        assert_eq!(geometric_mean(&[]), None);
        assert_eq!(geometric_mean(&[0.0, 1.0]), Some(0.0));
        assert!((geometric_mean(&[1.0, 4.0]).expect("two") - 2.0).abs() < 1e-12);
    }
}
