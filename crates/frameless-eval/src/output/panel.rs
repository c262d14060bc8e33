//! One algorithm's picture in the report, and its error.

use std::path::{Path, PathBuf};

use frameless::Size;
use image::RgbImage;
use image::codecs::jpeg::JpegEncoder;

use super::strip::Rgb8;
use crate::error::EvalError;

/// Errors are shown so many times as large: at 4 an error of 0.25 is as bright as the display goes, and the 0.04 that counts
/// as a change can be seen.
pub(crate) const ERROR_GAIN: u8 = 4;

// A report with a hundred pictures is sent by mail; at 85 the dots of frameless pictures still stand apart.
const JPEG_QUALITY: u8 = 85;

/// The files of a panel: the picture and |picture − ideal| · [`ERROR_GAIN`].
pub(crate) fn panel_files(stem: &Path) -> [PathBuf; 2] {
    let name = |ending: &str| {
        let mut name = stem.as_os_str().to_owned();
        name.push(ending);
        PathBuf::from(name)
    };
    [name(".jpg"), name("-error.jpg")]
}

/// Writes both files.
pub(crate) fn write_panel(
    stem: &Path,
    size: Size,
    picture: &Rgb8,
    ideal: &Rgb8,
) -> Result<(), EvalError> {
    let [picture_path, error_path] = panel_files(stem);
    write_jpeg(&picture_path, size, picture)?;
    write_jpeg(&error_path, size, &error_of(picture, ideal))
}

fn error_of(picture: &Rgb8, ideal: &Rgb8) -> Rgb8 {
    let channel = |a: u8, b: u8| a.abs_diff(b).saturating_mul(ERROR_GAIN);
    let pixel = |(a, b): (&[u8; 3], &[u8; 3])| std::array::from_fn(|k| channel(a[k], b[k]));
    picture.iter().zip(ideal).map(pixel).collect()
}

fn write_jpeg(path: &Path, size: Size, picture: &Rgb8) -> Result<(), EvalError> {
    let image = RgbImage::from_raw(size.width, size.height, picture.as_flattened().to_vec())
        .expect("as many pixels as the size says");
    let mut bytes = Vec::new();
    JpegEncoder::new_with_quality(&mut bytes, JPEG_QUALITY)
        .encode_image(&image)
        .map_err(|e| EvalError::unwritable(path, e))?;
    std::fs::write(path, bytes).map_err(|e| EvalError::unwritable(path, e))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_are_amplified_and_clipped() {
        let picture = vec![[10, 200, 0], [1, 2, 3]];
        let ideal = vec![[20, 100, 0], [1, 2, 3]];
        assert_eq!(error_of(&picture, &ideal), [[40, 255, 0], [0; 3]]);
    }
}
