//! Pictures: the side-by-side video, and everybody at the same instant with the error beside it.

use std::path::Path;

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use maud::{Markup, html};

use super::super::panel::{ERROR_GAIN, panel_files};
use super::{Instant, Report, ScenePictures, words};
use crate::error::EvalError;

pub(super) fn of(
    report: &Report,
    scene: &str,
    pictures: &ScenePictures,
) -> Result<Markup, EvalError> {
    let video = pictures.video.as_deref().map(|path| data_url(path, "video/mp4")).transpose()?;
    let instants = pictures.instants.iter().map(|instant| instant_of(report, scene, instant));
    let instants: Vec<Markup> = instants.collect::<Result<_, _>>()?;
    Ok(html! {
        @if let Some(url) = video {
            h3 { "Side by side at " (words::rate(report.pictured_rate)) " samples/s" }
            video src=(url) controls loop muted playsinline preload="metadata" {}
        }
        @for instant in instants { (instant) }
    })
}

fn instant_of(report: &Report, scene: &str, instant: &Instant) -> Result<Markup, EvalError> {
    let [ideal, _] = panel_files(&instant.ideal);
    let ideal = data_url(&ideal, "image/jpeg")?;
    let panel = |(name, stem): &(String, std::path::PathBuf)| -> Result<Markup, EvalError> {
        let [picture, error] = panel_files(stem);
        let urls = [data_url(&picture, "image/jpeg")?, data_url(&error, "image/jpeg")?];
        let rmse = error_at(report, scene, name, instant.refresh);
        Ok(html! {
            figure {
                figcaption { b { (name) } @if let Some(rmse) = rmse { span { "RMSE " (format!("{rmse:.4}")) } } }
                div.pair {
                    img src=(urls[0]) alt={ (name) " at " (format!("{:.3}", instant.secs)) " s" } loading="lazy";
                    img src=(urls[1]) alt={ "error of " (name) } loading="lazy";
                }
            }
        })
    };
    let panels: Vec<Markup> = instant.panels.iter().map(panel).collect::<Result<_, _>>()?;
    Ok(html! {
        h3 { "The refresh at " (format!("{:.3}", instant.secs)) " s, " (words::rate(report.pictured_rate)) " samples/s" }
        p.note { "Beside each picture its error, |difference from the ideal| × " (ERROR_GAIN) "; click to enlarge." }
        div.gallery {
            figure {
                figcaption { b { "ideal" } span { "one sample at each pixel's centre" } }
                div.pair { img src=(ideal) alt="the ideal" loading="lazy"; }
            }
            @for panel in panels { (panel) }
        }
    })
}

/// With the first seed: the pictures are of that run.
fn error_at(report: &Report, scene: &str, algorithm: &str, refresh: usize) -> Option<f64> {
    let run = report.results.seeds_of(scene, algorithm, report.pictured_rate).next()?;
    run.rmse.values.get(refresh).copied().flatten()
}

fn data_url(path: &Path, media_type: &str) -> Result<String, EvalError> {
    let bytes = std::fs::read(path)
        .map_err(|source| EvalError::Unreadable { path: path.to_path_buf(), source })?;
    Ok(format!("data:{media_type};base64,{}", STANDARD.encode(bytes)))
}
