//! `cargo run --release -p frameless-trace --example picture -- SCENE OUT.png [SECS [WIDTH HEIGHT]]`
//!
//! SCENE is a built-in scene's name or a glTF file. Traces the ideal picture and says what one pixel cost.

use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use frameless::{Display, Size};
use frameless_scene::{Limits, Scene};
use frameless_trace::{Settings, ViewSource, World, render, thread_pool};

type Failure = Box<dyn std::error::Error>;

fn main() -> Result<(), Failure> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [scene, out] = arguments.get(..2).ok_or("SCENE and OUT.png are needed")? else {
        return Err("SCENE and OUT.png are needed".into());
    };
    let secs: f64 = arguments.get(2).map_or(Ok(0.0), |a| a.parse())?;
    let [width, height] = match arguments.get(3..5) {
        Some([width, height]) => [width.parse()?, height.parse()?],
        _ => [768, 576],
    };
    let size = Size::new(width, height);
    let begun = Instant::now();
    let world = World::new(Arc::new(scene_named(scene)?));
    println!("{scene}: prepared in {:.3} s", begun.elapsed().as_secs_f64());
    let begun = Instant::now();
    let pool = thread_pool(0);
    let image = render(&world, secs, &ViewSource::Camera(0), size, &Settings::default(), &pool);
    let spent = begun.elapsed().as_secs_f64();
    println!(
        "{:.2}M pixels/s on {} threads",
        image.len() as f64 / spent * 1e-6,
        pool.current_num_threads()
    );
    let rgba: Vec<u8> = image.iter().flat_map(|&rgb| Display::new(0.0).encode_rgba8(rgb)).collect();
    image::save_buffer(out, &rgba, width, height, image::ExtendedColorType::Rgba8)?;
    Ok(())
}

fn scene_named(name: &str) -> Result<Scene, Failure> {
    match frameless_scene::builtin(name) {
        Some(scene) => Ok(scene),
        None => Ok(frameless_scene::load(Path::new(name), &Limits::default())?),
    }
}
