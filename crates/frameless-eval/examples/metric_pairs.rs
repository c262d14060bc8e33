//! Writes a few pairs of pictures and what our metrics say about them, for `tests/python/check_metrics.py`:
//!
//! ```sh
//! cargo run -p frameless-eval --example metric_pairs -- FOLDER
//! ```

use std::path::Path;

use frameless::{Display, Size};
use frameless_eval::{
    Algorithm, Cell, Experiment, Ideals, Picture, Subject, flip, psnr_db, rmse, run, ssim,
};

const EXPERIMENT: &str = r#"
    title = "pairs for the metrics"
    samples_per_sec = [200_000]
    width = 240
    height = 180
    duration_secs = 0.5
    unscored_secs = 0.0
    [metrics]
    ssim_every = 0
    flip_every = 0
    [output]
    video = false
    [[scenes]]
    scene = "mix"
    [[scenes]]
    scene = "shadow"
"#;

/// Who makes a picture to be held against the ideal: noise, blur, old pictures.
const ALGORITHMS: [&str; 3] = ["random", "lowres60", "framed"];

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let folder = std::env::args().nth(1).ok_or("usage: metric_pairs FOLDER")?;
    let folder = Path::new(&folder);
    std::fs::create_dir_all(folder)?;
    let experiment = Experiment::parse(EXPERIMENT, Path::new(""))?;
    let mut rows = Vec::new();
    for spec in &experiment.scenes {
        let subject = Subject::load(spec)?;
        let ideals = Ideals::trace(&subject, &experiment, &|| (), &|| false).ok_or("stopped")?;
        let last = experiment.refreshes - 1;
        let ideal = as_displayed(&ideals.pictures[last]);
        for name in ALGORITHMS {
            let cell = Cell {
                scene: spec.name.clone(),
                algorithm: Algorithm::from_name(name)?,
                samples_per_sec: experiment.samples_per_sec[0],
                seed: 1,
            };
            let mut shown = Picture::new();
            run(&cell, &experiment, &subject, &ideals, &mut |_, picture| {
                shown.clone_from(picture);
                true
            })?;
            let pair = format!("{}-{name}", spec.name);
            rows.push(measured(folder, &pair, &ideal, &as_displayed(&shown), experiment.size)?);
        }
        rows.push(measured(
            folder,
            &format!("{}-itself", spec.name),
            &ideal,
            &ideal,
            experiment.size,
        )?);
    }
    std::fs::write(folder.join("metrics.json"), serde_json::to_string_pretty(&rows)?)?;
    Ok(())
}

/// What 8 bits per channel leave of a picture: the other program reads it from a file.
fn as_displayed(picture: &Picture) -> Picture {
    picture.iter().map(|rgb| rgb.map(|c| f32::from(Display::quantize(c)) / 255.0)).collect()
}

fn measured(
    folder: &Path,
    pair: &str,
    reference: &Picture,
    test: &Picture,
    size: Size,
) -> Result<serde_json::Value, Box<dyn std::error::Error>> {
    for (picture, role) in [(reference, "reference"), (test, "test")] {
        let bytes = picture.as_flattened().iter().map(|&c| Display::quantize(c)).collect();
        let image = image::RgbImage::from_raw(size.width, size.height, bytes);
        image.ok_or("one colour per pixel")?.save(folder.join(format!("{pair}-{role}.png")))?;
    }
    let (width, error) = (size.width as usize, rmse(test, reference));
    Ok(serde_json::json!({
        "pair": pair,
        "rmse": error,
        "psnr_db": psnr_db(error),
        "ssim": ssim(reference, test, width),
        "flip": flip(reference, test, width),
    }))
}
