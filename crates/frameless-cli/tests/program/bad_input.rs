//! What is refused: one line, the right exit code, and nothing left behind.

use std::path::Path;

use crate::run::{Run, frameless};

/// Render `scene` into `folder` and check that nothing but `expected` lies there afterwards.
fn render_to(folder: &Path, out: &str, scene: &str) -> Run {
    let out = folder.join(out);
    frameless(&["render", scene, "--size", "8x8", "-o", &out.to_string_lossy()])
}

fn files_in(folder: &Path) -> usize {
    std::fs::read_dir(folder).unwrap().count()
}

#[test]
fn unknown_and_missing_arguments() {
    frameless(&["paint"]).refused(2, "paint");
    frameless(&["render", "sphere"]).refused(2, "--out <FILE>");
    frameless(&["info"]).refused(2, "<SCENE>");
    frameless(&["view", "--sampler", "best"]).refused(2, "random, permutation, change");
    frameless(&["view", "--reconstruction", "blur"]).refused(2, "hold, filter or reproject");
    frameless(&["view", "--temporal", "2"]).refused(2, "0 to 1");
    let blind = ["view", "--sampler", "random", "--temporal", "0.5"];
    frameless(&blind).refused(2, "sampler adaptive");
    frameless(&["view", "--size", "0x10"]).refused(2, "--size");
    frameless(&["view", "--rate", "-5"]).refused(2, "-5");
    frameless(&["render", "sphere", "--time", "inf", "-o", "x.png"]).refused(2, "finite");
    frameless(&["trace", "sphere", "--pixel", "1"]).refused(2, "X,Y");
    frameless(&["info", "sphere", "--scene", ""]).refused(2, "wanted a number from 0, or a name");
    let nothing = ["info", "sphere", "--animation", ""];
    frameless(&nothing).refused(2, "wanted a number from 0, a name, all or none");
}

#[test]
fn a_missing_scene_is_named() {
    frameless(&["info", "no-such-file.glb"]).refused(2, "no-such-file.glb");
    frameless(&["info", "spheer"]).refused(2, "sphere");
    frameless(&["info", ""]).refused(2, "no such file");
    frameless(&["view", "no-such-file.glb"]).refused(2, "no-such-file.glb");
    frameless(&["trace", "nothing.gltf", "--pixel", "0,0"]).refused(2, "nothing.gltf");
}

#[test]
fn an_environment_that_is_none_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let text = folder.path().join("text.hdr");
    std::fs::write(&text, "no picture").unwrap();
    let (text, out) = (text.to_string_lossy(), folder.path().join("out.png"));
    let render = ["render", "sphere", "--size", "8x8", "-o", &out.to_string_lossy()];
    let with = |more: &[&str]| frameless(&[&render[..], more].concat());
    with(&["--env", "missing.hdr"]).refused(2, "missing.hdr");
    with(&["--env", &text]).refused(2, "byte 0: wanted a Radiance picture");
    with(&["--env-rotation", "90"]).refused(2, "--env");
    with(&["--env", &text, "--env-strength", "0"]).refused(2, "above zero");
    assert_eq!(files_in(folder.path()), 1);
}

#[test]
fn what_is_no_scene_leaves_no_picture() {
    let folder = tempfile::tempdir().unwrap();
    for (name, content) in [
        ("text.glb", &b"this is not a scene"[..]),
        ("empty.glb", b""),
        ("truncated.glb", b"glTF\x02\0\0\0\xff\0\0\0\x10\0\0\0JSON{}"),
        ("syntax.gltf", b"{\"asset\": {"),
        ("binary.gltf", b"\xff\xfe\x00\x01"),
    ] {
        let scene = folder.path().join(name);
        std::fs::write(&scene, content).unwrap();
        render_to(folder.path(), "out.png", &scene.to_string_lossy()).refused(2, name);
        frameless(&["info", &scene.to_string_lossy()]).refused(2, name);
        std::fs::remove_file(scene).unwrap();
    }
    assert_eq!(files_in(folder.path()), 0);
    let itself = folder.path().to_string_lossy().into_owned();
    frameless(&["info", &itself]).refused(2, &itself);
}

#[test]
fn a_picture_that_cannot_be_written_is_refused_before_it_is_traced() {
    let folder = tempfile::tempdir().unwrap();
    render_to(folder.path(), "no/folder/out.png", "sphere").refused(2, "out.png");
    render_to(folder.path(), "out.tiff", "sphere").refused(2, ".png");
    std::fs::create_dir(folder.path().join("folder.png")).unwrap();
    render_to(folder.path(), "folder.png", "sphere").refused(2, "folder.png");
    assert_eq!(files_in(folder.path()), 1);
}

#[test]
fn pixels_and_cameras_outside_are_refused() {
    let trace = ["trace", "sphere", "--size", "64x48", "--pixel"];
    frameless(&[&trace[..], &["64,0"]].concat()).refused(2, "64×48");
    frameless(&[&trace[..], &["0,48"]].concat()).refused(2, "64×48");
    frameless(&[&trace[..], &["63,47"]].concat()).succeeded();
    let beyond = frameless(&["trace", "sphere", "--pixel", "0,0", "--camera", "999"]);
    beyond.refused(2, "camera 999");
}

#[test]
#[cfg(target_os = "linux")]
fn output_that_nobody_reads_is_no_error() {
    use std::process::{Command, Stdio};
    let mut program = Command::new(env!("CARGO_BIN_EXE_frameless"))
        .args(["info", "sphere"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    drop(program.stdout.take());
    let ended = program.wait_with_output().unwrap();
    assert_eq!(ended.status.code(), Some(0), "{}", String::from_utf8_lossy(&ended.stderr));
}

#[test]
fn an_experiment_with_a_mistake_names_file_and_key_and_leaves_no_folder() {
    let folder = tempfile::tempdir().unwrap();
    let experiment = folder.path().join("mistake.toml");
    let out = folder.path().join("out");
    let (experiment_name, out) = (experiment.to_string_lossy(), out.to_string_lossy());
    let compare = || frameless(&["compare", &experiment_name, "--out", &out]);
    compare().refused(2, "mistake.toml");
    for (toml, word) in [
        ("", "title"),
        ("title = [", "line 1"),
        ("title = 'x'\nsamples_per_sec = [1000]\nspeed = 3\nscenes = []", "speed"),
        ("title = 'x'\nsamples_per_sec = [-1]\n[[scenes]]\nscene = 'sphere'", "samples_per_sec"),
        ("title = 'x'\nsamples_per_sec = [1000]\n[[scenes]]\nscene = 'no.glb'", "no.glb"),
    ] {
        std::fs::write(&experiment, toml).unwrap();
        compare().refused(2, word);
    }
    assert_eq!(files_in(folder.path()), 1);
}
