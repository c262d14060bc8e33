//! An atlas as bytes. Which codec, and how set: measured in docs/performance.md.

use jpeg_encoder::{ColorType, SamplingFactor};

use super::Atlas;
use crate::wire::Codec;

/// Of JPEG, 1 to 100.
const QUALITY: u8 = 85;

/// The payload of a message. JPEG is for what moves, PNG is exact.
pub(crate) fn encode(codec: Codec, atlas: &Atlas) -> Result<Vec<u8>, EncodeError> {
    match codec {
        Codec::Jpeg => jpeg(atlas, QUALITY, SamplingFactor::R_4_2_0),
        Codec::Png => png(atlas),
        Codec::WebP => Err(EncodeError("WebP is not written here".to_owned())),
    }
}

/// An encoder's refusal: a bug, since atlases have sizes that every format takes.
#[derive(Debug, thiserror::Error)]
#[error("cannot encode tiles: {0}")]
pub(crate) struct EncodeError(String);

fn jpeg(atlas: &Atlas, quality: u8, sampling: SamplingFactor) -> Result<Vec<u8>, EncodeError> {
    let mut bytes = Vec::new();
    let mut encoder = jpeg_encoder::Encoder::new(&mut bytes, quality);
    encoder.set_sampling_factor(sampling);
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
