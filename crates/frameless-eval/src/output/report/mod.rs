//! `report.html`: everything that came out, for people, in one file that needs nothing else.

mod control;
mod factors;
mod gallery;
mod rankings;
mod scene;
mod summary;
mod words;

use std::path::PathBuf;

use maud::{DOCTYPE, Markup, PreEscaped, html};

use super::chart::STYLE as CHART_STYLE;
use crate::error::EvalError;
use crate::results::Results;

pub(crate) use scene::error_chart;

/// What the report is made of.
pub(crate) struct Report<'a> {
    /// All numbers.
    pub(crate) results: &'a Results,
    /// The rate at which pictures were made, and which is shown first.
    pub(crate) pictured_rate: f64,
    /// In the order of the results' scenes.
    pub(crate) pictures: Vec<ScenePictures>,
}

/// The pictures of one scene.
pub(crate) struct ScenePictures {
    /// An MP4 file.
    pub(crate) video: Option<PathBuf>,
    /// Everybody at the same time, several times.
    pub(crate) instants: Vec<Instant>,
}

/// Everybody at the same time.
pub(crate) struct Instant {
    /// Which refresh.
    pub(crate) refresh: usize,
    /// When, in seconds.
    pub(crate) secs: f64,
    /// The ideal's files, without their endings.
    pub(crate) ideal: PathBuf,
    /// Each algorithm's name and files, without their endings.
    pub(crate) panels: Vec<(String, PathBuf)>,
}

impl Report<'_> {
    /// The page. Pictures and videos are read and become part of it.
    ///
    /// # Errors
    /// If a picture cannot be read.
    pub(crate) fn page(&self) -> Result<String, EvalError> {
        let scenes = self.results.scenes();
        let sections = scenes
            .iter()
            .zip(&self.pictures)
            .map(|(scene, pictures)| scene::section(self, scene, pictures));
        let sections: Vec<Markup> = sections.collect::<Result<_, _>>()?;
        let page = html! {
            (DOCTYPE)
            html lang="en" {
                head {
                    meta charset="utf-8";
                    meta name="viewport" content="width=device-width, initial-scale=1";
                    meta name="color-scheme" content="light dark";
                    // Without one, browsers ask the server for /favicon.ico.
                    link rel="icon" href="data:,";
                    title { (self.results.title) }
                    style { (PreEscaped(include_str!("report.css"))) (PreEscaped(CHART_STYLE)) }
                }
                body {
                    (summary::header(self.results))
                    (self.navigation(&scenes))
                    main {
                        (rankings::section(self.results))
                        (factors::section(self.results))
                        (control::section(self.results))
                        @for section in sections { (section) }
                    }
                    (summary::footer())
                    dialog #enlarged { img alt=""; p {} }
                    script { (PreEscaped(include_str!("report.js"))) }
                }
            }
        };
        Ok(page.into_string())
    }

    fn navigation(&self, scenes: &[String]) -> Markup {
        html! {
            nav {
                div.links {
                    a href="#ranking" { "Ranking" }
                    @if !self.results.equal_quality.is_empty() { a href="#equal-quality" { "Equal quality" } }
                    @if control::has_curve(self.results) { a href="#control" { "Control" } }
                    @for scene in scenes { a href={ "#scene-" (scene) } { (scene) } }
                }
                div.switch data-switch="rate" role="group" aria-label="samples per second" {
                    @for rate in self.results.rates() {
                        button type="button" value=(rate) aria-pressed=(rate == self.pictured_rate) {
                            (words::rate(rate))
                        }
                    }
                    span { "samples/s" }
                }
            }
        }
    }
}
