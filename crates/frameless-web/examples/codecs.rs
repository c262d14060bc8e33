//! Which codec for tiles? Bytes, error and time of each, on the tiles that change in pictures of moving scenes, and on all tiles of one at rest.
//!
//! ```sh
//! cargo run --release -p frameless-web --example codecs             # a table in Markdown
//! cargo run --release -p frameless-web --example codecs -- FOLDER   # the atlases as PNG, for codecs that are not here
//! ```

use std::path::Path;
use std::sync::Arc;

use anyhow::{Context, Result, ensure};
use frameless::{Clock, Size, Time};
use frameless_scene::builtin;
use frameless_session::{Command, Session, Settings};
use frameless_trace::{CpuTracer, ViewSource, World};
use image::codecs::webp::WebPEncoder;
use image::{ExtendedColorType, RgbImage};
use jpeg_encoder::{ColorType, QuantizationTableType, SamplingFactor};

const SIZE: Size = Size { width: 512, height: 384 };
const SAMPLES_PER_SEC: f64 = 900_000.0;
const PICTURES: u32 = 60;
/// As the server has it: a mean squared difference, Σ over the channels.
const WORTH_SENDING: f64 = 80.0;
const COLUMNS: usize = 32;

/// Tiles of a picture in one image.
struct Atlas {
    image: RgbImage,
    tiles: usize,
}

/// Atlases of one kind.
struct Case {
    name: &'static str,
    atlases: Vec<Atlas>,
}

fn main() -> Result<()> {
    let mut cases = Vec::new();
    for (scene, side) in [("sphere", 16), ("sphere", 32), ("sphere", 64), ("orbit", 16)] {
        cases.push(moving(scene, side)?);
    }
    cases.push(at_rest("sphere")?);
    cases.push(at_rest("orbit")?);
    if let Some(folder) = std::env::args_os().nth(1) {
        return save(Path::new(&folder), &cases);
    }
    for case in &cases {
        print(case)?;
    }
    Ok(())
}

fn session(scene: &str) -> Result<Session<CpuTracer>> {
    let scene = Arc::new(builtin(scene).context("a built-in scene")?);
    let world = Arc::new(World::new(scene));
    let tracing = frameless_trace::Settings::default();
    let tracer = CpuTracer::new(world, ViewSource::Camera(0), tracing, 0);
    Ok(Session::new(SIZE, Clock::simulated(SAMPLES_PER_SEC), Settings::default(), 1, tracer))
}

fn run_until(session: &mut Session<CpuTracer>, secs: f64) -> Result<()> {
    while session.now() < Time::from_secs(secs) {
        session.step()?;
    }
    Ok(())
}

/// What changes from each of 60 pictures a second to the next, after the first half second.
fn moving(scene: &'static str, side: usize) -> Result<Case> {
    let mut session = session(scene)?;
    let (mut atlases, mut before) = (Vec::new(), None);
    for picture in 30..30 + PICTURES {
        run_until(&mut session, f64::from(picture) / 60.0)?;
        let rgba = session.picture(Vec::new()).rgba;
        if let Some(before) = before.replace(rgba.clone()) {
            let changed = |tile: &usize| difference(&before, &rgba, side, *tile) >= WORTH_SENDING;
            let tiles: Vec<usize> = (0..tile_count(side)).filter(changed).collect();
            if !tiles.is_empty() {
                atlases.push(atlas(&rgba, side, &tiles));
            }
        }
    }
    let name = match (scene, side) {
        ("sphere", 16) => "`sphere` moves, tiles of 16",
        ("sphere", 32) => "`sphere` moves, tiles of 32",
        ("sphere", 64) => "`sphere` moves, tiles of 64",
        _ => "`orbit` moves (the camera), tiles of 16",
    };
    Ok(Case { name, atlases })
}

