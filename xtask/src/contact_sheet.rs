//! All public scenes on one sheet, beside what each is known to show: to be looked at by people.

use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

use anyhow::{Context, Result, ensure};
use serde_json::Value;

use crate::command::output_within;
use crate::steps::Done;
use crate::{missing, picture};

/// Per picture: a hundred samples of a large scene take some seconds.
const LIMIT: Duration = Duration::from_secs(300);
/// The browser draws a page of some dozen pictures in a few seconds.
const BROWSER_LIMIT: Duration = Duration::from_secs(120);

/// Pictures of how many pixels, and how many stand beside each other.
const PICTURE: [u32; 2] = [320, 240];
const COLUMNS: u32 = 5;

/// What a file is known to show, from its makers' description.
const KNOWN: [(&str, &str); 32] = [
    ("BoxAnimated", "a pink box in a blue frame; it sinks, turns over and rises again"),
    ("CesiumMilkTruck", "a truck with its maker's name on the side; the wheels turn"),
    (
        "InterpolationTest",
        "nine cubes: columns step, linear, cubic spline; rows scale, rotation, translation",
    ),
    ("Fox", "a fox with black paws and a white chest"),
    ("CesiumMan", "a man with a globe on his chest, walking"),
    ("RiggedSimple", "a column that bends"),
    ("AnimatedMorphCube", "a grey cube; two of its sides are drawn out and in"),
    ("MorphPrimitivesTest", "a plate of two colours, lifted without a gap between them"),
    ("WaterBottle", "a metal bottle with a red cap, a black band and a red mark"),
    ("MetalRoughSpheres", "spheres from rough to smooth, rows of metals and of dielectrics"),
    (
        "NegativeScaleTest",
        "ticks in all columns (those of backs in the shadow of fronts not shown); spheres of a row alike",
    ),
    ("AlphaBlendModeTest", "opaque, blend, and three cutoffs, each cut exactly at its arrow"),
    ("LAZIENKA", "a bathroom: bath, basin, mirror"),
    ("DreamApartment", "a flat without a roof, and somebody before it"),
    ("CornellBox", "red wall left, green wall right, a shining rectangle above"),
    ("SimpleSparseAccessor", "a strip of squares with three of its vertices pulled up"),
    ("BoxVertexColors", "a cube whose corners are the corners of the colour cube"),
    ("MeshPrimitiveModes", "of seven ways to draw a shape the three with triangles"),
    ("Lights", "a cube in coloured lights: a green spot on top, a turquoise and a red side"),
    ("TextureTransformTest", "all marks green; arrows as the drawing beside them"),
    (
        "TextureSettingsTest",
        "the right of each pair like the left (the first in the shadow of a back not shown)",
    ),
    ("MultiUVTest", "a box with two sets of texture coordinates, one glowing"),
    ("TransmissionRoughnessTest", "glass, rougher and denser from ball to ball, before lettering"),
    (
        "AttenuationTest",
        "glass that grows thicker, bluish green; rows alike where the drawing says so",
    ),
    ("UnlitTest", "two bodies, orange and blue, without any shading"),
    ("EmissiveStrengthTest", "five cubes, each shining twice as bright as the one before"),
    ("Cameras", "a square, by a perspective and an orthographic camera"),
    ("MultipleScenes", "a triangle in one scene, a square in the other"),
    ("Box With Spaces", "a black box with green letters on every side"),
    ("BoxMeshopt", "a red box"),
    ("BoxTexturedWebpFallback", "a box with its maker's name on every side"),
    ("SimpleInstancing", "a hundred and twenty-five small cubes, each turned otherwise"),
];

/// Light from all around, where a file is about materials.
const SKY: &str = "environment/aristea_wreck_puresky_1k.hdr";
/// These are about what `direct` leaves out.
const FOLLOW_LIGHT: [&str; 4] = ["pbr", "materials-ext", "architecture", "lights"];
const SAMPLES_DIRECT: &str = "9";
const SAMPLES_PATH: &str = "64";

/// One picture on the sheet.
struct Shot {
    caption: String,
    arguments: Vec<String>,
}

/// Draw them all with `program` into `out`: a page and, where there is a browser, a picture of it.
pub(crate) fn draw(program: &Path, out: &Path) -> Result<Done> {
    let scenes = crate::project_dir().join("../shared/scenes");
    let manifest = std::fs::read_to_string(scenes.join("manifest.json"))
        .with_context(|| format!("the public scenes are missing: no {}", scenes.display()))?;
    let manifest: Value = serde_json::from_str(&manifest).context("manifest.json")?;
    let mut page = String::from(HEAD);
    let (mut pictures, mut rows) = (0, 0);
    for asset in manifest["assets"].as_array().into_iter().flatten() {
        let (file, category) = (text(asset, "file"), text(asset, "category"));
        if category == "environment" {
            continue;
        }
        write!(page, "<section><h2>{}</h2><p>{}</p>", escaped(file), known(file))?;
        for shot in shots(asset, file, &scenes) {
            let name = format!("{pictures:03}.png");
            page += &figure(program, &shot, &out.join(&name), category)?;
            pictures += 1;
        }
        page += "</section>\n";
        rows += 1;
    }
    let file = out.join("index.html");
    std::fs::write(&file, page).with_context(|| format!("cannot write {}", file.display()))?;
    let remark = format!("{pictures} pictures of {rows} files: {}", file.display());
    let Some(browser) = missing::browser() else {
        return Ok(Done {
            skipped: vec!["the sheet as one picture: no browser".into()],
            ..Done::passed(remark)
        });
    };
    photograph(browser, &file, pictures)?;
    Ok(Done::passed(remark))
}

