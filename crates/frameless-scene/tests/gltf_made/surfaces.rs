//! Materials, textures, images and extensions.

use frameless_scene::{
    AlphaMode, Environment, Filter, Limits, Minify, Scene, Texels, TextureRef, Wrap, load_bytes,
};
use glam::{Vec2, Vec3, Vec4};
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
    assert_eq!(texture, Some(TextureRef::plain(0)));
    assert_eq!(scene.textures[0].filter, Filter::Nearest);
    assert_eq!(scene.textures[0].minify, Minify::TRILINEAR);
    assert_eq!(scene.textures[0].wrap, [Wrap::ClampToEdge, Wrap::MirroredRepeat]);
    assert_eq!((scene.images[0].width, scene.images[0].height), (2, 2));
    assert_eq!(scene.images[0].rgba, [[255, 128, 0, 255]; 4]);
    assert_eq!(scene.images.len(), 1, "one image, however many textures show it");
}

#[test]
fn all_textures_of_a_material_are_kept_with_their_factors() {
    let scene = rich().load();
    let material = &scene.materials[0];
    assert_eq!((material.roughness, material.metallic), (0.25, 0.5));
    assert_eq!(material.metallic_roughness_texture, Some(TextureRef::plain(1)));
    assert_eq!(material.emissive, Vec3::new(0.5 * 2.0, 0.0, 0.0));
    assert_eq!(material.emissive_texture, Some(TextureRef::plain(0)));
    assert_eq!(material.normal_texture, Some((TextureRef::plain(1), 1.0)));
    assert_eq!(material.alpha_mode, AlphaMode::Mask { cutoff: 0.5 });
    assert!(scene.warnings.is_empty(), "{:#?}", scene.warnings);
}

#[test]
fn minification_filters_are_told_apart() {
    use Filter::{Linear, Nearest};
    let expected = [
        (json!(null), Some((Linear, Some(Linear)))),
        (json!(9728), Some((Nearest, None))),
        (json!(9729), Some((Linear, None))),
        (json!(9984), Some((Nearest, Some(Nearest)))),
        (json!(9985), Some((Linear, Some(Nearest)))),
        (json!(9986), Some((Nearest, Some(Linear)))),
        (json!(9987), Some((Linear, Some(Linear)))),
        (json!(9988), None),
    ];
    for (number, expected) in expected {
        let mut maker = with_image(&png(1, 1));
        let sampler = if number.is_null() { json!({}) } else { json!({"minFilter": number}) };
        maker.push("samplers", sampler);
        maker.json["textures"][0]["sampler"] = json!(0);
        match (maker.try_load(), expected) {
            (Ok(scene), Some((filter, levels))) => {
                assert_eq!(scene.textures[0].minify, Minify { filter, levels });
            }
            (Err(error), None) => assert!(error.to_string().contains("/samplers/0/minFilter")),
            (result, _) => panic!("{number}: {result:?}"),
        }
    }
}

#[test]
fn a_texture_transform_may_name_another_set() {
    let mut maker = with_image(&png(1, 1));
    let transform = json!({"offset": [0.5, 0.25], "scale": [2.0, 3.0], "texCoord": 3});
    let info = json!({"index": 0, "texCoord": 1,
        "extensions": {"KHR_texture_transform": transform}});
    maker.json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"] = info;
    let reference = maker.load().materials[0].base_color_texture.unwrap();
    assert_eq!(reference.uv_set, 3);
    let moved = reference.picture_from_uv.transform_point2(Vec2::ONE);
    assert_eq!(moved, Vec2::new(2.5, 3.25));
    let info = &mut maker.json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"];
    info["extensions"]["KHR_texture_transform"]["texCoord"] = json!(4);
    let scene = maker.load();
    assert!(scene.materials[0].base_color_texture.is_none());
    assert!(warns(&scene, "beyond set 3"));
}

fn with_extensions(extensions: Value) -> Scene {
    with_material(json!({"name": "layered", "extensions": extensions})).load()
}

