//! `frameless view`: the window, or the web page where there is no display.

use std::sync::Arc;
use std::time::Duration;

use anyhow::anyhow;
use frameless::SamplerKind;
use frameless_scene::{LoadError, Scene};
use frameless_session::Opener;
use frameless_view::{NoDisplay, PictureSize, Settings, ViewOptions};

use crate::args::{LookArgs, ViewArgs};
use crate::failure::Failure;
use crate::{input, output, serve};

/// The screenshot is taken by the graphics driver and arrives some refreshes after it was asked for; a
/// software driver on a busy machine may take a second for it.
const SCREENSHOT_ARRIVES: Duration = Duration::from_secs(2);

/// Open the window; returns when it is closed.
pub(crate) fn run(args: &ViewArgs) -> Result<(), Failure> {
    if let Some(screenshot) = &args.screenshot {
        output::check_png_path(screenshot)?;
    }
    let settings = settings(&args.look)?;
    let (scene, opener) = scene(&args.look)?;
    let mut options = ViewOptions::new(Arc::new(scene));
    options.opener = opener;
    options.settings = settings;
    options.tracing = args.look.light.settings()?;
    options.threads = args.look.threads;
    options.seed = args.look.seed;
    let Some(screenshot) = &args.screenshot else {
        return match frameless_view::run(options) {
            Err(error) if error.is::<NoDisplay>() => serve::instead(&args.look, &error),
            Err(error) if error.is::<LoadError>() => Err(Failure::bad_input(error)),
            result => Ok(result?),
        };
    };

    let after = Duration::from_secs_f64(args.after);
    options.screenshot_after = Some((after, screenshot.clone()));
    options.exit_after = Some(after + SCREENSHOT_ARRIVES);
    // Whether the window has written it can only be told if no older one lies there.
    output::remove_file(screenshot)?;
    frameless_view::run(options)?;
    if screenshot.exists() {
        return Ok(());
    }
    let shown = screenshot.display();
    Err(Failure::other(anyhow!("{shown} was not written: the window was closed too early")))
}

/// The scene that is looked at, with the camera that is wanted as its first, and how others are opened.
pub(crate) fn scene(args: &LookArgs) -> Result<(Scene, Opener), Failure> {
    let (mut scene, opener) = input::lit_scene(&args.scene, &args.open)?;
    let first = input::camera(&scene, args.camera)?;
    scene.cameras.rotate_left(first as usize);
    Ok((scene, opener))
}

/// Where the sliders stand first.
pub(crate) fn settings(args: &LookArgs) -> Result<Settings, Failure> {
    let default = Settings::default();
    let named = args.sampler.as_deref().and_then(SamplerKind::from_name);
    let mut sampler = named.unwrap_or(default.sampler);
    match (&mut sampler, args.temporal) {
        (_, None) => {}
        (SamplerKind::Adaptive(options), Some(wanted)) => options.temporal = wanted,
        (other, Some(_)) => {
            let name = other.name();
            let error =
                anyhow!("--temporal is for the sampler adaptive; {name} has no such choice");
            return Err(Failure::bad_input(error));
        }
    }
    Ok(Settings {
        sampler,
        reconstruction: args.reconstruction.unwrap_or(default.reconstruction),
        samples_per_sec: args.rate,
        exposure_stops: args.exposure,
        tone_map: args.tone_map,
        picture: args.size.map_or(default.picture, PictureSize::Fixed),
        ..default
    })
}
