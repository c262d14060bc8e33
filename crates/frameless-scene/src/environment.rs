//! A picture of all that is far away: what lights the scene, and what is seen behind it.
//!
//! Latitude and longitude, as Radiance files usually are: the top row looks straight up, the middle column along +x before it is
//! turned, columns run from there towards +z.

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
    let error =
        |problem| LoadError { file: path.display().to_string(), place: Place::Whole, problem };
    let bytes = gltf::read_whole(path, limits)?;
    let (width, height, texels) = decode(&bytes, limits).map_err(error)?;
    Ok(Environment {
        name: name.unwrap_or_default(),
        width,
        height,
        texels: Arc::new(texels),
        rotation_rad: 0.0,
        strength: 1.0,
    })
}

fn decode(bytes: &[u8], limits: &Limits) -> Result<(u32, u32, Vec<[f32; 3]>), Problem> {
    let unexpected = |came: &dyn std::fmt::Display| Problem::Unexpected {
        wanted: "a Radiance picture (.hdr)".to_owned(),
        came: gltf::one_line(came),
    };
    let reader = ImageReader::new(std::io::Cursor::new(bytes)).with_guessed_format();
    let mut reader = reader.map_err(|error| unexpected(&error))?;
    if reader.format() != Some(ImageFormat::Hdr) {
        return Err(unexpected(&"other bytes"));
    }
    reader.no_limits();
    let decoder = reader.into_decoder().map_err(|error| unexpected(&error))?;
    let (width, height) = decoder.dimensions();
    check_environment_size(width, height, limits)?;
    if width == 0 || height == 0 {
        return Err(unexpected(&"no pixels"));
    }
    let picture = DynamicImage::from_decoder(decoder).map_err(|error| unexpected(&error))?;
    let sane = |c: f32| if c.is_finite() { c.max(0.0) } else { 0.0 };
    let texels = picture.into_rgb32f().pixels().map(|pixel| pixel.0.map(sane)).collect();
    Ok((width, height, texels))
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

    /// Two texels of flat RGBE: mantissas 128, 64, 32 by 2^(129 − 136) and black.
    fn hdr(width: u32) -> Vec<u8> {
        let mut bytes = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n".to_vec();
        bytes.extend(format!("-Y 1 +X {width}\n").bytes());
        bytes.extend([128, 64, 32, 129, 0, 0, 0, 0]);
        bytes
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
            |bytes: &[u8], limits: &Limits| decode(bytes, limits).unwrap_err().to_string();
        for length in 0..whole.len() {
            let text = refusal(&whole[..length], &Limits::default());
            assert!(text.contains("wanted a Radiance picture"), "{length}: {text}");
        }
        let huge = hdr(4_000_000_000);
        assert!(refusal(&huge, &Limits::default()).contains("pixels in one image"));
        let small = Limits { decoded_bytes: 8, ..Limits::default() };
        assert!(refusal(&whole, &small).contains("decoded bytes"));
    }
}
