//! Opens the window on a built-in scene or a glTF file:
//!
//! ```text
//! cargo run --release -p frameless-view --example window -- [SCENE] [--size WxH] [--sampler NAME] [--overlay NAME]
//!     [--budget SAMPLES_PER_SEC] [--screenshot SECS PATH] [--exit SECS]
//! ```

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use anyhow::Context;
use frameless::{SamplerKind, Size};
use frameless_scene::{Limits, builtin};
use frameless_view::{Overlay, PictureSize, ViewOptions};

/// Prints what the window has to say.
struct ToStderr;

impl log::Log for ToStderr {
    fn enabled(&self, metadata: &log::Metadata<'_>) -> bool {
        metadata.target().starts_with("frameless")
    }

    fn log(&self, record: &log::Record<'_>) {
        if self.enabled(record.metadata()) {
            eprintln!("{}: {}", record.level(), record.args());
        }
    }

    fn flush(&self) {}
}

fn main() -> anyhow::Result<()> {
    log::set_logger(&ToStderr).map(|()| log::set_max_level(log::LevelFilter::Info))?;
    let mut name = "sphere".to_owned();
    let mut options = ViewOptions::new(Arc::default());
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        let mut value = || arguments.next().with_context(|| format!("{argument} needs a value"));
        match argument.as_str() {
            "--size" => options.settings.picture = PictureSize::Fixed(size(&value()?)?),
            "--sampler" => {
                let sampler = SamplerKind::from_name(&value()?);
                options.settings.sampler = sampler.context("no such sampler")?;
            }
            "--overlay" => {
                let wanted = value()?;
                let overlay = Overlay::ALL.into_iter().find(|overlay| overlay.name() == wanted);
                options.settings.overlay = overlay.context("no such overlay")?;
            }
            "--budget" => options.settings.samples_per_sec = Some(value()?.parse()?),
            "--screenshot" => {
                options.screenshot_after = Some((secs(&value()?)?, PathBuf::from(value()?)));
            }
            "--exit" => options.exit_after = Some(secs(&value()?)?),
            _ => name = argument,
        }
    }
    options.scene = Arc::new(match builtin(&name) {
        Some(scene) => scene,
        None => frameless_scene::load(Path::new(&name), &Limits::default())?,
    });
    frameless_view::run(options)
}

fn size(text: &str) -> anyhow::Result<Size> {
    let (width, height) = text.split_once('x').context("a size is written WIDTHxHEIGHT")?;
    Ok(Size::new(width.parse()?, height.parse()?))
}

fn secs(text: &str) -> anyhow::Result<Duration> {
    Ok(Duration::try_from_secs_f64(text.parse()?)?)
}
