//! Side-by-side videos: H.264 in MP4, which every player and browser opens.

use std::fs::File;
use std::io::BufWriter;
use std::path::Path;

use muxide::api::{MuxerBuilder, VideoCodec};
use openh264::OpenH264API;
use openh264::encoder::{
    BitRate, Encoder, EncoderConfig, FrameRate, FrameType, IntraFramePeriod, QpRange,
    RateControlMode, UsageType, VuiConfig,
};
use openh264::formats::{RgbSliceU8, YUVBuffer};

use super::strip::Strip;
use crate::error::EvalError;

// Noise is what these videos are about: it must survive. At 30 the dots of frameless pictures begin to smear.
const WORST_QUANTIZER: u8 = 24;
// A key frame per second, so that players can seek.
const KEY_FRAME_SECS: u32 = 1;
// Far more than needed: quality is limited by the quantizer.
const BITS_PER_SEC: u32 = 60_000_000;

/// Writes one frame per refresh.
pub(crate) fn write_video(
    path: &Path,
    strip: &Strip,
    display_hz: u32,
    refreshes: impl Iterator<Item = Vec<Vec<[u8; 3]>>>,
) -> Result<(), EvalError> {
    encode(path, strip, display_hz, refreshes).map_err(|error| EvalError::unwritable(path, error))
}

fn encode(
    path: &Path,
    strip: &Strip,
    display_hz: u32,
    refreshes: impl Iterator<Item = Vec<Vec<[u8; 3]>>>,
) -> Result<(), Box<dyn std::error::Error>> {
    let size = strip.size();
    let config = EncoderConfig::new()
        .usage_type(UsageType::CameraVideoRealTime)
        .rate_control_mode(RateControlMode::Off)
        .bitrate(BitRate::from_bps(BITS_PER_SEC))
        .max_frame_rate(FrameRate::from_hz(display_hz as f32))
        .qp(QpRange::new(10, WORST_QUANTIZER))
        .skip_frames(false)
        .scene_change_detect(false)
        .intra_frame_period(IntraFramePeriod::from_num_frames(KEY_FRAME_SECS * display_hz))
        .vui(VuiConfig::bt601());
    let mut encoder = Encoder::with_api_config(OpenH264API::from_source(), config)?;
    let file = BufWriter::new(File::create(path)?);
    let mut muxer = MuxerBuilder::new(file)
        .video(VideoCodec::H264, size.width, size.height, f64::from(display_hz))
        .build()?;
    for (k, panels) in refreshes.enumerate() {
        let image = strip.assemble(&panels);
        let source = RgbSliceU8::new(image.as_raw(), (size.width as usize, size.height as usize));
        let bits = encoder.encode(&YUVBuffer::from_rgb8_source(source))?;
        let is_key_frame = matches!(bits.frame_type(), FrameType::IDR | FrameType::I);
        muxer.write_video(k as f64 / f64::from(display_hz), &bits.to_vec(), is_key_frame)?;
    }
    muxer.finish()?;
    Ok(())
}
