//! The scene that an argument names.

use std::path::Path;

use anyhow::anyhow;
use frameless_scene::{BUILTIN_NAMES, Limits, Scene};

use crate::failure::Failure;

/// The built-in scene of that name, else the file. A file in the way of a built-in name is reached as
/// `./sphere`.
pub(crate) fn scene(name: &str) -> Result<Scene, Failure> {
    if let Some(scene) = frameless_scene::builtin(name) {
        return Ok(scene);
    }
    let path = Path::new(name);
    if path.extension().is_none() && !path.exists() {
        let names = BUILTIN_NAMES.join(", ");
        return Err(Failure::bad_input(anyhow!(
            "{name}: no such file, and no built-in scene (those are: {names})"
        )));
    }
    frameless_scene::load(path, &Limits::default()).map_err(Failure::bad_input)
}

/// The camera's number, if the scene has it.
pub(crate) fn camera(scene: &Scene, number: u32) -> Result<u32, Failure> {
    if (number as usize) < scene.cameras.len() {
        return Ok(number);
    }
    let (name, cameras) = (&scene.name, scene.cameras.len());
    Err(Failure::bad_input(anyhow!(
        "{name}: no camera {number}, the scene has {cameras}, counted from 0"
    )))
}
