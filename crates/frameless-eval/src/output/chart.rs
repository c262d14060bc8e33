//! Curves over time as SVG: in the report, where they follow its colours, and as files of their own.

use std::fmt::Write;
use std::ops::Range;

use maud::{Markup, PreEscaped, html};

/// Colours that colour-blind eyes tell apart too (after Okabe and Ito 2008), lighter in the dark.
pub(super) const STYLE: &str = include_str!("chart.css");

/// As many colours as [`STYLE`] has; the next algorithms have the same ones, dashed.
const COLOURS: usize = 7;

/// Some curves over one time axis.
pub(crate) struct Chart {
    /// What the curves show.
    pub(crate) y_label: String,
    /// What lies along the axis, with its unit: `seconds`.
    pub(crate) x_label: String,
    /// In that unit.
    pub(crate) range: Range<f64>,
    /// Up to here nothing is scored, in seconds.
    pub(crate) unscored_until: f64,
    /// When something sudden happens, in seconds, and what.
    pub(crate) events: Vec<(f64, String)>,
    /// The curves.
    pub(crate) series: Vec<Series>,
}

/// One curve.
pub(crate) struct Series {
    pub(crate) name: String,
    /// The algorithm's number: its colour.
    pub(crate) index: usize,
    /// Seconds and value, in the order of time.
    pub(crate) points: Vec<(f64, f64)>,
    /// Stands in the legend, which it sorts.
    pub(crate) mean: f64,
}

// All in units of the picture, which is scaled to the page.
const WIDTH: f64 = 1000.0;
const HEIGHT: f64 = 330.0;
const PLOT: [f64; 4] = [58.0, 24.0, 740.0, 288.0];
const LEGEND_X: f64 = 762.0;
const LEGEND_STEP: f64 = 19.0;

impl Chart {
    /// For a page that has [`STYLE`].
    pub(crate) fn inline(&self) -> Markup {
        self.draw(&html! {})
    }

    /// A file of its own.
    pub(crate) fn standalone(&self) -> String {
        let style = html! {
            style {
                (PreEscaped(STYLE))
                "svg.chart { background: #fff } @media (prefers-color-scheme: dark) { svg.chart { background: #18181b; \
                 --ink: #fafafa; --ink-soft: #a1a1aa; --line: #3f3f46 } }"
            }
        };
        self.draw(&style).into_string() + "\n"
    }

    fn draw(&self, style: &Markup) -> Markup {
        let legend_bottom = PLOT[1] + LEGEND_STEP * (self.series.len() as f64 + 1.0);
        let height = HEIGHT.max(legend_bottom);
        html! {
            svg.chart xmlns="http://www.w3.org/2000/svg" role="img" aria-label=(self.y_label)
                viewBox={ "0 0 " (WIDTH) " " (height) } {
                (style)
                (self.axes())
                (self.marks())
                (self.curves())
            }
        }
    }

    fn axes(&self) -> Markup {
        let [left, top, right, bottom] = PLOT;
        let labels_y = bottom + 18.0;
        html! {
            @for value in ticks(0.0..self.highest()) {
                line.grid x1=(left) x2=(right) y1=(self.y(value)) y2=(self.y(value)) {}
                text x=(left - 8.0) y=(self.y(value) + 4.0) text-anchor="end" { (shown(value)) }
            }
            @for secs in ticks(self.range.clone()) {
                line.axis x1=(self.x(secs)) x2=(self.x(secs)) y1=(bottom) y2=(bottom + 4.0) {}
                text x=(self.x(secs)) y=(labels_y) text-anchor="middle" { (shown(secs)) }
            }
            line.axis x1=(left) x2=(right) y1=(bottom) y2=(bottom) {}
            text x=(right) y=(labels_y + 16.0) text-anchor="end" { (self.x_label) }
            text x=(left) y=(top - 10.0) { (self.y_label) }
        }
    }

    fn marks(&self) -> Markup {
        let [left, top, right, bottom] = PLOT;
        html! {
            @if self.unscored_until > self.range.start {
                rect.unscored x=(left) y=(top) width=(self.x(self.unscored_until) - left) height=(bottom - top) {
                    title { "not scored" }
                }
            }
            @for (i, (secs, name)) in self.events.iter().enumerate() {
                // Names of events that follow each other closely stand below each other.
                @let y = top + 10.0 + 14.0 * (i % 3) as f64;
                line.event x1=(self.x(*secs)) x2=(self.x(*secs)) y1=(top) y2=(bottom) {}
                // Beside its line, on the side where there is room.
                @if self.x(*secs) > (left + right) / 2.0 {
                    text x=(self.x(*secs) - 4.0) y=(y) text-anchor="end" { (name) }
                } @else {
                    text x=(self.x(*secs) + 4.0) y=(y) { (name) }
                }
            }
        }
    }

