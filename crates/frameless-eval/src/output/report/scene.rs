//! One scene: the video, everybody at the same instants, and error over time.

use maud::{Markup, html};

use super::super::chart::{Chart, Series, colour_class};
use super::{Report, ScenePictures, gallery, words};
use crate::error::EvalError;
use crate::results::{EventResult, Results, RunResult};

pub(super) fn section(
    report: &Report,
    scene: &str,
    pictures: &ScenePictures,
) -> Result<Markup, EvalError> {
    let results = report.results;
    let gallery = gallery::of(report, scene, pictures)?;
    Ok(html! {
        section.scene id={ "scene-" (scene) } data-scene=(scene) {
            h2 { (scene) }
            (gallery)
            @for rate in results.rates() {
                div data-rate=(rate) {
                    h3 { "Error over time at " (words::rate(rate)) " samples/s" }
                    div.scroll { (error_chart(results, scene, rate).inline()) }
                    (latencies(results, scene, rate))
                    (at_rest(results, scene, rate))
                }
            }
        }
    })
}

/// RMSE at every refresh, mean over the seeds.
pub(crate) fn error_chart(results: &Results, scene: &str, samples_per_sec: f64) -> Chart {
    let secs_of = |run: &RunResult, k: usize| (k + 1) as f64 / f64::from(run.display_hz);
    let curve = |(index, name): (usize, String)| {
        let runs: Vec<&RunResult> = results.seeds_of(scene, &name, samples_per_sec).collect();
        let first = *runs.first()?;
        let curves: Vec<Vec<f64>> =
            runs.iter().map(|run| run.rmse.values.iter().map_while(|v| *v).collect()).collect();
        let points = (0..first.refreshes)
            .filter_map(|k| Some((secs_of(first, k), mean_at(&curves, k)?)))
            .collect();
        let means: Option<Vec<f64>> = runs.iter().map(|run| run.rmse.mean).collect();
        Some(Series { name, index, points, mean: crate::metrics::mean(means?)? })
    };
    let series = results.algorithms().into_iter().enumerate().filter_map(curve).collect();
    let run = results.runs.iter().find(|run| run.scene == scene);
    let end = run.map_or(1.0, |run| secs_of(run, run.refreshes - 1));
    Chart {
        y_label: format!("RMSE against the ideal, {scene}"),
        x_label: "seconds".into(),
        range: 0.0..end,
        unscored_until: run
            .map_or(0.0, |run| secs_of(run, results.unscored_refreshes) - secs_of(run, 0)),
        events: events_of(results, scene).iter().map(|e| (e.secs, e.name.clone())).collect(),
        series,
    }
}

/// The mean of all curves at entry `k`; `None` unless all have it.
fn mean_at(curves: &[Vec<f64>], k: usize) -> Option<f64> {
    let values: Option<Vec<f64>> = curves.iter().map(|curve| curve.get(k).copied()).collect();
    crate::metrics::mean(values?)
}

/// The scripted events of a scene: the same for all of its runs.
fn events_of<'a>(results: &'a Results, scene: &str) -> &'a [EventResult] {
    results.runs.iter().find(|run| run.scene == scene).map_or(&[], |run| &run.events)
}

fn latencies(results: &Results, scene: &str, samples_per_sec: f64) -> Markup {
    let events = events_of(results, scene);
    if events.is_empty() {
        return html! {};
    }
    html! {
        h3 { "Latency" }
        p.note {
            "From each event until 90 % of the pixels that it changes are within 0.05 of the ideal, mean over the seeds; “–”: not \
             before the next event, or nothing to follow."
        }
        div.scroll {
            table.sortable.numbers {
                thead {
                    tr {
                        th.name scope="col" { "algorithm" }
                        @for event in events {
                            th scope="col" {
                                (event.name) " at " (format!("{:.2}", event.secs)) " s"
                                small {
                                    @if event.changed_pixels == 0 { "changes nothing" }
                                    @else { (words::count(event.changed_pixels, "pixel")) }
                                }
                            }
                        }
                    }
                }
                tbody {
                    @for (index, name) in results.algorithms().into_iter().enumerate() {
                        tr {
                            th.name scope="row" { span class={ "swatch " (colour_class(index)) } {} (name) }
                            @for i in 0..events.len() {
                                @if let Some(secs) = latency(results, scene, &name, samples_per_sec, i) {
                                    td data-value=(secs) { (words::millis(secs)) }
                                } @else { td data-value="" { "–" } }
                            }
                        }
                    }
                }
            }
        }
    }
}

/// Mean over the seeds; `None` unless all of them got there.
fn latency(
    results: &Results,
    scene: &str,
    algorithm: &str,
    samples_per_sec: f64,
    event: usize,
) -> Option<f64> {
    let runs = results.seeds_of(scene, algorithm, samples_per_sec);
    let latencies: Option<Vec<f64>> = runs.map(|run| run.events.get(event)?.latency_secs).collect();
    crate::metrics::mean(latencies?)
}

/// Curves from the moment on at which everything rests.
fn at_rest(results: &Results, scene: &str, samples_per_sec: f64) -> Markup {
    let curve = |(index, name): (usize, String)| {
        let runs: Vec<&RunResult> = results.seeds_of(scene, &name, samples_per_sec).collect();
        let rests: Option<Vec<_>> = runs.iter().map(|run| run.at_rest.as_ref()).collect();
        let (rests, hz) = (rests?, f64::from(runs.first()?.display_hz));
        let since_secs = rests.first()?.since_secs;
        let curves: Vec<Vec<f64>> = rests.iter().map(|rest| rest.rmse.clone()).collect();
        let secs = |k: usize| since_secs + k as f64 / hz;
        let points: Vec<(f64, f64)> =
            (0..curves[0].len()).filter_map(|k| Some((secs(k), mean_at(&curves, k)?))).collect();
        let last = points.last()?.1;
        Some(Series { name, index, points, mean: last })
    };
    let series: Vec<Series> =
        results.algorithms().into_iter().enumerate().filter_map(curve).collect();
    let times = series.iter().flat_map(|series| series.points.iter().map(|point| point.0));
    let (start, end) =
        times.fold((f64::INFINITY, 0.0), |(a, b), t| (f64::min(a, t), f64::max(b, t)));
    if start >= end {
        return html! {};
    }
    let chart = Chart {
        y_label: format!("RMSE against 64 samples per pixel, {scene}"),
        x_label: "seconds".into(),
        range: start..end,
        unscored_until: start,
        events: Vec::new(),
        series,
    };
    html! {
        h3 { "At rest" }
        p.note {
            "After all motion has ended, against an ideal of 64 samples per pixel. The number beside each name is the last value. What \
             does not refine its pixels stays at the error of one sample per pixel."
        }
        div.scroll { (chart.inline()) }
    }
}
