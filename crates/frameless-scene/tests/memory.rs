//! How much memory files take that ask for a lot with few bytes. A process of its own: whatever else ran in it would be counted.
#![cfg(all(target_os = "linux", target_env = "gnu"))]

use frameless_scene::{Limits, load_bytes, load_environment};
use serde_json::json;

/// The most that this process has held of the machine's memory, in bytes.
fn most() -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").expect("Linux tells");
    let line = status.lines().find(|line| line.starts_with("VmHWM:")).expect("it is there");
    let kib: f64 =
        line.split_whitespace().nth(1).and_then(|kib| kib.parse().ok()).expect("a number");
    1024.0 * kib
}

/// A sky of so many columns, twice as many as rows, of which every byte but the exponent is another than the one before.
fn sky(width: usize) -> Vec<u8> {
    let mut file =
        format!("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {} +X {width}\n", width / 2).into_bytes();
    file.extend((0..width * width / 2).flat_map(|k| [(k % 251) as u8, (k % 241) as u8, 7, 128]));
    file
}

/// A square picture with a row of noise, another for each `number`.
fn picture(side: u32, number: u32) -> Vec<u8> {
    let mut word = number;
    let mut noise = || {
        word = word.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (word >> 24) as u8
    };
    let mut picture = image::RgbImage::new(side, side);
    picture.rows_mut().next().expect("a row").for_each(|pixel| pixel.0 = [0; 3].map(|_| noise()));
    let mut bytes = std::io::Cursor::new(Vec::new());
    picture.write_to(&mut bytes, image::ImageFormat::Png).expect("it is written");
    bytes.into_inner()
}

fn written(picture: &image::DynamicImage, format: image::ImageFormat) -> Vec<u8> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    picture.write_to(&mut bytes, format).expect("it is written");
    bytes.into_inner()
}

/// A file with these pictures.
fn glb(pictures: &[Vec<u8>]) -> Vec<u8> {
    let (mut views, mut bin) = (Vec::new(), Vec::new());
    for picture in pictures {
        views.push(json!({"buffer": 0, "byteOffset": bin.len(), "byteLength": picture.len()}));
        bin.extend(picture);
    }
    let each = |one: fn(usize) -> serde_json::Value| (0..pictures.len()).map(one).collect();
    let (images, textures, materials): (Vec<_>, Vec<_>, Vec<_>) = (
        each(|k| json!({"bufferView": k})),
        each(|k| json!({"source": k})),
        each(|k| json!({"pbrMetallicRoughness": {"baseColorTexture": {"index": k}}})),
    );
    let document = json!({"asset": {"version": "2.0"}, "buffers": [{"byteLength": bin.len()}],
        "bufferViews": views, "images": images, "textures": textures, "materials": materials});
    let mut text = document.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    bin.resize(bin.len().next_multiple_of(4), 0);
    let mut file = b"glTF".to_vec();
    let length = (28 + text.len() + bin.len()) as u32;
    file.extend([2, length, text.len() as u32].map(u32::to_le_bytes).as_flattened());
    file.extend(b"JSON");
    file.extend(text);
    file.extend((bin.len() as u32).to_le_bytes());
    file.extend(b"BIN\0");
    file.extend(bin);
    file
}

/// A sky takes what is kept of it, four bytes per texel: as floats beside its file, and twice, it took 28. Pictures take what limits say, however
/// many there are: seven bytes for each pixel that may come of nothing (and one for what decoders have of their own), and 32 for each byte of theirs.
///
/// What is counted is held by the process, not by the allocator: of large blocks that were let go glibc's keeps some, more or fewer as threads meet.
#[test]
fn what_asks_for_much_takes_little() {
    const MAPPED: &str = "MALLOC_MMAP_THRESHOLD_";
    if std::env::var_os(MAPPED).is_some() {
        return measure();
    }
    let program = std::env::current_exe().expect("it runs");
    let mut again = std::process::Command::new(program);
    let again = again.args(["--exact", "what_asks_for_much_takes_little"]).env(MAPPED, "1048576");
    let output = again.output().expect("it runs again");
    let said = [output.stdout, output.stderr].concat();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&said));
}

fn measure() {
    let path = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("memory.hdr");
    std::fs::write(&path, sky(3000)).expect("it is written");
    let before = most();
    let environment = load_environment(&path, &Limits::default()).expect("it is read");
    let taken = (most() - before) / environment.texels.count() as f64;
    std::fs::remove_file(&path).expect("it is there");
    assert!(taken < 4.5, "{taken:.1} bytes per texel");
    drop(environment);

    let limits = Limits { total_pixels: 80_000_000, ..Limits::default() };
    let pictures: Vec<_> = (0..12).map(|number| picture(2000, number)).collect();
    let of_pictures: usize = pictures.iter().map(Vec::len).sum();
    let file = glb(&pictures);
    let before = most();
    let scene = load_bytes("pictures", &file, None, &limits).expect("it is read");
    let taken = most() - before;
    assert!(scene.warnings[0].contains("half their size"), "{:?}", scene.warnings);
    assert!(!scene.warnings[0].contains("checker"), "{:?}", scene.warnings);
    let allowed = 8.0 * 10e6 + 32.0 * of_pictures as f64;
    assert!(taken < allowed, "{taken:.3e} bytes, {allowed:.3e} allowed");
    drop(scene);

    // Read where they are kept: beside that, 16 bits of grey took eight bytes for each pixel, and a damaged JPEG seven.
    let grey = image::ImageBuffer::from_fn(3000, 3000, |x, y| image::Luma([(x * 31 + y) as u16]));
    let grey = written(&image::DynamicImage::from(grey), image::ImageFormat::Png);
    let colors = image::RgbImage::from_fn(3000, 3000, |x, y| image::Rgb([x as u8, y as u8, 9]));
    let mut cut = written(&image::DynamicImage::from(colors), image::ImageFormat::Jpeg);
    cut.truncate(cut.len() - 999);
    for picture in [grey, cut] {
        let file = glb(std::slice::from_ref(&picture));
        std::fs::write("/proc/self/clear_refs", "5").expect("Linux begins anew");
        let before = most();
        let scene = load_bytes("picture", &file, None, &Limits::default()).expect("it is read");
        let taken = (most() - before) / 9e6;
        assert_eq!(scene.images[0].width, 3000, "{:?}", scene.warnings);
        assert!(taken < 6.0, "{taken:.1} bytes per pixel");
    }
}
