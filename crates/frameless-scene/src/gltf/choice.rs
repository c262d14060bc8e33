//! What of a file is wanted: one of its scenes, some of its animations.

use std::convert::Infallible;
use std::str::FromStr;

use super::error::{Fault, quoted};
use super::json::Json;

/// Which of the file's scenes and animations are wanted.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Choice {
    /// `None`: the file's default scene, else its first.
    pub scene: Option<Pick>,
    /// What moves.
    pub animation: AnimationChoice,
}

/// One of several things that have names.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Pick {
    /// By its place in the file, from 0.
    Index(usize),
    /// By its name.
    Name(String),
}

/// Which of the file's animations are played.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum AnimationChoice {
    /// All at once; the first alone, if any two of them move the same thing.
    #[default]
    Fitting,
    /// All at once; what two of them move, the first does.
    All,
    /// None.
    None,
    /// One.
    One(Pick),
}

impl FromStr for Pick {
    type Err = Infallible;

    /// A number is an index, everything else a name.
    fn from_str(text: &str) -> Result<Pick, Infallible> {
        Ok(text.parse().map_or_else(|_| Pick::Name(text.to_owned()), Pick::Index))
    }
}

impl FromStr for AnimationChoice {
    type Err = Infallible;

    /// `all`, `none`, an index or a name.
    fn from_str(text: &str) -> Result<AnimationChoice, Infallible> {
        Ok(match text {
            "all" => AnimationChoice::All,
            "none" => AnimationChoice::None,
            _ => AnimationChoice::One(text.parse()?),
        })
    }
}

impl Pick {
    /// The index among `list`, whose elements are called `what` each. Of several with the name, the first. A number that is no index may
    /// be a name.
    pub(super) fn find(&self, list: &[Json<'_>], key: &str, what: &str) -> Result<usize, Fault> {
        let named = |name: &str| list.iter().position(|json| json.name() == name);
        let found = match self {
            Pick::Index(index) if *index < list.len() => Some(*index),
            Pick::Index(index) => named(&index.to_string()),
            Pick::Name(name) => named(name),
        };
        found.ok_or_else(|| {
            let wanted = match self {
                Pick::Index(index) => format!("{what} {index}, as was asked for"),
                Pick::Name(name) => format!("{what} {}, as was asked for", quoted(name)),
            };
            Fault::at(&format!("/{key}"), wanted, said(list, what))
        })
    }
}

/// What there is, with the first few names.
fn said(list: &[Json<'_>], what: &str) -> String {
    const NAMES_SHOWN: usize = 8;
    let names = list.iter().take(NAMES_SHOWN).enumerate();
    let names: Vec<String> =
        names.map(|(index, json)| format!("{index} {}", quoted(json.name()))).collect();
    let more = if list.len() > NAMES_SHOWN { ", …" } else { "" };
    let colon = if names.is_empty() { "" } else { ": " };
    format!("{} {what}s{colon}{}{more}", list.len(), names.join(", "))
}