#[test]
fn extensions_of_materials_are_read() {
    let scene = with_extensions(json!({
        "KHR_materials_unlit": {},
        "KHR_materials_ior": {"ior": 1.33},
        "KHR_materials_specular": {"specularFactor": 0.5, "specularColorFactor": [1.0, 2.0, 0.0]},
        "KHR_materials_transmission": {"transmissionFactor": 0.75},
        "KHR_materials_volume": {"thicknessFactor": 0.1, "attenuationDistance": 2.0,
            "attenuationColor": [1.0, 0.5, 0.25]},
        "KHR_materials_clearcoat": {"clearcoatFactor": 1.0, "clearcoatRoughnessFactor": 0.125},
        "KHR_materials_sheen": {"sheenColorFactor": [0.5, 0.0, 1.0], "sheenRoughnessFactor": 0.3}}));
    assert_eq!(scene.warnings, ["the file has nothing to draw"]);
    let material = &scene.materials[0];
    assert!(material.unlit && material.specular == 0.5);
    let layers = material.layers.as_ref().unwrap();
    assert_eq!((layers.ior, layers.transmission), (1.33, 0.75));
    assert_eq!(layers.specular_color, Vec3::new(1.0, 2.0, 0.0));
    let sigma = layers.volume.unwrap().absorption_per_m;
    let after_2_m = Vec3::from_array((-2.0 * sigma).to_array().map(f32::exp));
    assert!(after_2_m.abs_diff_eq(Vec3::new(1.0, 0.5, 0.25), 1e-6), "{after_2_m}");
    assert_eq!((layers.clearcoat, layers.clearcoat_roughness), (1.0, 0.125));
    assert_eq!((layers.sheen_color, layers.sheen_roughness), (Vec3::new(0.5, 0.0, 1.0), 0.3));
}

#[test]
fn absurd_layers_are_settled_aloud() {
    let ior = |ior: f32| {
        let scene = with_extensions(json!({"KHR_materials_ior": {"ior": ior}}));
        let said = warns(&scene, "refractive indices below 1");
        (scene.materials[0].layers.as_ref().map(|layers| layers.ior), said)
    };
    assert_eq!(ior(0.0), (Some(f32::INFINITY), false));
    assert_eq!(ior(0.5), (Some(1.0), true));
    assert_eq!(ior(-3.0), (Some(1.0), true));
    assert_eq!(ior(1.5), (None, false));
    let volume = json!({"thicknessFactor": 1.0, "attenuationDistance": 0.0});
    let scene = with_extensions(json!({"KHR_materials_volume": volume}));
    assert!(warns(&scene, "attenuate nothing"));
    let color = json!({"specularColorFactor": [-1.0, 0.0, 0.0]});
    assert!(warns(&with_extensions(json!({"KHR_materials_specular": color})), "negative colours"));
    let mut maker = with_material(json!({"alphaMode": "MASK", "alphaCutoff": 1e39}));
    assert!(maker.refusal().contains("/materials/0/alphaCutoff: wanted a 32-bit number"));
    maker.json["materials"][0] = json!({"alphaMode": "GLASS"});
    assert!(maker.refusal().contains("wanted OPAQUE, MASK or BLEND"));
}

