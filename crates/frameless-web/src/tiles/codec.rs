//! An atlas as bytes. Which codec, and how set: measured in docs/performance.md.

use jpeg_encoder::{ColorType, QuantizationTableType, SamplingFactor};

use super::Atlas;
use crate::wire::Codec;

/// All frequencies of all channels are rounded to so many steps of JPEG's. Less brings more bytes than it takes from the error.
const STEP: u16 = 15;
/// But the mean of a block, eight of whose steps are one of brightness: tiles without detail are as good as exact.
const MEAN_STEP: u16 = 4;
/// Of no meaning where tables are given.
const QUALITY: u8 = 50;

/// The payload of a message. JPEG is for what moves, PNG is exact.
pub(crate) fn encode(codec: Codec, atlas: &Atlas) -> Result<Vec<u8>, EncodeError> {
    match codec {
        Codec::Jpeg => jpeg(atlas),
        Codec::Png => png(atlas),
    }
}

/// An encoder's refusal: a bug, since atlases have sizes that every format takes.
#[derive(Debug, thiserror::Error)]
#[error("cannot encode tiles: {0}")]
pub(crate) struct EncodeError(String);

/// Colours keep the whole resolution: with half of it, edges between saturated colours are wrong by more than everything else together. The flat
/// table is the one of least squared error for the bytes.
fn jpeg(atlas: &Atlas) -> Result<Vec<u8>, EncodeError> {
    let mut bytes = Vec::new();
    let mut encoder = jpeg_encoder::Encoder::new(&mut bytes, QUALITY);
    encoder.set_sampling_factor(SamplingFactor::R_4_4_4);
    let mut steps = [STEP; 64];
    steps[0] = MEAN_STEP;
    let table = || QuantizationTableType::Custom(Box::new(steps));
    encoder.set_quantization_tables(table(), table());
    encoder.set_optimized_huffman_tables(true);
    encoder
        .encode(&atlas.rgb, atlas.width, atlas.height, ColorType::Rgb)
        .map_err(|error| EncodeError(error.to_string()))?;
    Ok(bytes)
}

fn png(atlas: &Atlas) -> Result<Vec<u8>, EncodeError> {
    let failed = |error: png::EncodingError| EncodeError(error.to_string());
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, atlas.width.into(), atlas.height.into());
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_compression(png::Compression::Fast);
    let mut writer = encoder.write_header().map_err(failed)?;
    writer.write_image_data(&atlas.rgb).map_err(failed)?;
    writer.finish().map_err(failed)?;
    Ok(bytes)
}
