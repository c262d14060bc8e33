//! What was run, and how to read it.

use maud::{Markup, html};

use super::words;
use crate::results::Results;

pub(super) fn header(results: &Results) -> Markup {
    let first = results.runs.first();
    html! {
        header {
            h1 { (results.title) }
            p.lead {
                "Every algorithm gets the same number of samples per second on one simulated clock. At every refresh of the \
                 display its picture is compared with the "
                em { "ideal" }
                ": the whole picture traced at exactly that moment, as an infinitely fast renderer would show it."
            }
            ul.facts {
                li { b { (results.scenes().len()) } (plural(results.scenes().len(), " scene")) }
                li { b { (results.algorithms().len()) } (plural(results.algorithms().len(), " algorithm")) }
                li { b { (results.rates().len()) } (plural(results.rates().len(), " rate")) }
                li { b { (results.runs.len()) } (plural(results.runs.len(), " run")) }
                @if let Some(run) = first {
                    li { b { (run.width) "×" (run.height) } " pixels" }
                    li { b { (run.display_hz) } " Hz" }
                    li {
                        b { (format!("{:.1}", run.refreshes as f64 / f64::from(run.display_hz))) }
                        " s each, of which the first "
                        (words::millis(results.unscored_refreshes as f64 / f64::from(run.display_hz)))
                        " are not scored"
                    }
                }
            }
        }
    }
}

fn plural(n: usize, what: &str) -> String {
    if n == 1 { what.to_owned() } else { format!("{what}s") }
}

pub(super) fn footer() -> Markup {
    html! {
        footer {
            p {
                "Made by " code { "frameless compare" } ". The numbers are in " code { "results.json" }
                " beside this file, described field by field in " code { "docs/evaluation.md" }
                "; the same experiment gives the same numbers on every machine."
            }
        }
    }
}