#[test]
fn an_environment_takes_the_place_of_light_that_was_added() {
    let mut scene = Maker::with_primitive(
        |maker| json!({"attributes": {"POSITION": maker.floats("VEC3", &SQUARE)}}),
    )
    .load();
    assert!(scene.has_added_light && scene.lights.len() == 1);
    let texels = std::sync::Arc::new(Texels::Linear(vec![[1.0; 3]; 2]));
    let environment = Environment {
        name: "two.hdr".to_owned(),
        width: 2,
        height: 1,
        texels,
        rotation_rad: 0.0,
        strength: 1.0,
    };
    scene.light_by(environment.clone());
    assert!(scene.lights.is_empty() && scene.ambient == Vec3::ZERO);
    assert!(!scene.notes.iter().any(|note| note.contains("added a key light")));
    scene.check().unwrap();
    scene.environment = Some(Environment { height: 2, ..environment });
    assert!(scene.check().is_err());
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
fn an_image_of_few_bytes_cannot_fill_memory() {
    let load = |width, height| {
        let maker = with_image(&flat_png(width, height));
        load_bytes("i.glb", &maker.glb(), None, &Limits::default()).unwrap()
    };
    // Sixteen times as many pixels as limits by default allow for so few bytes, and just more than that.
    for (width, height, reason) in [
        (20_000, 20_000, "400000000 pixels in one image"),
        (9000, 8000, "pixels in images of few bytes, more than the limit of 62500000"),
    ] {
        let scene = load(width, height);
        assert_eq!((scene.images[0].width, scene.images[0].height), (8, 8));
        assert!(warns(&scene, reason), "{reason}: {:?}", scene.warnings);
        assert!(warns(&scene, "; --max-texture-pixels raises it"), "{:?}", scene.warnings);
    }
    let mut rows = vec![0; 3000 / 8 * 2000];
    rows[0] = 1;
    let maker = with_image(&png_of_bits(3000, 2000, &rows, &[]));
    assert_eq!(maker.load().images[0].width, 3000);
}

/// All of one colour, as tools bake them: 300 million pixels that take nothing.
#[test]
fn eighteen_flat_pictures_are_a_texel_each() {
    let mut maker = with_image(&flat_png(4096, 4096));
    add_pictures(&mut maker, (1..18).map(|k| flat_png(4096, 4096 - k)));
    let scene = maker.load();
    assert!(!warns(&scene, "image"), "{:?}", scene.warnings);
    assert_eq!(scene.images.len(), 18);
    assert!(scene.images.iter().all(|image| image.rgba == [[0, 0, 0, 255]]));
}

/// More pictures, each in a material of its own.
fn add_pictures(maker: &mut Maker, pictures: impl Iterator<Item = Vec<u8>>) {
    for picture in pictures {
        let view = maker.view(&picture);
        let image = maker.push("images", json!({"bufferView": view}));
        let texture = maker.push("textures", json!({"source": image}));
        maker.push(
            "materials",
            json!({"pbrMetallicRoughness": {"baseColorTexture": {"index": texture}}}),
        );
    }
}

/// Of few bytes, and not of one colour.
fn smooth_png(width: u32, height: u32, blue: u8) -> Vec<u8> {
    let texel = |x: u32, y: u32| image::Rgb([(x / 2) as u8, (y / 2) as u8, blue]);
    let mut bytes = std::io::Cursor::new(Vec::new());
    let picture = image::RgbImage::from_fn(width, height, texel);
    picture.write_to(&mut bytes, image::ImageFormat::Png).unwrap();
    bytes.into_inner()
}

/// The largest is halved until all fit, with a warning whose number is enough; which of them does not depend on threads.
#[test]
fn pictures_for_which_there_is_no_room_are_halved() {
    let mut maker = with_image(&smooth_png(64, 64, 0));
    add_pictures(&mut maker, (1..5).map(|k| smooth_png(256, 255 + u32::from(k % 2), k)));
    let load = |total_pixels| {
        let limits = Limits { total_pixels, ..Limits::default() };
        load_bytes("i.glb", &maker.glb(), None, &limits).unwrap()
    };
    let sizes = |scene: &Scene| -> Vec<[u32; 2]> {
        scene.images.iter().map(|image| [image.width, image.height]).collect()
    };
    let scene = load(8 * 130_000);
    assert_eq!(sizes(&scene), [[64, 64], [128, 128], [256, 255], [128, 128], [256, 255]]);
    let warning = scene.warnings.iter().find(|warning| warning.contains("half")).unwrap();
    assert!(warning.contains("images are kept at half their size or less"), "{warning}");
    assert!(warning.ends_with("/images/1, /images/3"), "{warning}");
    assert!(!warns(&scene, "checker"), "{:?}", scene.warnings);
    // A texel is the mean of four: x / 2 and y / 2, rounded down, are the same for all of them.
    assert_eq!(scene.images[3].rgba[20 * 128 + 30], [30, 20, 3, 255]);
    let (_, enough) = warning.split_once("--max-texture-pixels raises it (").unwrap();
    let (enough, _) = enough.split_once(" or more)").unwrap();
    let enough: u64 = enough.parse().unwrap();
    let whole = load(enough);
    assert_eq!(sizes(&whole)[1..], [[256, 256], [256, 255], [256, 256], [256, 255]]);
    assert!(!warns(&whole, "image"), "{:?}", whole.warnings);
    assert!(warns(&load(enough - 16), "half"));
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    assert!(pool.install(|| load(8 * 130_000)).images == scene.images);
}

/// Flat pictures take no room, but time: what is too much is not decoded, and the warning's number is enough.
#[test]
fn decoding_is_bounded_though_nothing_is_kept() {
    let mut maker = with_image(&flat_png(256, 249));
    add_pictures(&mut maker, (0..7).map(|k| flat_png(256, 250 + k)));
    let load = |total_pixels| {
        let limits = Limits { total_pixels, ..Limits::default() };
        load_bytes("i.glb", &maker.glb(), None, &limits).unwrap()
    };
    let checkers = |scene: &Scene| scene.images.iter().filter(|image| image.width == 8).count();
    let scene = load(8 * 70_000);
    assert_eq!(checkers(&scene), 3, "{:?}", scene.warnings);
    let warning = scene.warnings.iter().find(|warning| warning.contains("checker")).unwrap();
    assert!(warning.contains("pixels to decode in all images"), "{warning}");
    let (_, enough) = warning.split_once("--max-texture-pixels raises it (").unwrap();
    let (enough, _) = enough.split_once(" or more)").unwrap();
    let whole = load(enough.parse().unwrap());
    assert_eq!(checkers(&whole), 0);
    assert!(!warns(&whole, "image"), "{:?}", whole.warnings);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    assert!(pool.install(|| load(8 * 70_000)).images == scene.images);
}

/// Colours in linear light: black and white rows are half the light, 188; as numbers they are 128.
#[test]
fn halved_pictures_are_as_bright_as_they_were() {
    let rows: Vec<u8> = (0..256).flat_map(|y| [if y % 2 == 0 { 0 } else { 255 }; 32]).collect();
    let mut maker = with_image(&png_of_bits(256, 256, &rows, &[]));
    add_pictures(&mut maker, (0..3).map(|k| smooth_png(256, 256, k)));
    let limits = Limits { total_pixels: 8 * 70_000, ..Limits::default() };
    for (used_as, expected) in [("baseColorTexture", 188), ("metallicRoughnessTexture", 128)] {
        maker.json["materials"][0]["pbrMetallicRoughness"] = json!({used_as: {"index": 0}});
        let scene = load_bytes("i.glb", &maker.glb(), None, &limits).unwrap();
        assert!(warns(&scene, "half"), "{:?}", scene.warnings);
        let [r, g, b, a] = scene.images[0].rgba[77];
        assert_eq!(([r, g, b], a), ([expected; 3], 255), "{used_as}");
    }
}

/// Whatever is in a PNG besides its picture neither takes memory nor speaks for the picture.
#[test]
fn what_is_not_the_picture_of_a_png_counts_for_nothing() {
    let text = [b'a'; 2_000_000];
    let rows = vec![0; 9000 / 8 * 8000];
    let padded = png_of_bits(9000, 8000, &rows, &text);
    let trailing = [flat_png(9000, 8000), text.to_vec()].concat();
    for bytes in [padded, trailing] {
        let scene =
            load_bytes("i.glb", &with_image(&bytes).glb(), None, &Limits::default()).unwrap();
        assert!(warns(&scene, "pixels in images of few bytes"), "{:?}", scene.warnings);
    }
    let small = png_of_bits(8, 1, &[0], &text);
    let scene = load_bytes("i.glb", &with_image(&small).glb(), None, &Limits::default()).unwrap();
    assert_eq!((scene.images[0].width, scene.images[0].height), (8, 1));
    assert!(!warns(&scene, "image"), "{:?}", scene.warnings);
}

/// A picture whose rows are not all alike.
fn gradient() -> image::RgbImage {
    image::RgbImage::from_fn(64, 64, |x, y| image::Rgb([4 * x as u8, 4 * y as u8, 99]))
}

fn encoded(format: image::ImageFormat) -> Vec<u8> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    gradient().write_to(&mut bytes, format).unwrap();
    bytes.into_inner()
}

