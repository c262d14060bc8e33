//! A picture of all that is far away: what lights the scene, and what is seen behind it.
//!
//! Latitude and longitude, as Radiance files usually are: the top row looks straight up, the middle column along +x before it is
//! turned, columns run from there towards +z.

use std::cell::Cell;
use std::io::{self, BufRead, Cursor, Read, Seek, SeekFrom};
use std::path::Path;
use std::sync::Arc;

use glam::Vec3;
use image::{DynamicImage, ImageDecoder, ImageFormat, ImageReader};

use crate::gltf::{Limits, LoadError, Place, Problem, check_environment_size};
use crate::{Scene, gltf};

/// Radiance by direction.
#[derive(Clone, Debug, PartialEq)]
pub struct Environment {
    /// File name without folder.
    pub name: String,
    /// Texels per row; at least 1.
    pub width: u32,
    /// Rows; at least 1.
    pub height: u32,
    /// `width · height` texels from the top left: linear RGB radiance, finite and at least 0.
    pub texels: Arc<Vec<[f32; 3]>>,
    /// By how much it is turned about +y, in radians: positive turns what is along +z towards +x.
    pub rotation_rad: f32,
    /// Multiplies the texels; finite and at least 0.
    pub strength: f32,
}

/// Reads a Radiance picture (`.hdr`), which is neither turned nor strengthened.
///
/// # Errors
/// If the file cannot be read, is no such picture, or is larger than `limits` allow.
pub fn load_environment(path: &Path, limits: &Limits) -> Result<Environment, LoadError> {
    let name = path.file_name().map(|name| name.to_string_lossy().into_owned());
    let bytes = gltf::read_whole(path, limits)?;
    let decoded = decode(&bytes, limits);
    let (width, height, texels) = decoded.map_err(|(offset, problem)| LoadError {
        file: path.display().to_string(),
        place: Place::Byte(offset),
        problem,
    })?;
    Ok(Environment {
        name: name.unwrap_or_default(),
        width,
        height,
        texels: Arc::new(texels),
        rotation_rad: 0.0,
        strength: 1.0,
    })
}

/// What is wrong, and how many bytes have been read until that was found.
type Fault = (u64, Problem);

fn decode(bytes: &[u8], limits: &Limits) -> Result<(u32, u32, Vec<[f32; 3]>), Fault> {
    let read = Cell::new(0);
    let unexpected = |came: &dyn std::fmt::Display| {
        let wanted = "a Radiance picture (.hdr)".to_owned();
        (read.get(), Problem::Unexpected { wanted, came: gltf::one_line(came) })
    };
    if ![&b"#?RADIANCE"[..], b"#?RGBE"].iter().any(|begin| bytes.starts_with(begin)) {
        return Err(unexpected(&"other bytes"));
    }
    let counted = Counted { bytes: Cursor::new(bytes), read: &read };
    let mut reader = ImageReader::with_format(counted, ImageFormat::Hdr);
    reader.no_limits();
    let decoder = reader.into_decoder().map_err(|error| unexpected(&error))?;
    let (width, height) = decoder.dimensions();
    check_environment_size(width, height, bytes.len(), limits)
        .map_err(|problem| (read.get(), problem))?;
    if width == 0 || height == 0 {
        return Err(unexpected(&"no pixels"));
    }
    let picture = DynamicImage::from_decoder(decoder).map_err(|error| unexpected(&error))?;
    let sane = |c: f32| if c.is_finite() { c.max(0.0) } else { 0.0 };
    let texels = picture.into_rgb32f().pixels().map(|pixel| pixel.0.map(sane)).collect();
    Ok((width, height, texels))
}

/// Bytes, and how many of them a decoder has taken, which owns this.
struct Counted<'a> {
    bytes: Cursor<&'a [u8]>,
    read: &'a Cell<u64>,
}

impl Read for Counted<'_> {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        let count = self.bytes.read(into)?;
        self.read.set(self.bytes.position());
        Ok(count)
    }
}

