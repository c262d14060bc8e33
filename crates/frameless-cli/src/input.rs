//! The scene that an argument names.

use std::path::Path;

use anyhow::anyhow;
use frameless_scene::{
    Animation, AnimationChoice, BUILTIN_NAMES, Choice, Environment, Limits, Scene, load_environment,
};
use frameless_session::Opener;

use crate::args::{ChoiceArgs, OpenArgs};
use crate::failure::Failure;

/// How the user wants scenes to be opened.
fn opener(args: &OpenArgs) -> Result<Opener, Failure> {
    let limits = args.limits.limits();
    let Some(file) = &args.environment.file else {
        return Ok(Opener { limits, environment: None });
    };
    let picture = load_environment(file, &limits).map_err(Failure::bad_input)?;
    // Turned by whole turns, a large angle is the same in single precision.
    let rotation_rad = (args.environment.rotation_deg % 360.0).to_radians() as f32;
    let strength = args.environment.strength.min(f64::from(f32::MAX)) as f32;
    Ok(Opener { limits, environment: Some(Environment { rotation_rad, strength, ..picture }) })
}

/// The scene of that name, lit by the environment, if one is asked for; and how others are opened.
pub(crate) fn lit_scene(name: &str, args: &OpenArgs) -> Result<(Scene, Opener), Failure> {
    let opener = opener(args)?;
    Ok((opener.lit(scene(name, &args.choice, &opener.limits)?), opener))
}

/// The built-in scene of that name, else the file, of which a part may be chosen. A file in the way of a built-in name is
/// reached as `./sphere`.
pub(crate) fn scene(name: &str, choice: &ChoiceArgs, limits: &Limits) -> Result<Scene, Failure> {
    if let Some(scene) = frameless_scene::builtin(name) {
        return whole(scene, choice);
    }
    let path = Path::new(name);
    if path.extension().is_none() && !path.exists() {
        let names = BUILTIN_NAMES.join(", ");
        return Err(Failure::bad_input(anyhow!(
            "{name}: no such file, and no built-in scene (those are: {names})"
        )));
    }
    let animation = choice.animation.clone().unwrap_or_default();
    let choice = Choice { scene: choice.file_scene.clone(), animation };
    frameless_scene::load_chosen(path, &choice, limits).map_err(Failure::bad_input)
}

/// A built-in scene has no parts; it may be held still.
fn whole(mut scene: Scene, choice: &ChoiceArgs) -> Result<Scene, Failure> {
    match (&choice.file_scene, &choice.animation) {
        (None, None | Some(AnimationChoice::All)) => {}
        (None, Some(AnimationChoice::None)) => scene.animation = Animation::default(),
        (scene_asked, _) => {
            let flag = if scene_asked.is_some() { "--scene" } else { "--animation" };
            let name = &scene.name;
            let error = anyhow!(
                "{flag}: the built-in scene {name} has no parts to choose from; a glTF file has \
                 (frameless info FILE lists them)"
            );
            return Err(Failure::bad_input(error));
        }
    }
    Ok(scene)
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
