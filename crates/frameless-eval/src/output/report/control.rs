//! The control of the sampler `adaptive` that trades temporal against spatial accuracy: errors over its values.

use frameless::{AdaptiveOptions, ReconstructionKind, SamplerKind};
use maud::{Markup, html};

use super::super::chart::{Chart, Series};
use super::words;
use crate::algorithm::Algorithm;
use crate::results::{Results, RunResult};

/// After everything has stopped, this long.
const JUST_STOPPED_SECS: f64 = 0.05;
/// With fewer values there is no curve.
const FEWEST_VALUES: usize = 3;

pub(super) fn has_curve(results: &Results) -> bool {
    results.rates().into_iter().any(|rate| !families(results, rate).is_empty())
}

pub(super) fn section(results: &Results) -> Markup {
    if !has_curve(results) {
        return html! {};
    }
    html! {
        section #control {
            h2 { "Temporal against spatial accuracy" }
            p.note {
                "The control of the sampler adaptive, from 0, “finish what is there”, to 1, “every sample where it changes now”. \
                 Temporal error: RMSE over what has changed within the last 100 ms. Spatial error: RMSE against 64 samples per pixel \
                 over the whole picture, just after everything has stopped. Means over scenes and seeds."
            }
            @for rate in results.rates() {
                div data-rate=(rate) {
                    @for family in families(results, rate) { (figure(&family, rate)) }
                }
            }
        }
    }
}

/// A number of a run, if it has it.
type Measure = fn(&RunResult) -> Option<f64>;

/// Runs that differ only in the control's value, the scene, and the seed.
struct Family<'a> {
    reconstruction: ReconstructionKind,
    /// By value.
    values: Vec<(f32, Vec<&'a RunResult>)>,
}

fn families(results: &Results, rate: f64) -> Vec<Family<'_>> {
    let mut families: Vec<Family> = Vec::new();
    for run in results.runs.iter().filter(|run| run.samples_per_sec == rate) {
        let Ok(Algorithm::Frameless(SamplerKind::Adaptive(options), reconstruction)) =
            Algorithm::from_name(&run.algorithm)
        else {
            continue;
        };
        let temporal = options.temporal;
        if options != (AdaptiveOptions { temporal, ..AdaptiveOptions::default() }) {
            continue;
        }
        let known = families.iter().position(|family| family.reconstruction == reconstruction);
        let index = known.unwrap_or_else(|| {
            families.push(Family { reconstruction, values: Vec::new() });
            families.len() - 1
        });
        let values = &mut families[index].values;
        match values.iter_mut().find(|(value, _)| *value == temporal) {
            Some((_, runs)) => runs.push(run),
            None => values.push((temporal, vec![run])),
        }
    }
    families.retain(|family| family.values.len() >= FEWEST_VALUES);
    for family in &mut families {
        family.values.sort_by(|(a, _), (b, _)| a.total_cmp(b));
    }
    families
}

fn figure(family: &Family, rate: f64) -> Markup {
    let curve = |(index, (name, of)): (usize, (&str, Measure))| {
        let point = |(value, runs): &(f32, Vec<&RunResult>)| {
            let errors: Vec<f64> = runs.iter().filter_map(|run| of(run)).collect();
            let mean = errors.iter().sum::<f64>() / errors.len() as f64;
            (!errors.is_empty()).then_some((f64::from(*value), mean))
        };
        let points: Vec<(f64, f64)> = family.values.iter().filter_map(point).collect();
        let mean = points.iter().map(|(_, error)| error).sum::<f64>() / points.len().max(1) as f64;
        Series { name: name.to_owned(), index, points, mean }
    };
    let errors: [(&str, Measure); 2] =
        [("temporal", |run| run.rmse_changed.mean), ("spatial", just_stopped)];
    let chart = Chart {
        y_label: format!(
            "RMSE of adaptive+{} at {} samples/s",
            family.reconstruction.name(),
            words::rate(rate)
        ),
        x_label: "temporal".into(),
        range: 0.0..1.0,
        unscored_until: 0.0,
        events: Vec::new(),
        series: errors.into_iter().enumerate().map(curve).collect(),
    };
    html! { h3 { code { "adaptive+" (family.reconstruction.name()) } } (chart.inline()) }
}

fn just_stopped(run: &RunResult) -> Option<f64> {
    let count = (JUST_STOPPED_SECS * f64::from(run.display_hz)).ceil() as usize;
    let first = run.at_rest.as_ref()?.rmse.get(..count)?;
    Some(first.iter().sum::<f64>() / first.len() as f64)
}
