//! Side-by-side videos: H.264 in MP4, which every player and browser opens.

use std::fs::File;
use std::io::BufWriter;
use std::path::{Path, PathBuf};

use image::RgbImage;
use muxide::api::{Muxer, MuxerBuilder, VideoCodec};
use openh264::OpenH264API;
use openh264::encoder::{
    BitRate, Encoder, EncoderConfig, FrameRate, FrameType, IntraFramePeriod, QpRange,
    RateControlMode, UsageType, VuiConfig,
};
use openh264::formats::{RgbSliceU8, YUVBuffer};

use crate::error::EvalError;
use frameless::Size;

// Noise is what these videos are about: it must survive. At 30 the dots of frameless pictures begin to smear.
const WORST_QUANTIZER: u8 = 29;
// A key frame per second, so that players can seek.
const KEY_FRAME_SECS: u32 = 1;
// Far more than needed: quality is limited by the quantizer.
const BITS_PER_SEC: u32 = 60_000_000;

/// A video that is being written, one frame per refresh.
pub(crate) struct Video {
    path: PathBuf,
    display_hz: u32,
    encoder: Encoder,
    muxer: Muxer<BufWriter<File>>,
    frames: u32,
}

impl Video {
    /// Both sides of `size` must be even.
    pub(crate) fn create(path: &Path, size: Size, display_hz: u32) -> Result<Video, EvalError> {
        let begin = || -> Result<Video, Box<dyn std::error::Error>> {
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
            let encoder = Encoder::with_api_config(OpenH264API::from_source(), config)?;
            let muxer = MuxerBuilder::new(BufWriter::new(File::create(path)?))
                .video(VideoCodec::H264, size.width, size.height, f64::from(display_hz))
                .build()?;
            Ok(Video { path: path.to_path_buf(), display_hz, encoder, muxer, frames: 0 })
        };
        begin().map_err(|error| EvalError::unwritable(path, error))
    }

    /// Appends a frame of the video's size.
    pub(crate) fn push(&mut self, image: &RgbImage) -> Result<(), EvalError> {
        self.encode(image).map_err(|error| EvalError::unwritable(&self.path, error))
    }

    fn encode(&mut self, image: &RgbImage) -> Result<(), Box<dyn std::error::Error>> {
        let size = (image.width() as usize, image.height() as usize);
        let source = RgbSliceU8::new(image.as_raw(), size);
        let bits = self.encoder.encode(&YUVBuffer::from_rgb8_source(source))?;
        let is_key_frame = matches!(bits.frame_type(), FrameType::IDR | FrameType::I);
        let secs = f64::from(self.frames) / f64::from(self.display_hz);
        self.muxer.write_video(secs, &bits.to_vec(), is_key_frame)?;
        self.frames += 1;
        Ok(())
    }

    /// Completes the file.
    pub(crate) fn finish(self) -> Result<(), EvalError> {
        let Video { path, muxer, .. } = self;
        muxer.finish().map(drop).map_err(|error| EvalError::unwritable(&path, error))
    }
}
