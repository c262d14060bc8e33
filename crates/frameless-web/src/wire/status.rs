//! What the loop knows of itself; at rest, the heartbeat.

use super::{Fields, VERSION, WireError};

/// A status message.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StatusMessage {
    /// The scene's time moves.
    pub playing: bool,
    /// Once everything sent before is drawn, the canvas is `picture`, bit for bit.
    pub exact: bool,
    /// 0 the picture itself, 1 a heat map, 2 asked for, but the sampler does not know it.
    pub overlay: u8,
    /// Samples per second.
    pub samples_per_sec: f32,
    /// Pictures per second.
    pub pictures_per_sec: f32,
    /// Mean age of the samples shown, in seconds.
    pub mean_age_secs: f32,
    /// Largest age in seconds.
    pub max_age_secs: f32,
    /// Share of pixels of which nothing is known, in [0, 1].
    pub unknown: f32,
    /// Scene time in seconds.
    pub scene_secs: f64,
    /// Bytes sent to this client in the last second.
    pub bytes_per_sec: u32,
    /// Of the picture's size.
    pub generation: u32,
    /// The newest published picture.
    pub picture: u32,
    /// CRC-32 of its pixels, R G B.
    pub crc: u32,
}

const KIND: u8 = 2;
const LENGTH: usize = 48;
const PLAYING: u8 = 1;
const EXACT: u8 = 2;

impl StatusMessage {
    /// As it is sent.
    pub fn to_bytes(&self) -> Vec<u8> {
        let flags = u8::from(self.playing) * PLAYING + u8::from(self.exact) * EXACT;
        let mut bytes = vec![KIND, VERSION, flags, self.overlay];
        for number in [
            self.samples_per_sec,
            self.pictures_per_sec,
            self.mean_age_secs,
            self.max_age_secs,
            self.unknown,
        ] {
            bytes.extend(number.to_le_bytes());
        }
        bytes.extend(self.scene_secs.to_le_bytes());
        for number in [self.bytes_per_sec, self.generation, self.picture, self.crc] {
            bytes.extend(number.to_le_bytes());
        }
        bytes
    }

    /// From what came.
    ///
    /// # Errors
    /// If it is anything else.
    pub fn parse(bytes: &[u8]) -> Result<StatusMessage, WireError> {
        let what = "a status";
        let mut fields = Fields::of(what, bytes, KIND, LENGTH)?;
        if bytes.len() != LENGTH {
            return Err(WireError::Length { what, wanted: LENGTH, came: bytes.len() });
        }
        let flags = fields.u8()?;
        if flags & !(PLAYING | EXACT) != 0 {
            let came = flags.to_string();
            return Err(WireError::Value { what: "flags", wanted: "bits 0 and 1", came });
        }
        Ok(StatusMessage {
            playing: flags & PLAYING != 0,
            exact: flags & EXACT != 0,
            overlay: fields.u8()?,
            samples_per_sec: fields.f32()?,
            pictures_per_sec: fields.f32()?,
            mean_age_secs: fields.f32()?,
            max_age_secs: fields.f32()?,
            unknown: fields.f32()?,
            scene_secs: fields.f64()?,
            bytes_per_sec: fields.u32()?,
            generation: fields.u32()?,
            picture: fields.u32()?,
            crc: fields.u32()?,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const STATUS: StatusMessage = StatusMessage {
        playing: true,
        exact: true,
        overlay: 2,
        samples_per_sec: 1.0,
        pictures_per_sec: 2.0,
        mean_age_secs: 0.5,
        max_age_secs: 4.0,
        unknown: 0.25,
        scene_secs: 1.5,
        bytes_per_sec: 7,
        generation: 8,
        picture: 9,
        crc: 0xcbf4_3926,
    };

    #[rustfmt::skip]
    const GOLDEN: [u8; 48] = [
        2, 1, 3, 2,
        0, 0, 0x80, 0x3f, 0, 0, 0, 0x40, 0, 0, 0, 0x3f, 0, 0, 0x80, 0x40, 0, 0, 0x80, 0x3e,
        0, 0, 0, 0, 0, 0, 0xf8, 0x3f,
        7, 0, 0, 0, 8, 0, 0, 0, 9, 0, 0, 0, 0x26, 0x39, 0xf4, 0xcb,
    ];

    #[test]
    fn golden_bytes() {
        assert_eq!(STATUS.to_bytes(), GOLDEN);
        assert_eq!(StatusMessage::parse(&GOLDEN), Ok(STATUS));
    }

    #[test]
    fn every_truncation_is_refused() {
        for end in 0..GOLDEN.len() {
            assert!(StatusMessage::parse(&GOLDEN[..end]).is_err(), "{end} bytes");
        }
        assert!(StatusMessage::parse(&[&GOLDEN[..], &[0]].concat()).is_err());
    }
}
