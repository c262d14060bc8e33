//! Ranked tables: one per rate and metric, of which one is seen at a time.

use maud::{Markup, html};

use crate::ranking::{Metric, Ranking, RankingRow};
use crate::results::Results;

pub(super) fn section(results: &Results) -> Markup {
    let measured = |metric: &Metric| results.runs.iter().any(|run| metric.of(run).is_some());
    let metrics: Vec<Metric> = Metric::ALL.into_iter().filter(measured).collect();
    html! {
        section #ranking {
            h2 { "Ranking" }
            div.switch data-switch="metric" role="group" aria-label="metric" {
                @for (i, metric) in metrics.iter().enumerate() {
                    button type="button" value=(metric.name()) aria-pressed=(i == 0) { (metric.name()) }
                }
            }
            @for &metric in &metrics {
                div data-metric=(metric.name()) {
                    p.note { (metric.explanation()) " Mean over the seeds; click a column to sort by it." }
                    @for rate in results.rates() {
                        div.scroll data-rate=(rate) { (table(&Ranking::new(results, rate, metric), metric)) }
                    }
                }
            }
        }
    }
}

fn table(ranking: &Ranking, metric: Metric) -> Markup {
    let mean = if metric.is_mean_geometric() { "geometric mean" } else { "mean" };
    let scale_of = |value: &dyn Fn(&RankingRow) -> Option<f64>| {
        let competitors = ranking.rows.iter().filter(|row| !is_reference(row));
        Scale::of(&competitors.map(value).collect::<Vec<_>>(), metric)
    };
    let mean_scale = scale_of(&|row| row.mean);
    let scales: Vec<Scale> =
        (0..ranking.scenes.len()).map(|i| scale_of(&|row| row.by_scene[i])).collect();
    html! {
        table.sortable.numbers {
            thead {
                tr {
                    th.name scope="col" { "algorithm" }
                    th scope="col" title={ "over " (ranking.scenes.join(", ")) } { (mean) }
                    @for scene in &ranking.scenes { th scope="col" { (scene) } }
                }
            }
            tbody {
                @for row in &ranking.rows {
                    tr.reference[is_reference(row)] {
                        th.name scope="row" { (row.algorithm) }
                        (cell(row.mean, &mean_scale, metric))
                        @for (value, scale) in row.by_scene.iter().zip(&scales) {
                            (cell(*value, scale, metric))
                        }
                    }
                }
            }
        }
    }
}

/// Oracles know the ideal: they are no competitors, but what could be reached.
fn is_reference(row: &RankingRow) -> bool {
    row.algorithm.starts_with("oracle")
}

fn cell(value: Option<f64>, scale: &Scale, metric: Metric) -> Markup {
    let Some(value) = value else { return html! { td data-value="" { "–" } } };
    html! {
        td.best[value == scale.best] data-value=(value) style=(format!("--share:{:.2}", scale.share(value))) {
            (metric.shown(value))
        }
    }
}

/// From the worst competitor of a column to the best.
struct Scale {
    best: f64,
    worst: f64,
}

impl Scale {
    fn of(values: &[Option<f64>], metric: Metric) -> Scale {
        let present = || values.iter().copied().flatten();
        let (low, high) =
            (present().fold(f64::INFINITY, f64::min), present().fold(f64::NEG_INFINITY, f64::max));
        if metric.is_higher_better() {
            Scale { best: high, worst: low }
        } else {
            Scale { best: low, worst: high }
        }
    }

    /// 0 for the worst, 1 for the best and for a reference that is better; 1 where all are equal.
    fn share(&self, value: f64) -> f64 {
        if self.best == self.worst {
            return 1.0;
        }
        ((value - self.worst) / (self.best - self.worst)).clamp(0.0, 1.0)
    }
}