    fn curves(&self) -> Markup {
        let mut sorted: Vec<&Series> = self.series.iter().collect();
        sorted.sort_by(|a, b| a.mean.total_cmp(&b.mean));
        html! {
            @for (place, series) in sorted.into_iter().enumerate() {
                @let y = PLOT[1] + LEGEND_STEP * (place as f64 + 0.5);
                g class={ "series " (colour_class(series.index)) } {
                    path.curve d=(self.path(&series.points)) {}
                    line.curve x1=(LEGEND_X) x2=(LEGEND_X + 20.0) y1=(y) y2=(y) {}
                    text.name x=(LEGEND_X + 27.0) y=(y + 4.0) { (series.name) }
                    text x=(WIDTH - 4.0) y=(y + 4.0) text-anchor="end" { (format!("{:.4}", series.mean)) }
                    rect.touch x=(LEGEND_X) y=(y - LEGEND_STEP / 2.0) width=(WIDTH - LEGEND_X) height=(LEGEND_STEP) {}
                }
            }
        }
    }

    fn path(&self, points: &[(f64, f64)]) -> String {
        let mut path = String::new();
        for (i, &(secs, value)) in points.iter().enumerate() {
            let command = if i == 0 { 'M' } else { 'L' };
            // Writing to a string cannot fail. A tenth of a unit is less than a pixel.
            let _ = write!(path, "{command}{:.1} {:.1}", self.x(secs), self.y(value));
        }
        path
    }

    fn highest(&self) -> f64 {
        let values = self.series.iter().flat_map(|series| &series.points).map(|point| point.1);
        // An axis needs a length even where there is no error at all.
        (values.fold(0.0, f64::max) * 1.05).max(1e-6)
    }

    fn x(&self, secs: f64) -> f64 {
        let part = (secs - self.range.start) / (self.range.end - self.range.start);
        PLOT[0] + part * (PLOT[2] - PLOT[0])
    }

    fn y(&self, value: f64) -> f64 {
        PLOT[3] - value / self.highest() * (PLOT[3] - PLOT[1])
    }
}

/// The class of an algorithm's colour, `dashed` where colours are used again.
pub(super) fn colour_class(index: usize) -> String {
    let dashed = if (index / COLOURS).is_multiple_of(2) { "" } else { " dashed" };
    format!("c{}{dashed}", index % COLOURS)
}

/// Round numbers within a range, at most seven: steps of 1, 2 or 5 times a power of ten.
fn ticks(range: Range<f64>) -> Vec<f64> {
    let length = range.end - range.start;
    let power = 10f64.powf((length / 6.0).log10().floor());
    let steps = [1.0, 2.0, 5.0, 10.0].map(|step| step * power);
    let step = steps.into_iter().find(|step| length / step <= 6.0).unwrap_or(steps[3]);
    let (first, last) = ((range.start / step).ceil() as i64, (range.end / step).floor() as i64);
    (first..=last).map(|n| n as f64 * step).collect()
}

/// Without the digits that are there only because ticks are multiples of what is no binary fraction.
fn shown(value: f64) -> String {
    let text = format!("{value:.6}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_within() {
        let shown_ticks = |range| ticks(range).into_iter().map(shown).collect::<Vec<_>>();
        assert_eq!(shown_ticks(0.0..0.1)[..3], ["0", "0.02", "0.04"]);
        assert_eq!(shown_ticks(0.0..2.5), ["0", "0.5", "1", "1.5", "2", "2.5"]);
        assert_eq!(shown_ticks(1.3..1.9)[0], "1.3");
        for length in [1e-6, 0.03, 0.7, 1.0, 9.0, 1234.0] {
            let ticks = ticks(0.0..length);
            assert!((2..=7).contains(&ticks.len()), "{length}: {ticks:?}");
            assert!(ticks.iter().all(|tick| (0.0..=length).contains(tick)));
        }
    }

    #[test]
    fn a_chart_of_zeros_and_of_nothing_is_drawn() {
        let chart = |points: Vec<(f64, f64)>| Chart {
            y_label: "RMSE".into(),
            x_label: "seconds".into(),
            range: 0.0..1.0,
            unscored_until: 0.0,
            events: vec![(0.5, "<cut>".into())],
            series: vec![Series { name: "a".into(), index: 8, points, mean: 0.0 }],
        };
        for points in [vec![], vec![(0.5, 0.0)]] {
            let svg = chart(points).standalone();
            assert!(!svg.contains("NaN") && !svg.contains("inf"), "{svg}");
            assert!(svg.contains("&lt;cut&gt;") && svg.contains("c1 dashed"));
        }
    }
}
