//! Public scenes that carry their expected outcome in their geometry, as they were when people looked at them and found them right.
//!
//! Pictures are compared by FLIP. Where one differs, what was drawn is left in the build folder, with a picture of the difference.
//! After a change that is meant: look at the new pictures, then `FRAMELESS_BLESS=1 cargo test -p frameless-eval --test golden`.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use frameless::{Display, Size, ToneMap};
use frameless_eval::flip;
use frameless_scene::{Environment, Limits, load, load_environment};
use frameless_trace::{Integrator, Settings, Still, ViewSource, World, render_still, thread_pool};

const SIZE: Size = Size { width: 160, height: 120 };
/// The most that any two processors differ is far below; a texture that is off by half a texel, or one tick that has become a
/// cross, is far above.
const MOST_DIFFERENT: f64 = 0.004;

struct Golden {
    name: &'static str,
    file: &'static str,
    secs: f64,
    integrator: Integrator,
    samples: u32,
    /// Lit by the public sky.
    has_sky: bool,
}

const DIRECT: Golden = Golden {
    name: "",
    file: "",
    secs: 0.0,
    integrator: Integrator::Direct,
    samples: 8,
    has_sky: false,
};
const PATH: Golden = Golden { integrator: Integrator::Path, samples: 64, has_sky: true, ..DIRECT };

const GOLDEN: [Golden; 9] = [
    Golden { name: "texture-settings", file: "texture/TextureSettingsTest.glb", ..DIRECT },
    Golden {
        name: "texture-transform",
        file: "texture/TextureTransformTest/TextureTransformTest.gltf",
        ..DIRECT
    },
    Golden { name: "multi-uv", file: "texture/MultiUVTest.glb", ..DIRECT },
    Golden { name: "negative-scale", file: "pbr/NegativeScaleTest.glb", ..DIRECT },
    Golden { name: "alpha-blend-mode", file: "pbr/AlphaBlendModeTest.glb", ..DIRECT },
    Golden { name: "interpolation", file: "rigid/InterpolationTest.glb", secs: 0.6, ..DIRECT },
    Golden {
        name: "sparse-accessor",
        file: "accessors/SimpleSparseAccessor/SimpleSparseAccessor.gltf",
        ..DIRECT
    },
    Golden { name: "attenuation", file: "materials-ext/AttenuationTest.glb", ..PATH },
    Golden { name: "water-bottle", file: "pbr/WaterBottle-1k.glb", ..PATH },
];

/// `../shared/scenes`, or `None` where it is missing: then the test says so aloud, and fails in CI.
fn shared_scenes() -> Option<PathBuf> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/scenes");
    if path.is_dir() {
        return Some(path);
    }
    assert!(std::env::var("CI").as_deref() != Ok("true"), "CI needs ../shared");
    eprintln!("SKIPPED: ../shared is missing, golden pictures were not drawn");
    None
}

/// As `frameless render` shows it, in [0, 1].
fn draw(golden: &Golden, scenes: &Path, sky: &Environment) -> Vec<[f32; 3]> {
    let mut scene = load(&scenes.join(golden.file), &Limits::default()).expect(golden.name);
    if golden.has_sky {
        scene.light_by(sky.clone());
    }
    let settings = Settings { integrator: golden.integrator, max_depth: 8, ..Settings::default() };
    let Golden { secs, samples, .. } = *golden;
    let view = ViewSource::Camera(0);
    let still = Still { secs, view, size: SIZE, settings, samples, first_sample: 0 };
    let radiance = render_still(&World::new(Arc::new(scene)), &still, &thread_pool(0), || ());
    let display = Display::default().with_tone_map(ToneMap::Neutral);
    radiance.into_iter().map(|rgb| display.encode(rgb)).collect()
}

fn write(path: &Path, picture: &[[f32; 3]]) {
    let bytes = picture.as_flattened().iter().map(|&c| Display::quantize(c)).collect();
    let image = image::RgbImage::from_raw(SIZE.width, SIZE.height, bytes).expect("of that size");
    image.save(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
}

fn read(path: &Path) -> Vec<[f32; 3]> {
    let image = image::open(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    image
        .to_rgb8()
        .pixels()
        .map(|pixel| pixel.0.map(|channel| f32::from(channel) / 255.0))
        .collect()
}

#[test]
fn public_scenes_look_as_they_did_when_they_were_found_right() {
    let Some(scenes) = shared_scenes() else { return };
    let sky = scenes.join("environment/aristea_wreck_puresky_1k.hdr");
    let sky = load_environment(&sky, &Limits::default()).expect("a sky");
    let golden_dir = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden");
    let out = Path::new(env!("CARGO_TARGET_TMPDIR"));
    let mut wrong = Vec::new();
    for golden in &GOLDEN {
        let drawn = draw(golden, &scenes, &sky);
        let kept = golden_dir.join(golden.name).with_extension("png");
        if std::env::var_os("FRAMELESS_BLESS").is_some() {
            write(&kept, &drawn);
            continue;
        }
        let expected = read(&kept);
        let difference = flip(&expected, &drawn, SIZE.width as usize);
        eprintln!("{}: FLIP {difference:.5}", golden.name);
        if difference > MOST_DIFFERENT {
            let apart =
                |(a, b): (&[f32; 3], &[f32; 3])| std::array::from_fn(|k| (a[k] - b[k]).abs());
            let map: Vec<[f32; 3]> = expected.iter().zip(&drawn).map(apart).collect();
            let file = |what: &str| out.join(format!("{}-{what}.png", golden.name));
            write(&file("actual"), &drawn);
            write(&file("expected"), &expected);
            write(&file("difference"), &map);
            wrong.push(format!(
                "{}: FLIP {difference:.4}; see {}",
                golden.name,
                file("actual").display()
            ));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
