//! What works.

use frameless_scene::BUILTIN_NAMES;

use crate::run::frameless;

#[test]
fn the_built_in_scenes_are_listed_one_per_line() {
    let list = frameless(&["scenes"]).succeeded().out;
    let names: Vec<_> = list.lines().filter_map(|line| line.split(' ').next()).collect();
    assert_eq!(names, BUILTIN_NAMES);
}

#[test]
fn every_built_in_scene_can_be_told_of() {
    for name in BUILTIN_NAMES {
        let told = frameless(&["info", name]).succeeded().out;
        assert!(told.starts_with(&format!("scene       {name}\n")), "{told}");
        for line in ["geometries", "triangles", "bounds", "cameras", "lights", "motion"] {
            assert!(told.lines().any(|told| told.starts_with(line)), "no {line} in {told}");
        }
    }
}

#[test]
fn a_picture_of_a_moving_scene_changes_with_time_and_only_with_time() {
    let folder = tempfile::tempdir().unwrap();
    let render = |name: &str, time: &str| {
        let out = folder.path().join(name);
        let arguments = ["render", "sphere", "--size", "64x48", "--time", time, "-o"];
        let arguments = arguments.iter().map(Into::into).chain([out.as_os_str().to_owned()]);
        frameless(&arguments.collect::<Vec<std::ffi::OsString>>()).succeeded();
        std::fs::read(out).unwrap()
    };
    let first = render("a.png", "0.5");
    let picture = image::load_from_memory(&first).unwrap().to_rgb8();
    assert_eq!(picture.dimensions(), (64, 48));
    let brightest = picture.pixels().flat_map(|pixel| pixel.0).max();
    assert!(brightest > Some(64), "a black picture");
    assert_eq!(first, render("b.png", "0.5"));
    assert_ne!(first, render("c.png", "0.9"));
    let names: Vec<_> = std::fs::read_dir(folder.path()).unwrap().collect();
    assert_eq!(names.len(), 3, "left behind: {names:?}");
}

#[test]
fn exposure_makes_a_picture_darker() {
    let folder = tempfile::tempdir().unwrap();
    let sum = |exposure: &str| {
        let out = folder.path().join(format!("{exposure}.png"));
        let out = out.to_string_lossy();
        let arguments =
            ["render", "sphere", "--size", "32x24", "--exposure", exposure, "--out", &out];
        frameless(&arguments).succeeded();
        let picture = image::open(out.as_ref()).unwrap().to_rgb8();
        picture.pixels().flat_map(|pixel| pixel.0).map(u64::from).sum::<u64>()
    };
    assert!(sum("-2") < sum("0"));
}

#[test]
fn tone_mapping_keeps_what_would_be_clipped_apart() {
    let folder = tempfile::tempdir().unwrap();
    let white = |tone_map: &[&str]| {
        let out = folder.path().join("picture.png");
        let out = out.to_string_lossy();
        let mut arguments =
            vec!["render", "sphere", "--size", "32x24", "--exposure", "3", "--out", &out];
        arguments.extend(tone_map);
        frameless(&arguments).succeeded();
        let picture = image::open(out.as_ref()).unwrap().to_rgb8();
        picture.pixels().flat_map(|pixel| pixel.0).filter(|&channel| channel == 255).count()
    };
    let clipped = white(&["--tone-map", "none"]);
    assert!(clipped > 100, "{clipped} channels are white");
    for name in ["neutral", "agx", "aces"] {
        assert!(white(&["--tone-map", name]) < clipped / 4, "{name}");
    }
    assert!(white(&[]) < clipped / 4, "tones are mapped unless told otherwise");
}

#[test]
fn a_pixel_is_told_step_by_step() {
    let pixel = ["trace", "sphere", "--pixel", "256,192", "--time", "0.5"];
    let direct = frameless(&pixel).succeeded().out;
    assert!(direct.lines().count() > 3);
    let path = |sample| {
        let chosen = ["--integrator", "path", "--sample", sample];
        frameless(&[&pixel[..], &chosen].concat()).succeeded().out
    };
    assert!(path("0").contains(", path\n") && !direct.contains(", path\n"));
    assert_eq!(path("7"), path("7"));
    assert_ne!(path("7"), path("8"));
}