/// The picture, or the refusal where one is allowed.
fn figure(program: &Path, shot: &Shot, picture: &Path, category: &str) -> Result<String> {
    let [width, height] = PICTURE;
    let mut command = Command::new(program);
    command.arg("render").args(&shot.arguments).arg("--out").arg(picture);
    command.args(["--size", &format!("{width}x{height}")]);
    let answer = output_within(&mut command, LIMIT)?;
    let said = String::from_utf8_lossy(&answer.stderr);
    let caption = escaped(&shot.caption);
    if answer.status.success() {
        ensure!(category != "must-refuse", "{:?} must be refused and is not", shot.arguments);
        picture::shows_something(picture)?;
        let name = picture.file_name().unwrap_or_default().to_string_lossy();
        let warnings = escaped(said.trim());
        return Ok(format!(
            "<figure><img src='{name}'><figcaption>{caption} <i>{warnings}</i></figcaption></figure>"
        ));
    }
    ensure!(category.ends_with("refuse"), "{:?}: {said}", shot.arguments);
    Ok(format!("<figure><pre>{}</pre></figure>", escaped(said.trim())))
}

/// By every camera, in every scene, before and amid every motion; and by `path` where it matters.
fn shots(asset: &Value, file: &str, scenes: &Path) -> Vec<Shot> {
    let path = scenes.join(file).to_string_lossy().into_owned();
    let shot = |caption: &str, more: &[&str]| Shot {
        caption: caption.to_owned(),
        arguments: [path.as_str()].iter().chain(more).map(ToString::to_string).collect(),
    };
    let direct = |caption: &str, more: &[&str]| {
        shot(caption, &[&["--samples", SAMPLES_DIRECT], more].concat())
    };
    let mut shots = vec![direct("direct", &[])];
    for camera in (1..number(asset, "cameras") as u32).take(2) {
        shots.push(direct(&format!("camera {camera}"), &["--camera", &camera.to_string()]));
    }
    let scenes_in_file = number(asset, "scenes") as u32;
    for scene in (0..scenes_in_file).filter(|_| scenes_in_file > 1) {
        shots.push(direct(&format!("scene {scene}"), &["--scene", &scene.to_string()]));
    }
    let duration = number(asset, "duration_s");
    for part in [0.3, 0.7].into_iter().filter(|_| duration > 0.0) {
        let secs = format!("{:.2}", part * duration);
        shots.push(direct(&format!("at {secs} s"), &["--time", &secs]));
    }
    if FOLLOW_LIGHT.contains(&text(asset, "category")) {
        let by_path = ["--integrator", "path", "--samples", SAMPLES_PATH, "--max-depth", "12"];
        let sky = scenes.join(SKY).to_string_lossy().into_owned();
        shots.push(shot("path", &by_path));
        shots.push(shot("path, with a sky", &[&by_path[..], &["--env", &sky]].concat()));
    }
    shots
}

fn known(file: &str) -> &'static str {
    let found = KNOWN.iter().find(|(name, _)| file.contains(name));
    found.map_or("(to be refused by name, or drawn right)", |(_, shows)| shows)
}

/// The whole page as one picture beside it.
fn photograph(browser: &str, page: &Path, pictures: u32) -> Result<PathBuf> {
    let picture = page.with_file_name("sheet.png");
    let width = COLUMNS * (PICTURE[0] + 12) + 24;
    // Every section begins a row; none is longer than COLUMNS by much.
    let height = (pictures / 2 + 8) * (PICTURE[1] + 110);
    let page = page.canonicalize()?;
    let mut command = Command::new(browser);
    command.args(["--headless=new", "--no-sandbox", "--disable-gpu", "--hide-scrollbars"]);
    command.arg(format!("--user-data-dir={}", page.with_file_name("profile").display()));
    command.arg(format!("--window-size={width},{height}"));
    command.arg(format!("--screenshot={}", picture.display()));
    command.arg(format!("file://{}", page.display()));
    output_within(&mut command, BROWSER_LIMIT)?;
    picture::shows_something(&picture)?;
    Ok(picture)
}

fn text<'a>(asset: &'a Value, key: &str) -> &'a str {
    asset[key].as_str().unwrap_or_default()
}

fn number(asset: &Value, key: &str) -> f64 {
    asset[key].as_f64().unwrap_or_default()
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;")
}

const HEAD: &str = "<!doctype html><meta charset=utf-8><title>Contact sheet</title><style>
body { font: 13px sans-serif; margin: 12px; background: #fff; color: #111; display: flex; flex-wrap: wrap; gap: 4px 16px }
section { display: flex; flex-wrap: wrap; gap: 6px; align-content: start }
h2 { font-size: 14px; margin: 8px 0 0; flex-basis: 100% } p { margin: 0; flex-basis: 100% }
figure { margin: 0; width: 320px } img { display: block; width: 320px; height: 240px }
pre { white-space: pre-wrap; background: #eee; padding: 8px } i { color: #a40 }
</style>\n";
