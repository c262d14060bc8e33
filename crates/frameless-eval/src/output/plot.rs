//! Error over time as curves.

use std::path::Path;

use plotters::prelude::*;

use super::text::register_font;
use crate::error::EvalError;
use crate::results::RunResult;

// Okabe and Ito 2008: told apart by colour-blind eyes too.
const COLOURS: [RGBColor; 7] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(230, 159, 0),
    RGBColor(86, 180, 233),
    RGBColor(60, 60, 60),
];

// Room above the curves for their names.
const HEADROOM: f64 = 1.4;

/// An SVG with one curve per run, one colour per algorithm: RMSE against the ideal at every refresh.
pub(crate) fn plot_curves(path: &Path, title: &str, runs: &[&RunResult]) -> Result<(), EvalError> {
    register_font();
    draw(path, title, runs).map_err(|error| EvalError::unwritable(path, error))
}

fn draw(
    path: &Path,
    title: &str,
    runs: &[&RunResult],
) -> Result<(), Box<dyn std::error::Error + Send + Sync>> {
    let mut algorithms: Vec<&str> = runs.iter().map(|run| run.algorithm.as_str()).collect();
    algorithms.dedup();
    let highest = runs
        .iter()
        .flat_map(|run| run.rmse.values.iter().flatten())
        .fold(0.0, |a: f64, &b| a.max(b));
    let secs_of = |run: &RunResult, k: usize| (k + 1) as f64 / f64::from(run.display_hz);
    let longest = runs.iter().map(|run| secs_of(run, run.refreshes - 1)).fold(0.0, f64::max);

    let mut svg = String::new();
    {
        let area = SVGBackend::with_string(&mut svg, (900, 420)).into_drawing_area();
        area.fill(&WHITE)?;
        let mut chart = ChartBuilder::on(&area)
            .margin(12)
            .caption(title, ("sans-serif", 20))
            .x_label_area_size(40)
            .y_label_area_size(60)
            .build_cartesian_2d(0.0..longest, 0.0..(highest * HEADROOM).max(1e-6))?;
        chart
            .configure_mesh()
            .x_desc("time (s)")
            .y_desc("RMSE against the ideal (sRGB)")
            .light_line_style(WHITE)
            .draw()?;
        for (algorithm, colour) in algorithms.iter().zip(COLOURS.into_iter().cycle()) {
            let style = colour.stroke_width(2);
            let seeds: Vec<_> = runs.iter().filter(|run| run.algorithm == *algorithm).collect();
            let mean =
                seeds.iter().filter_map(|run| run.rmse.mean).sum::<f64>() / seeds.len() as f64;
            for (k, run) in seeds.into_iter().enumerate() {
                let points = run
                    .rmse
                    .values
                    .iter()
                    .enumerate()
                    .filter_map(|(k, &e)| Some((secs_of(run, k), e?)));
                let curve = chart.draw_series(LineSeries::new(points, style))?;
                if k == 0 {
                    let line = move |(x, y)| PathElement::new([(x, y), (x + 18, y)], style);
                    curve.label(format!("{algorithm}: mean {mean:.4}")).legend(line);
                }
            }
        }
        chart
            .configure_series_labels()
            .position(SeriesLabelPosition::UpperRight)
            .background_style(WHITE.mix(0.8))
            .draw()?;
        area.present()?;
    }
    Ok(std::fs::write(path, svg)?)
}
