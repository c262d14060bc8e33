//! Equal quality: how many times more samples others need.

use maud::{Markup, html};

use super::words;
use crate::ranking::geometric_mean;
use crate::results::{Bound, EqualQuality, Results};

pub(super) fn section(results: &Results) -> Markup {
    let rows = &results.equal_quality;
    if rows.is_empty() {
        return html! {};
    }
    let algorithms = distinct(rows.iter().map(|row| row.algorithm.as_str()));
    let at = |rate: f64, algorithm: &str| -> Vec<&EqualQuality> {
        rows.iter().filter(|r| r.samples_per_sec == rate && r.algorithm == algorithm).collect()
    };
    html! {
        section #equal-quality {
            h2 { "Equal quality" }
            p.note {
                "How many times more samples per second each opponent needs for the same mean RMSE. Scanned in factors of two, \
                 interpolated in between; “>” and “<” are the ends of the range that was scanned. A mean over scenes some of \
                 which lie beyond the upper end is a lower bound, marked “≥” with their number; with a scene beyond the lower \
                 end there is none."
            }
            @for rate in results.rates() {
                div data-rate=(rate) {
                    @for algorithm in &algorithms {
                        h3 { "Compared with " code { (algorithm) } " at " (words::rate(rate)) " samples/s" }
                        div.scroll { (table(&at(rate, algorithm), &results.scenes())) }
                    }
                }
            }
        }
    }
}

fn table(rows: &[&EqualQuality], scenes: &[String]) -> Markup {
    let opponents = distinct(rows.iter().map(|row| row.opponent.as_str()));
    let of = |opponent: &str, scene: &str| {
        rows.iter().find(|row| row.opponent == opponent && row.scene == scene).copied()
    };
    html! {
        table.sortable.numbers {
            thead {
                tr {
                    th.name scope="col" { "opponent" }
                    th scope="col" title={ "over " (scenes.join(", ")) } { "geometric mean" }
                    @for scene in scenes { th scope="col" { (scene) } }
                }
            }
            tbody {
                @for opponent in opponents {
                    @let factors: Vec<Option<&EqualQuality>> = scenes.iter().map(|scene| of(opponent, scene)).collect();
                    tr {
                        th.name scope="row" { (opponent) }
                        (mean_cell(&factors))
                        @for factor in &factors {
                            @if let Some(row) = factor {
                                td data-value=(row.factor) { (prefix(row.bound)) (times(row.factor)) }
                            } @else { td data-value="" { "–" } }
                        }
                    }
                }
            }
        }
    }
}

fn mean_cell(factors: &[Option<&EqualQuality>]) -> Markup {
    match FactorMean::of(factors) {
        FactorMean::Exact(mean) => html! { td data-value=(mean) { b { (times(mean)) } } },
        FactorMean::AtLeast { mean, beyond } => html! {
            td data-value=(mean) { b { "≥ " (times(mean)) } small { (beyond) " of " (factors.len()) " beyond" } }
        },
        FactorMean::None { below: 0 } => html! { td data-value="" { "–" } },
        FactorMean::None { below } => html! {
            td data-value="" { "–" small { (below) " of " (factors.len()) " below" } }
        },
    }
}

/// A mean over scenes that hides nothing.
#[derive(Debug, PartialEq)]
enum FactorMean {
    /// Every factor is exact.
    Exact(f64),
    /// Some lie beyond the upper end of the range and were counted there.
    AtLeast { mean: f64, beyond: usize },
    /// Some lie below the lower end, so that a mean would be neither a value nor a bound; or some are missing.
    None { below: usize },
}

impl FactorMean {
    fn of(factors: &[Option<&EqualQuality>]) -> FactorMean {
        let count = |bound| factors.iter().flatten().filter(|row| row.bound == bound).count();
        let below = count(Bound::LessThan);
        let values: Option<Vec<f64>> = factors.iter().map(|row| Some((*row)?.factor)).collect();
        match values.and_then(|values| geometric_mean(&values)) {
            Some(mean) if below == 0 => match count(Bound::MoreThan) {
                0 => FactorMean::Exact(mean),
                beyond => FactorMean::AtLeast { mean, beyond },
            },
            _ => FactorMean::None { below },
        }
    }
}

fn prefix(bound: Bound) -> &'static str {
    match bound {
        Bound::Exact => "",
        Bound::MoreThan => "> ",
        Bound::LessThan => "< ",
    }
}

fn times(factor: f64) -> String {
    if factor >= 10.0 { format!("{factor:.0}×") } else { format!("{factor:.2}×") }
}

fn distinct<'a>(names: impl Iterator<Item = &'a str>) -> Vec<&'a str> {
    let mut distinct = Vec::new();
    for name in names {
        if !distinct.contains(&name) {
            distinct.push(name);
        }
    }
    distinct
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_lies_out_of_range_never_enters_a_mean_silently() {
        let row = |factor, bound| EqualQuality {
            scene: "sphere".into(),
            algorithm: "change".into(),
            opponent: "random".into(),
            samples_per_sec: 9e5,
            factor,
            bound,
        };
        let (two, eight) = (row(2.0, Bound::Exact), row(8.0, Bound::Exact));
        let (beyond, below) = (row(32.0, Bound::MoreThan), row(0.25, Bound::LessThan));
        let close = |outcome: FactorMean, wanted: f64| match outcome {
            FactorMean::Exact(mean) | FactorMean::AtLeast { mean, .. } => {
                (mean - wanted).abs() < 1e-9
            }
            FactorMean::None { .. } => false,
        };
        let exact = FactorMean::of(&[Some(&two), Some(&eight)]);
        assert!(matches!(exact, FactorMean::Exact(_)) && close(exact, 4.0));
        let bound = FactorMean::of(&[Some(&two), Some(&beyond)]);
        assert!(matches!(bound, FactorMean::AtLeast { beyond: 1, .. }) && close(bound, 8.0));
        let none = FactorMean::of(&[Some(&two), Some(&beyond), Some(&below)]);
        assert_eq!(none, FactorMean::None { below: 1 });
        assert_eq!(FactorMean::of(&[Some(&two), None]), FactorMean::None { below: 0 });
    }
}
