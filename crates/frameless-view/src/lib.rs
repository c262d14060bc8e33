//! The window in which a frameless picture is looked at.
//!
//! Two threads that never wait for each other: the render loop (`frameless_session`) takes commands and hands out a finished
//! picture per refresh; the window (`app`) draws that picture, the panel and what is known about the picture, and turns hands on
//! mouse and keys into commands. A third reads scenes that the user opens.

mod app;
mod help;
mod hud;
mod legend;
mod messages;
mod navigation;
mod no_display;
mod options;
mod panel;
mod picture;
mod theme;
mod timed;
mod transport;

use std::sync::Arc;

use eframe::egui::{ViewportBuilder, vec2};
use frameless_trace::World;

pub use frameless_session::{Overlay, PictureSize, Settings};
pub use no_display::NoDisplay;
pub use options::ViewOptions;

/// Opens the window; returns when the user has closed it.
///
/// # Errors
/// [`NoDisplay`] if there is none, or none that the graphics driver can draw on; [`LoadError`](frameless_scene::LoadError) if the scene
/// would take too long to draw; any other error if the display goes away while the window is open.
pub fn run(options: ViewOptions) -> anyhow::Result<()> {
    no_display::check(|name| std::env::var_os(name))?;
    let (scene, limits) = (&options.scene, &options.opener.limits);
    let world = Arc::new(World::open(&scene.name, Arc::clone(scene), limits)?);
    let [width, height] = options.window;
    let window = ViewportBuilder::default()
        .with_title(format!("{} – frameless", options.scene.name))
        .with_app_id("frameless")
        .with_inner_size(vec2(width, height))
        .with_min_inner_size(vec2(480.0, 320.0))
        .with_drag_and_drop(true);
    let native = eframe::NativeOptions {
        viewport: window,
        // The picture has the display's 8 bits already, and noise over every pixel is dear in software.
        dithering: false,
        ..Default::default()
    };
    let create: eframe::AppCreator<'_> = Box::new(move |context| {
        Ok(Box::new(app::App::new(context, world, options)?) as Box<dyn eframe::App>)
    });
    no_display::while_connected(|| eframe::run_native("frameless", native, create))?
        .map_err(|error| no_display::explain(&error))
}
