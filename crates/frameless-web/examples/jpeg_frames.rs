//! What pictures weigh as whole JPEG frames of quality 75, by the encoder that the stream's tiles are made with, set as there: the bytes of
//! each of the PNG files that are named, one number per line.

use std::fs::File;
use std::io::BufReader;

use anyhow::{Context, Result, ensure};

/// What most programs that send frames take, and what the comparison in docs/performance.md asks for.
const QUALITY: u8 = 75;

fn main() -> Result<()> {
    for path in std::env::args().skip(1) {
        println!("{}", weigh(&path).with_context(|| format!("cannot weigh {path}"))?);
    }
    Ok(())
}

fn weigh(path: &str) -> Result<usize> {
    let mut reader = png::Decoder::new(BufReader::new(File::open(path)?)).read_info()?;
    let mut rgb = vec![0; reader.output_buffer_size().context("the picture is too large")?];
    let info = reader.next_frame(&mut rgb)?;
    ensure!(info.color_type == png::ColorType::Rgb, "wanted RGB, got {:?}", info.color_type);
    let (width, height) = (u16::try_from(info.width)?, u16::try_from(info.height)?);
    let mut jpeg = Vec::new();
    let mut encoder = jpeg_encoder::Encoder::new(&mut jpeg, QUALITY);
    // As tiles are encoded, too: 2 % less.
    encoder.set_optimized_huffman_tables(true);
    encoder.encode(&rgb[..info.buffer_size()], width, height, jpeg_encoder::ColorType::Rgb)?;
    Ok(jpeg.len())
}
