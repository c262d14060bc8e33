//! Every public scene of `../shared/scenes` loads with what its manifest says, or is refused for the reason it says.

use std::path::{Path, PathBuf};

use frameless_scene::{AlphaMode, Geometry, Limits, Material, Problem, Scene, load};
use serde_json::Value;

/// `../shared` beside the project, unless it is missing: aloud, and not in CI.
fn shared(folder: &str) -> Option<PathBuf> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared").join(folder);
    if path.is_dir() {
        return Some(path);
    }
    assert_ne!(std::env::var("CI").as_deref(), Ok("true"), "../shared/{folder} is missing");
    eprintln!("SKIPPED: ../shared/{folder} is missing");
    None
}

fn triangles(scene: &Scene) -> usize {
    let count = |geometry: &Geometry| match geometry {
        Geometry::Mesh(mesh) => mesh.triangles.len(),
        Geometry::Sphere { .. } => 0,
    };
    let instances = scene.instances.iter();
    instances.map(|instance| count(&scene.geometries[instance.geometry as usize])).sum()
}

/// The manifest counts the triangles of mode 4 at all nodes; we draw strips and fans too, and only the default scene.
fn expected_triangles(asset: &Value) -> usize {
    let file = asset["file"].as_str().unwrap();
    let counted = asset["triangles"].as_u64().unwrap() as usize;
    match file {
        "accessors/MeshPrimitiveModes/MeshPrimitiveModes.gltf" => counted + 4 + 6,
        // EXT_mesh_gpu_instancing.
        "scene/SimpleInstancing.glb" => counted * 125,
        "scene/MultipleScenes/MultipleScenes.gltf" => counted - 1,
        _ => counted,
    }
}

#[derive(PartialEq)]
enum Mode {
    Opaque,
    Mask,
    Blend,
}

impl Mode {
    fn of(material: &Material) -> Mode {
        match material.alpha_mode {
            AlphaMode::Opaque => Mode::Opaque,
            AlphaMode::Mask { .. } => Mode::Mask,
            AlphaMode::Blend => Mode::Blend,
        }
    }
}

fn complaints(scene: &Scene, asset: &Value) -> Vec<String> {
    let mut complaints = Vec::new();
    let mut expect = |what: &str, came: f64, expected: f64| {
        if (came - expected).abs() > 0.006 {
            complaints.push(format!("{what}: {came} instead of {expected}"));
        }
    };
    expect("triangles", triangles(scene) as f64, expected_triangles(asset) as f64);
    let merges_nothing = asset["animations"].as_u64().unwrap() <= 1;
    if merges_nothing {
        expect("seconds", scene.animation.duration_secs, asset["duration_s"].as_f64().unwrap());
    }
    let cameras = asset["cameras"].as_u64().unwrap().max(1) as f64;
    expect("cameras", scene.cameras.len() as f64, cameras);
    let has = |what: &str| scene.warnings.iter().any(|warning| warning.contains(what));
    let (skins, targets) = (&asset["skins"], &asset["morph_targets"]);
    expect("skins", scene.skins.len() as f64, skins.as_f64().unwrap());
    expect(
        "deforms",
        f64::from(!scene.deformations.is_empty()),
        f64::from(*skins != 0 || *targets != 0),
    );
    expect("warned of deformation", f64::from(has("skin") || has("morph")), 0.0);
    expect("warned of a material", f64::from(has("material \"") && has("not drawn")), 0.0);
    let modes = asset["alpha_modes"].as_array().unwrap();
    for (name, mode) in [("MASK", Mode::Mask), ("BLEND", Mode::Blend)] {
        let wanted = modes.iter().any(|mode| *mode == name);
        let came = scene.materials.iter().any(|material| Mode::of(material) == mode);
        expect(name, f64::from(came), f64::from(wanted));
    }
    if has("checker") {
        complaints.push(format!("{:?}", scene.warnings));
    }
    complaints.extend(scene.check().err());
    complaints
}

#[test]
fn all_load_as_the_manifest_says() {
    let Some(folder) = shared("scenes") else { return };
    let manifest = std::fs::read_to_string(folder.join("manifest.json")).unwrap();
    let manifest: Value = serde_json::from_str(&manifest).unwrap();
    let mut failures = Vec::new();
    let mut loaded = 0;
    for asset in manifest["assets"].as_array().unwrap() {
        let file = asset["file"].as_str().unwrap();
        let result = load(&folder.join(file), &Limits::default());
        let failure = match (asset["category"].as_str().unwrap(), result) {
            ("environment", _) => Vec::new(),
            ("must-refuse", Ok(_)) => vec!["loaded, but must be refused".to_owned()],
            ("must-refuse", Err(error)) => {
                let text = error.to_string();
                let named = text.contains("ACME_gizmo") || text.contains("version");
                if named { Vec::new() } else { vec![text] }
            }
            ("may-refuse", Err(error)) => match error.problem {
                Problem::RequiredExtension(_) => Vec::new(),
                _ => vec![error.to_string()],
            },
            (_, Err(error)) => vec![error.to_string()],
            (_, Ok(scene)) => {
                loaded += 1;
                eprintln!("{file}: {:#?} {:?}", scene.warnings, scene.notes);
                complaints(&scene, asset)
            }
        };
        failures.extend(failure.into_iter().map(|failure| format!("{file}: {failure}")));
    }
    assert!(failures.is_empty(), "{failures:#?}");
    assert!(loaded >= 32, "only {loaded} scenes were loaded");
}