fn crc_32(bytes: &[u8]) -> u32 {
    let step =
        |crc: u32| (0..8).fold(crc, |crc, _| (crc >> 1) ^ (0xedb8_8320 & (crc & 1).wrapping_neg()));
    !bytes.iter().fold(!0, |crc, byte| step(crc ^ u32::from(*byte)))
}

/// The last bytes of its data are wrong (their checksum, before that of the chunk), which is as it should be.
fn png_with_wrong_data_checksum() -> Vec<u8> {
    let mut bytes = encoded(image::ImageFormat::Png);
    let at = |kind: &[u8]| bytes.windows(4).position(|four| four == kind).unwrap();
    let (data, end) = (at(b"IDAT"), at(b"IEND") - 8);
    bytes[end - 1] ^= 1;
    let crc = crc_32(&bytes[data..end]);
    bytes[end..end + 4].copy_from_slice(&crc.to_be_bytes());
    bytes
}

#[test]
fn damaged_pictures_are_drawn_aloud() {
    let load =
        |bytes: &[u8]| load_bytes("i.glb", &with_image(bytes).glb(), None, &Limits::default());
    let damaged = "damaged are drawn as far as they can be read: image \"picture\" (/images/0) (";
    let (png, jpeg) = (encoded(image::ImageFormat::Png), encoded(image::ImageFormat::Jpeg));
    for whole in [&png, &jpeg] {
        let scene = load(whole).unwrap();
        assert!(!warns(&scene, "image"), "{:?}", scene.warnings);
        assert_eq!(scene.images[0].width, 64);
    }
    let cut = &jpeg[..jpeg.len() - 99];
    let endless = &jpeg[..jpeg.len() - 2];
    for bytes in [cut, endless, &png_with_wrong_data_checksum()] {
        let scene = load(bytes).unwrap();
        assert!(warns(&scene, damaged), "{:?}", scene.warnings);
        // What is there of it is drawn.
        let (right, found) = (gradient().get_pixel(9, 2).0, scene.images[0].rgba[2 * 64 + 9]);
        let close = right.iter().zip(found).all(|(a, b)| a.abs_diff(b) < 16);
        assert!(close, "{right:?} {found:?}");
    }
    for bytes in [&png[..png.len() / 2], &png[..png.len() - 12]] {
        let scene = load(bytes).unwrap();
        assert!(warns(&scene, "replaced by a magenta checker"), "{:?}", scene.warnings);
    }
}

