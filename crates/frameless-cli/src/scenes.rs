//! `frameless scenes`: the built-in scenes.

use frameless_scene::{BUILTIN_DESCRIPTIONS, BUILTIN_NAMES};

use crate::failure::Failure;
use crate::output;

/// One per line: its name, then what happens in it.
pub(crate) fn run() -> Result<(), Failure> {
    let scenes = BUILTIN_NAMES.iter().zip(BUILTIN_DESCRIPTIONS);
    let lines: String = scenes.map(|(name, what)| format!("{name:8} {what}\n")).collect();
    Ok(output::print(&lines)?)
}