/// Two scenes, and three animations of which the first and the last move the same node.
const CHOICES: &str = r#"{"asset": {"version": "2.0"},
"scenes": [{"name": "day", "nodes": [0]}, {"name": "night", "nodes": [0, 1]}],
"nodes": [{"name": "a"}, {"name": "b"}],
"animations": [
    {"name": "walk", "channels": [{"sampler": 0, "target": {"node": 0, "path": "translation"}}],
        "samplers": [{"input": 0, "output": 1}]},
    {"name": "nod", "channels": [{"sampler": 0, "target": {"node": 0, "path": "scale"}}],
        "samplers": [{"input": 0, "output": 1}]},
    {"name": "run", "channels": [{"sampler": 0, "target": {"node": 0, "path": "translation"}}],
        "samplers": [{"input": 0, "output": 1}]}],
"accessors": [{"bufferView": 0, "componentType": 5126, "type": "SCALAR", "count": 2},
    {"bufferView": 0, "byteOffset": 8, "componentType": 5126, "type": "VEC3", "count": 2}],
"bufferViews": [{"buffer": 0, "byteLength": 32}],
"buffers": [{"byteLength": 32,
    "uri": "data:application/octet-stream;base64,AAAAAAAAgD8AAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAA="}]}"#;

#[test]
fn scenes_and_animations_of_a_file_are_listed_and_chosen() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("choices.gltf");
    std::fs::write(&file, CHOICES).unwrap();
    let file = file.to_string_lossy();
    let info = |arguments: &[&str]| frameless(&[&["info", &*file], arguments].concat());
    let told = info(&[]).succeeded().out;
    for line in ["0  \"day\", shown", "1  \"night\"\n", "0  \"walk\", played", "1  \"nod\"\n"] {
        assert!(told.contains(line), "no {line} in {told}");
    }
    assert!(told.contains("only animation \"walk\" (/animations/0) is played"), "{told}");
    let told = info(&["--scene", "night", "--animation", "2"]).succeeded().out;
    for line in ["1  \"night\", shown", "2  \"run\", played", "at 4 nodes"] {
        assert!(told.contains(line), "no {line} in {told}");
    }
    assert!(info(&["--animation", "none"]).succeeded().out.contains("motion      none"));
    assert!(info(&["--animation", "all"]).succeeded().out.contains("1 translation, 1 scale"));
    info(&["--scene", "2"]).refused(2, "wanted scene 2");
    info(&["--animation", "swim"]).refused(2, "wanted animation \"swim\"");
    frameless(&["info", "sphere", "--scene", "0"]).refused(2, "no parts");
    frameless(&["info", "sphere", "--animation", "walk"]).refused(2, "no parts");
    let still = frameless(&["info", "sphere", "--animation", "none"]).succeeded().out;
    assert!(still.contains("motion      none"), "{still}");
}

#[test]
fn bench_rays_names_what_others_rely_on() {
    let settings = ["--rounds", "1", "--size", "32x24", "--detail", "0.001"];
    let arguments = [&["bench", "rays", "--json"][..], &settings].concat();
    let run = frameless(&arguments);
    assert_eq!(run.code, Some(0), "{}", run.err);
    let report: serde_json::Value = serde_json::from_str(&run.out).expect("one JSON object");
    let rows = report["rows"].as_array().expect("rows");
    let value = |name: &str| {
        let row = rows.iter().find(|row| row["name"] == name);
        row.unwrap_or_else(|| panic!("no {name} in {}", run.out))["value"]
            .as_f64()
            .expect("a number")
    };
    // Without Embree, which says so; with it there are ratios, too.
    let has_embree = !run.err.contains("Embree 4 was not found");
    let sets = ["primary-scan", "primary-random", "primary-clustered", "primary-sorted", "shadow"];
    let others = ["reflection", "diffuse", "instances-1", "instances-100", "instances-10000"];
    for set in sets.iter().chain(&others) {
        let has = |what: &str| value(&format!("rays.generated.{set}.{what}")) > 0.0;
        assert!(has("mrays_per_sec") && has("single_mrays_per_sec"), "{set}");
        if has_embree {
            assert!(has("ratio_to_embree") && has("single_ratio_to_embree"), "{set}");
        }
    }
}