/// As they were drawn before there were strict decoders: all kinds of pixels.
#[test]
fn pictures_of_all_kinds_of_pixels_are_what_they_were() {
    use image::{DynamicImage, ImageFormat};
    let rgb = DynamicImage::from(gradient());
    let kinds = [
        rgb.clone(),
        rgb.to_luma8().into(),
        rgb.to_luma_alpha8().into(),
        rgb.to_rgba8().into(),
        rgb.to_luma16().into(),
        rgb.to_luma_alpha16().into(),
        rgb.to_rgb16().into(),
        rgb.to_rgba16().into(),
    ];
    for picture in kinds {
        for format in [ImageFormat::Png, ImageFormat::Jpeg] {
            let mut bytes = std::io::Cursor::new(Vec::new());
            if picture.write_to(&mut bytes, format).is_err() {
                continue;
            }
            let bytes = bytes.into_inner();
            let expected = image::load_from_memory(&bytes).unwrap().into_rgba8();
            let scene = with_image(&bytes).load();
            assert!(!warns(&scene, "image"), "{:?}", scene.warnings);
            let texels = scene.images[0].rgba.as_flattened();
            assert!(texels == expected.as_raw(), "{:?} as {format:?}", picture.color());
        }
    }
}

/// Pictures of overlapping buffer views are as many pictures with the bytes of one; those of one view are one.
#[test]
fn bytes_of_many_pictures_speak_for_one_of_them() {
    let mut state = 1_u32;
    let mut noise = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 24) as u8
    };
    let rows: Vec<u8> = (0..5000 / 8 * 5000).map(|_| noise()).collect();
    // With a few bytes behind it, of which each view has another number.
    let mut maker = with_image(&[png_of_bits(5000, 5000, &rows, &[]), vec![0; 4]].concat());
    let image = maker.json["images"][0].clone();
    let view = image["bufferView"].as_u64().unwrap() as usize;
    let view = maker.json["bufferViews"][view].clone();
    maker.json["materials"][0]["emissiveFactor"] = json!([1.0, 1.0, 1.0]);
    for (index, used_as) in [(1, "normalTexture"), (2, "occlusionTexture"), (3, "emissiveTexture")]
    {
        let mut shorter = view.clone();
        shorter["byteLength"] = json!(view["byteLength"].as_u64().unwrap() - index);
        let mut image = image.clone();
        image["bufferView"] = json!(maker.push("bufferViews", shorter));
        maker.push("images", image);
        maker.push("textures", json!({"source": index}));
        maker.json["materials"][0][used_as] = json!({"index": index});
    }
    let scene = load_bytes("i.glb", &maker.glb(), None, &Limits::default()).unwrap();
    assert!(warns(&scene, "pixels in images of few bytes"), "{:?}", scene.warnings);
    maker.json["images"] = json!(vec![image; 4]);
    let scene = load_bytes("i.glb", &maker.glb(), None, &Limits::default()).unwrap();
    assert!(!warns(&scene, "pixels in images of few bytes"), "{:?}", scene.warnings);
    assert_eq!(scene.images.len(), 1);
}