impl BufRead for Counted<'_> {
    fn fill_buf(&mut self) -> io::Result<&[u8]> {
        self.bytes.fill_buf()
    }

    fn consume(&mut self, count: usize) {
        self.bytes.consume(count);
        self.read.set(self.bytes.position());
    }
}

impl Seek for Counted<'_> {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.bytes.seek(to)
    }
}

impl Scene {
    /// Lets `environment` light the scene: beside its own lights, but instead of those that stood in for them.
    pub fn light_by(&mut self, environment: Environment) {
        if self.has_added_light {
            self.lights.clear();
            self.ambient = Vec3::ZERO;
            self.has_added_light = false;
            self.notes.retain(|note| !note.starts_with(gltf::NO_LIGHT));
        }
        self.notes.push(format!("lit by the environment {}", environment.name));
        self.environment = Some(environment);
    }
}

impl Environment {
    /// Whether its texels and factors are as promised.
    pub(crate) fn is_sane(&self) -> bool {
        let texels = self.width as usize * self.height as usize;
        let sane = |c: &f32| c.is_finite() && *c >= 0.0;
        texels > 0
            && self.texels.len() == texels
            && self.texels.iter().flatten().all(sane)
            && self.rotation_rad.is_finite()
            && sane(&self.strength)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn header(width: u32, height: u32) -> Vec<u8> {
        let text = format!("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {height} +X {width}\n");
        text.into_bytes()
    }

    /// Two texels of flat RGBE: mantissas 128, 64, 32 by 2^(129 − 136) and black.
    fn hdr(width: u32) -> Vec<u8> {
        [&header(width, 1)[..], &[128, 64, 32, 129, 0, 0, 0, 0]].concat()
    }

    #[test]
    fn radiance_is_read_as_it_is_written() {
        let (width, height, texels) = decode(&hdr(2), &Limits::default()).unwrap();
        assert_eq!((width, height), (2, 1));
        assert_eq!(texels, [[1.0, 0.5, 0.25], [0.0; 3]]);
    }

    #[test]
    fn what_is_no_picture_too_large_or_cut_off_is_refused() {
        let whole = hdr(2);
        let refusal =
            |bytes: &[u8], limits: &Limits| decode(bytes, limits).unwrap_err().1.to_string();
        for length in 0..whole.len() {
            let text = refusal(&whole[..length], &Limits::default());
            assert!(text.contains("wanted a Radiance picture"), "{length}: {text}");
        }
        let huge = hdr(4_000_000_000);
        assert!(refusal(&huge, &Limits::default()).contains("pixels in one image"));
        let small = Limits { decoded_bytes: 8, ..Limits::default() };
        assert!(refusal(&whole, &small).contains("decoded bytes"));
    }

    #[test]
    fn errors_name_the_byte() {
        let mut bytes = header(16, 2);
        let (begin, row) = (bytes.len() as u64, [2, 2, 0, 16, 144, 1, 144, 2, 144, 3, 144, 4]);
        bytes.extend(row);
        bytes.extend([2, 2, 0, 17]);
        assert_eq!(decode(&bytes, &Limits::default()).unwrap_err().0, begin + 12 + 4);
        assert_eq!(decode(b"x", &Limits::default()).unwrap_err().0, 0);
    }

    /// Run-length coding makes 16 pixels of a byte: 49 million of 3 MB.
    #[test]
    fn few_bytes_make_few_pixels() {
        let mut bytes = header(16_384, 3_000);
        let begin = bytes.len();
        let run = |length: u8| [128 + length, 127];
        let row = [&[2, 2, 64, 0][..], &[run(127).repeat(129), run(1).to_vec()].concat().repeat(4)];
        bytes.extend(row.concat().repeat(3_000));
        let (offset, problem) = decode(&bytes, &Limits::default()).unwrap_err();
        assert_eq!(offset, begin as u64);
        let text = problem.to_string();
        assert!(text.contains("pixels in images of few bytes"), "{text}");
        assert!(text.contains("--max-texture-pixels"), "{text}");
        let more = Limits { total_pixels: 64 * 49_152_000, ..Limits::default() };
        assert!(decode(&bytes, &more).is_ok());
    }
}