/// All tiles of 16, five seconds after everything has stopped.
fn at_rest(scene: &'static str) -> Result<Case> {
    let mut session = session(scene)?;
    for picture in 1..=360 {
        run_until(&mut session, f64::from(picture) / 60.0)?;
        session.picture(Vec::new());
        if picture == 60 {
            session.apply(Command::Play(false));
        }
    }
    let rgba = session.picture(Vec::new()).rgba;
    let tiles: Vec<usize> = (0..tile_count(16)).collect();
    let name = if scene == "sphere" { "`sphere` at rest" } else { "`orbit` at rest" };
    Ok(Case { name, atlases: vec![atlas(&rgba, 16, &tiles)] })
}

fn tile_count(side: usize) -> usize {
    (SIZE.width as usize / side) * (SIZE.height as usize / side)
}

fn pixels(side: usize, tile: usize) -> impl Iterator<Item = (usize, usize, usize)> {
    let across = SIZE.width as usize / side;
    let (x, y) = (tile % across * side, tile / across * side);
    (0..side * side).map(move |i| {
        let (dx, dy) = (i % side, i / side);
        (dx, dy, (y + dy) * SIZE.width as usize + x + dx)
    })
}

fn difference(before: &[[u8; 4]], after: &[[u8; 4]], side: usize, tile: usize) -> f64 {
    let sum: u32 = pixels(side, tile)
        .flat_map(|(.., at)| before[at].iter().zip(&after[at]))
        .map(|(a, b)| u32::from(a.abs_diff(*b)).pow(2))
        .sum();
    f64::from(sum) / (side * side) as f64
}

fn atlas(rgba: &[[u8; 4]], side: usize, tiles: &[usize]) -> Atlas {
    let columns = tiles.len().min(COLUMNS);
    let rows = tiles.len().div_ceil(columns);
    let mut image = RgbImage::new((columns * side) as u32, (rows * side) as u32);
    for (k, &tile) in tiles.iter().enumerate() {
        let (x, y) = (k % columns * side, k / columns * side);
        for (dx, dy, at) in pixels(side, tile) {
            let [r, g, b, _] = rgba[at];
            image.put_pixel((x + dx) as u32, (y + dy) as u32, image::Rgb([r, g, b]));
        }
    }
    Atlas { image, tiles: tiles.len() }
}

type Encode = Box<dyn Fn(&RgbImage) -> Result<Vec<u8>>>;

fn codecs() -> Vec<(String, bool, Encode)> {
    let mut codecs: Vec<(String, bool, Encode)> = Vec::new();
    for quality in [50, 66, 80] {
        let encode = move |image: &RgbImage| jpeg_flat(image, quality);
        codecs.push((format!("JPEG {quality}, flat table, 4:4:4"), true, Box::new(encode)));
    }
    for quality in [75, 85, 90, 95] {
        for (sampling, factor) in
            [("4:2:0", SamplingFactor::R_4_2_0), ("4:4:4", SamplingFactor::R_4_4_4)]
        {
            let encode = move |image: &RgbImage| jpeg(image, quality, factor);
            codecs.push((format!("JPEG {quality}, {sampling}"), true, Box::new(encode)));
        }
    }
    codecs.push(("PNG, fast".into(), false, Box::new(|image| png(image, png::Compression::Fast))));
    codecs.push((
        "PNG, balanced".into(),
        false,
        Box::new(|image| png(image, png::Compression::Balanced)),
    ));
    codecs.push(("WebP, lossless".into(), false, Box::new(webp)));
    codecs.push((
        "QOI".into(),
        false,
        Box::new(|image| Ok(qoi::encode_to_vec(image.as_raw(), image.width(), image.height())?)),
    ));
    codecs.push((
        "raw, LZ4".into(),
        false,
        Box::new(|image| Ok(lz4_flex::compress(image.as_raw()))),
    ));
    codecs.push((
        "difference to the left, LZ4".into(),
        false,
        Box::new(|image| Ok(lz4_flex::compress(&left(image)))),
    ));
    codecs.push(("raw, deflate 1".into(), false, Box::new(|image| deflate(image.as_raw()))));
    codecs.push((
        "difference to the left, deflate 1".into(),
        false,
        Box::new(|image| deflate(&left(image))),
    ));
    codecs
}

fn jpeg(image: &RgbImage, quality: u8, factor: SamplingFactor) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    let mut encoder = jpeg_encoder::Encoder::new(&mut bytes, quality);
    encoder.set_sampling_factor(factor);
    encoder.encode(image.as_raw(), image.width() as u16, image.height() as u16, ColorType::Rgb)?;
    Ok(bytes)
}

