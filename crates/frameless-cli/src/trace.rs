//! `frameless trace`: one pixel, step by step.

use std::sync::Arc;

use anyhow::anyhow;
use frameless::Request;
use frameless_trace::{ViewSource, World};

use crate::args::TraceArgs;
use crate::failure::Failure;
use crate::{input, output};

/// Trace the pixel's centre, or a sample of its sequence, and tell.
pub(crate) fn run(args: &TraceArgs) -> Result<(), Failure> {
    let (x, y) = args.pixel;
    let size = args.size;
    if x >= size.width || y >= size.height {
        return Err(Failure::bad_input(anyhow!(
            "--pixel {x},{y}: the picture has {}×{} pixels, counted from 0",
            size.width,
            size.height
        )));
    }
    let (scene, opener) = input::lit_scene(&args.scene, &args.open)?;
    let view = ViewSource::Camera(input::camera(&scene, args.camera)?);
    let world = World::open(&args.scene, Arc::new(scene), &opener.limits);
    let world = world.map_err(Failure::bad_input)?;
    let (pixel, settings) = (size.index(x, y), args.light.settings()?);
    let request = match args.sample {
        None => Request::centre(pixel),
        Some(number) => Request::in_sequence(pixel, number),
    };
    let steps = frameless_trace::explain(&world, args.time, &view, size, &request, &settings);
    Ok(output::print(&(steps.join("\n") + "\n"))?)
}
