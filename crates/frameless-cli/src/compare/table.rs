//! The errors of a comparison as text: algorithms by scenes, one table per rate.

use std::fmt::Write;

use frameless_eval::{Metric, Ranking, Results};

use crate::output::printable;

pub(super) fn of(results: &Results) -> String {
    let mut text = format!("{}\n", printable(&results.title));
    text += "mean RMSE against the ideal, in sRGB [0, 1], mean over the seeds; mean: geometric, of all scenes\n";
    for rate in results.rates() {
        let ranking = Ranking::new(results, rate, Metric::Rmse);
        let widest = ranking.rows.iter().map(|row| row.algorithm.len()).max().unwrap_or(0);
        // Writing to a string cannot fail.
        let _ = write!(text, "\n{:widest$}  {:>8}", format!("{rate} samples/s"), "mean");
        for scene in &ranking.scenes {
            let _ = write!(text, "  {scene:>8}");
        }
        text += "\n";
        for row in &ranking.rows {
            let _ = write!(text, "{:widest$}  {}", row.algorithm, shown(row.mean, 8));
            for (scene, value) in ranking.scenes.iter().zip(&row.by_scene) {
                let _ = write!(text, "  {}", shown(*value, scene.len().max(8)));
            }
            text += "\n";
        }
    }
    text
}

fn shown(value: Option<f64>, width: usize) -> String {
    let text = value.map_or_else(|| "-".into(), |value| Metric::Rmse.shown(value));
    format!("{text:>width$}")
}