/// Equal steps for all frequencies, nearly as the server has them (it gives a block's mean finer ones).
fn jpeg_flat(image: &RgbImage, quality: u8) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    let mut encoder = jpeg_encoder::Encoder::new(&mut bytes, quality);
    encoder.set_sampling_factor(SamplingFactor::R_4_4_4);
    encoder.set_quantization_tables(QuantizationTableType::Flat, QuantizationTableType::Flat);
    encoder.set_optimized_huffman_tables(true);
    encoder.encode(image.as_raw(), image.width() as u16, image.height() as u16, ColorType::Rgb)?;
    Ok(bytes)
}

fn png(image: &RgbImage, compression: png::Compression) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, image.width(), image.height());
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_compression(compression);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(image.as_raw())?;
    writer.finish()?;
    Ok(bytes)
}

fn webp(image: &RgbImage) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    let encoder = WebPEncoder::new_lossless(&mut bytes);
    encoder.encode(image.as_raw(), image.width(), image.height(), ExtendedColorType::Rgb8)?;
    Ok(bytes)
}

fn left(image: &RgbImage) -> Vec<u8> {
    let bytes = image.as_raw();
    (0..bytes.len()).map(|i| bytes[i].wrapping_sub(if i >= 3 { bytes[i - 3] } else { 0 })).collect()
}

fn deflate(bytes: &[u8]) -> Result<Vec<u8>> {
    use std::io::Write;
    let mut encoder = flate2::write::DeflateEncoder::new(Vec::new(), flate2::Compression::new(1));
    encoder.write_all(bytes)?;
    Ok(encoder.finish()?)
}

fn print(case: &Case) -> Result<()> {
    let tiles: usize = case.atlases.iter().map(|atlas| atlas.tiles).sum();
    let messages = case.atlases.len().max(1);
    println!("\n{}: {} tiles in {messages} messages\n", case.name, tiles);
    println!("| codec | bytes per message | bits per pixel | PSNR, dB | encoding, ns per pixel |");
    println!("|---|---|---|---|---|");
    for (name, is_lossy, encode) in codecs() {
        let (mut bytes, mut squares, mut count) = (0, 0u64, 0u64);
        let mut rounds = Vec::new();
        for round in 0..3 {
            let begin = std::time::Instant::now();
            for atlas in &case.atlases {
                let encoded = encode(&atlas.image)?;
                if round == 0 {
                    bytes += encoded.len();
                }
            }
            rounds.push(begin.elapsed().as_secs_f64());
        }
        if is_lossy {
            for atlas in &case.atlases {
                let decoded = image::load_from_memory(&encode(&atlas.image)?)?.to_rgb8();
                ensure!(decoded.dimensions() == atlas.image.dimensions(), "another size");
                let pairs = decoded.as_raw().iter().zip(atlas.image.as_raw());
                squares += pairs.map(|(a, b)| u64::from(a.abs_diff(*b)).pow(2)).sum::<u64>();
                count += decoded.as_raw().len() as u64;
            }
        }
        let pixels: usize = case.atlases.iter().map(|atlas| atlas.image.as_raw().len() / 3).sum();
        let psnr = match is_lossy {
            true => {
                format!("{:.1}", 10.0 * (255.0f64.powi(2) * count as f64 / squares as f64).log10())
            }
            false => "exact".to_owned(),
        };
        rounds.sort_by(f64::total_cmp);
        println!(
            "| {name} | {} | {:.2} | {psnr} | {:.1} |",
            bytes / messages,
            8.0 * bytes as f64 / pixels as f64,
            1e9 * rounds[0] / pixels as f64
        );
    }
    Ok(())
}

fn save(folder: &Path, cases: &[Case]) -> Result<()> {
    for (number, case) in cases.iter().enumerate() {
        for (at, atlas) in case.atlases.iter().enumerate() {
            atlas.image.save(folder.join(format!("{number}-{at:03}.png")))?;
        }
    }
    Ok(())
}
