//! `frameless view`: the window.

use std::sync::Arc;
use std::time::Duration;

use anyhow::anyhow;
use frameless::SamplerKind;
use frameless_view::{PictureSize, Settings, ViewOptions};

use crate::args::ViewArgs;
use crate::failure::Failure;
use crate::{input, output};

/// The screenshot is taken by the graphics driver and arrives some refreshes after it was asked for; a
/// software driver on a busy machine may take a second for it.
const SCREENSHOT_ARRIVES: Duration = Duration::from_secs(2);

/// Open the window; returns when it is closed.
pub(crate) fn run(args: &ViewArgs) -> Result<(), Failure> {
    if let Some(screenshot) = &args.screenshot {
        output::check_png_path(screenshot)?;
    }
    let settings = settings(args)?;
    let mut scene = input::scene(&args.scene, &args.choice)?;
    let first = input::camera(&scene, args.camera)?;
    // The window begins with the first camera.
    scene.cameras.rotate_left(first as usize);
    let mut options = ViewOptions::new(Arc::new(scene));
    options.settings = settings;
    options.tracing = args.light.settings();
    options.threads = args.threads;
    options.seed = args.seed;
    let Some(screenshot) = &args.screenshot else { return Ok(frameless_view::run(options)?) };

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

fn settings(args: &ViewArgs) -> Result<Settings, Failure> {
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
        picture: args.size.map_or(default.picture, PictureSize::Fixed),
        ..default
    })
}
