//! `frameless render`: the whole picture at one moment.

use std::sync::Arc;
use std::time::Duration;

use anyhow::Context;
use frameless::Display;
use frameless_trace::{Still, ViewSource, World};
use indicatif::{ProgressBar, ProgressStyle};

use crate::args::RenderArgs;
use crate::failure::Failure;
use crate::{input, output};

/// Trace every pixel's centre and write the picture.
pub(crate) fn run(args: &RenderArgs) -> Result<(), Failure> {
    output::check_png_path(&args.out)?;
    let settings = args.light.settings()?;
    let (scene, opener) = input::lit_scene(&args.scene, &args.open)?;
    let view = ViewSource::Camera(input::camera(&scene, args.camera)?);

    let waiting = waiting();
    waiting.set_message(format!("building the BVH of {}", scene.name));
    let world = World::open(&args.scene, Arc::new(scene), &opener.limits);
    let world = world.map_err(Failure::bad_input)?;
    waiting.set_message(format!("tracing {}×{} pixels", args.size.width, args.size.height));
    let pool = rayon::ThreadPoolBuilder::new().build().context("cannot start threads")?;
    let (secs, size, samples) = (args.time, args.size, args.samples);
    let still = Still { secs, view, size, settings, samples, first_sample: 0 };
    waiting.set_length(u64::from(size.height));
    waiting.set_style(bar());
    let radiance = frameless_trace::render_still(&world, &still, &pool, || waiting.inc(1));
    waiting.set_message("writing");
    let display = Display::new(args.exposure).with_tone_map(args.tone_map);
    let rgba = radiance.into_iter().map(|rgb| display.encode_rgba8(rgb)).collect();
    output::write_png(&args.out, args.size.width, args.size.height, rgba)?;
    waiting.finish_and_clear();
    Ok(())
}

/// How much of the picture is there.
fn bar() -> ProgressStyle {
    let style = ProgressStyle::with_template("{spinner} {msg} {bar:30} {percent:>3} %, {eta} left");
    style.unwrap_or_else(|_| ProgressStyle::default_bar())
}

/// What is being done and for how long, on a terminal; nothing elsewhere.
fn waiting() -> ProgressBar {
    /// Work that is done sooner shows nothing at all on most terminals, which is right.
    const TICK: Duration = Duration::from_millis(100);
    let waiting = ProgressBar::new_spinner();
    waiting.enable_steady_tick(TICK);
    waiting
}
