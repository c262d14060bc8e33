//! Materials, textures, images and extensions.

use frameless_scene::{Filter, Limits, Scene, TextureRef, Wrap, load_bytes};
use glam::{Vec3, Vec4};
use serde_json::{Value, json};

use super::maker::{Maker, SQUARE, png, rich};

/// A document with one material.
fn with_material(material: Value) -> Maker {
    let mut maker = Maker::new();
    maker.push("materials", material);
    maker
}

/// A document with one material that shows an image of these bytes.
fn with_image(bytes: &[u8]) -> Maker {
    let mut maker = with_material(json!({"name": "shown",
        "pbrMetallicRoughness": {"baseColorTexture": {"index": 0, "texCoord": 1}}}));
    let view = maker.view(bytes);
    maker.push("textures", json!({"source": 0}));
    maker.push("images", json!({"bufferView": view, "name": "picture"}));
    maker
}

fn warns(scene: &Scene, of: &str) -> bool {
    scene.warnings.iter().any(|warning| warning.contains(of))
}

#[test]
fn factors_are_read_and_default_to_the_specification() {
    let empty = &with_material(json!({})).load().materials[0];
    assert_eq!((empty.base_color, empty.metallic, empty.roughness), (Vec4::ONE, 1.0, 1.0));
    assert!(!empty.double_sided && empty.emissive == Vec3::ZERO);
    let scene = with_material(json!({"name": "full", "doubleSided": true,
        "pbrMetallicRoughness": {"baseColorFactor": [0.1, 0.2, 0.3, 0.4], "metallicFactor": 0.5,
            "roughnessFactor": 0.6},
        "emissiveFactor": [1.0, 0.5, 0.0],
        "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 10.0}}}))
    .load();
    let full = &scene.materials[0];
    assert_eq!(full.base_color, Vec4::new(0.1, 0.2, 0.3, 0.4));
    assert_eq!((full.metallic, full.roughness), (0.5, 0.6));
    assert_eq!(full.emissive, Vec3::new(10.0, 5.0, 0.0));
    assert!(full.double_sided);
    assert_eq!(full.name, "full");
}

#[test]
fn factors_out_of_range_are_moved_aloud() {
    let scene = with_material(json!({"pbrMetallicRoughness": {"metallicFactor": 3.0,
        "baseColorFactor": [-1.0, 0.5, 2.0, 1.0]}}))
    .load();
    assert_eq!(scene.materials[0].base_color, Vec4::new(0.0, 0.5, 1.0, 1.0));
    assert_eq!(scene.materials[0].metallic, 1.0);
    assert!(warns(&scene, "outside [0, 1]"));
}

#[test]
fn textures_are_decoded_with_their_sampler() {
    let scene = rich().load();
    let texture = scene.materials[0].base_color_texture;
    assert_eq!(texture, Some(TextureRef { texture: 0, uv_set: 0 }));
    assert_eq!(scene.textures[0].filter, Filter::Nearest);
    assert_eq!(scene.textures[0].wrap, [Wrap::ClampToEdge, Wrap::MirroredRepeat]);
    assert_eq!((scene.images[0].width, scene.images[0].height), (2, 2));
    assert_eq!(scene.images[0].rgba, [[255, 128, 0, 255]; 4]);
    assert_eq!(scene.images.len(), 1, "one image, however many textures show it");
}

/// The mean of (255, 128, 0): roughness is green, metalness blue, and light is linear.
#[test]
fn textures_that_are_not_drawn_count_by_their_mean() {
    let material = &rich().load().materials[0];
    assert!((material.roughness - 0.25 * 128.0 / 255.0).abs() < 1e-6);
    assert_eq!(material.metallic, 0.0);
    assert_eq!(material.emissive, Vec3::new(0.5 * 2.0, 0.0, 0.0));
}

#[test]
fn what_is_not_drawn_is_warned_of_by_name() {
    let scene = rich().load();
    for of in [
        "normal textures are not drawn: material \"paint\"",
        "alpha mode MASK is drawn opaque: material \"paint\"",
        "metallic-roughness textures are replaced by their mean: material \"paint\"",
        "emissive textures are replaced by their mean: material \"paint\"",
    ] {
        assert!(scene.warnings.iter().any(|warning| warning == of), "{of}: {:#?}", scene.warnings);
    }
    assert_eq!(scene.warnings.len(), 4, "{:#?}", scene.warnings);
}

#[test]
fn an_image_that_cannot_be_read_is_a_checker() {
    let mut no_png = png(4, 4);
    let middle = no_png.len() / 2;
    no_png[middle] ^= 0xFF;
    let huge = png(300, 300);
    for (bytes, reason) in
        [(&no_png[..], "CRC"), (b"GIF89a", "wanted a PNG"), (&huge, "90000 pixels")]
    {
        let limits = Limits { image_pixels: 10_000, ..Limits::default() };
        let scene = load_bytes("i.glb", &with_image(bytes).glb(), None, &limits).unwrap();
        assert_eq!(scene.images[0].rgba[..2], [[255, 0, 255, 255], [128, 128, 128, 255]]);
        assert!(warns(&scene, "checker: image \"picture\""), "{:?}", scene.warnings);
        assert!(warns(&scene, reason), "{reason}: {:?}", scene.warnings);
    }
}

#[test]
fn an_image_file_that_is_missing_is_a_checker_but_one_outside_the_folder_is_refused() {
    let folder = std::path::Path::new(env!("CARGO_TARGET_TMPDIR"));
    let mut maker = with_image(b"unused");
    let load = |maker: &Maker| load_bytes("i.glb", &maker.glb(), Some(folder), &Limits::default());
    maker.json["images"][0] = json!({"uri": "missing.png"});
    assert!(warns(&load(&maker).unwrap(), "missing.png"));
    maker.json["images"][0] = json!({"uri": "../secret.png"});
    assert!(load(&maker).unwrap_err().to_string().contains("/images/0/uri"));
}

#[test]
fn images_may_be_in_data_uris() {
    use base64::Engine;
    let text = base64::engine::general_purpose::STANDARD_NO_PAD.encode(png(1, 1));
    let mut maker = with_image(b"unused");
    maker.json["images"][0] = json!({"uri": format!("data:image/png;base64,{text}")});
    let scene = maker.load();
    assert_eq!(scene.images[0].rgba, [[255, 128, 0, 255]]);
    assert_eq!(scene.materials[0].base_color_texture.unwrap().uv_set, 1);
}

#[test]
fn images_that_nobody_shows_are_not_decoded() {
    let mut maker = with_image(b"no image");
    maker.json["materials"] = json!([{}]);
    assert!(maker.load().images.is_empty());
}

#[test]
fn required_extensions_are_supported_or_refused_by_name() {
    let mut maker = Maker::new();
    maker.json["extensionsRequired"] = json!(["KHR_lights_punctual", "ACME\u{1b}_gizmo"]);
    let expected = "made.glb: /extensionsRequired/1: the file requires the extension \
        \"ACME\\u{1b}_gizmo\", which is not supported";
    assert_eq!(maker.refusal(), expected);
}

#[test]
fn optional_extensions_are_ignored_aloud_declared_or_not() {
    let mut maker = with_material(json!({"extensions": {"KHR_materials_sheen": {}}}));
    maker.json["extensionsUsed"] = json!(["KHR_materials_clearcoat", "KHR_materials_unlit"]);
    maker.json["extras"] = json!({"extensions": {"not_an_extension": {}}});
    let scene = maker.load();
    assert!(
        warns(&scene, "\"KHR_materials_sheen\"") && warns(&scene, "\"KHR_materials_clearcoat\"")
    );
    assert!(!warns(&scene, "not_an_extension") && !warns(&scene, "unlit"));
}

#[test]
fn other_versions_are_refused() {
    for version in ["1.0", "3.0", "", "22.0"] {
        let mut maker = Maker::new();
        maker.json["asset"]["version"] = json!(version);
        assert!(maker.refusal().contains("/asset/version: wanted glTF version 2.x"), "{version}");
    }
    let mut maker = Maker::new();
    maker.json["asset"] = json!({"version": "2.1"});
    assert!(maker.try_load().is_ok());
}

/// A lamp is made to light the scene; a screen is not.
#[test]
fn light_is_added_unless_something_shines() {
    for (strength, lights, ambient) in [(0.0, 1, 0.25), (0.9, 1, 0.25), (5.0, 0, 0.2)] {
        let mut maker = Maker::with_primitive(
            |maker| json!({"attributes": {"POSITION": maker.floats("VEC3", &SQUARE)}, "material": 0}),
        );
        let strength = json!({"KHR_materials_emissive_strength": {"emissiveStrength": strength}});
        maker.push("materials", json!({"emissiveFactor": [1.0, 1.0, 1.0], "extensions": strength}));
        let scene = maker.load();
        assert_eq!(scene.lights.len(), lights, "{strength}");
        assert_eq!(scene.ambient, Vec3::splat(ambient), "{strength}");
        assert!(scene.notes.iter().any(|note| note.contains("no light in the file")));
    }
}