/// A picture all of one colour.
fn flat_png(width: u32, height: u32) -> Vec<u8> {
    png_of_bits(width, height, &vec![0; (width.div_ceil(8) * height) as usize], &[])
}

/// A picture of black and white, after a text.
fn png_of_bits(width: u32, height: u32, rows: &[u8], text: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width, height);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.set_depth(png::BitDepth::One);
    let mut writer = encoder.write_header().unwrap();
    if !text.is_empty() {
        writer.write_chunk(png::chunk::tEXt, text).unwrap();
    }
    writer.write_image_data(rows).unwrap();
    writer.finish().unwrap();
    bytes
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
    let mut maker = with_material(json!({"extensions": {"KHR_materials_iridescence": {}}}));
    maker.json["extensionsUsed"] = json!(["KHR_materials_anisotropy", "KHR_materials_unlit"]);
    maker.json["extras"] = json!({"extensions": {"not_an_extension": {}}});
    let scene = maker.load();
    assert!(
        warns(&scene, "\"KHR_materials_iridescence\"")
            && warns(&scene, "\"KHR_materials_anisotropy\"")
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
    maker.json["asset"] = json!({"version": "2.1", "minVersion": "2.0"});
    assert!(maker.try_load().is_ok());
    maker.json["asset"] = json!({"version": "2.1", "minVersion": "2.1"});
    assert!(maker.refusal().contains("/asset/minVersion: wanted glTF version 2.0"));
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
