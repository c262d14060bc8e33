//! Pictures as PNG files that replace none.

use std::fs::OpenOptions;
use std::io::{self, ErrorKind, Write};
use std::path::{Path, PathBuf};

use frameless::Size;
use image::{ExtendedColorType, ImageEncoder};

/// Writes `frameless-SCENE-0001.png`, or the first number that is free, into `folder`. Returns its path.
///
/// `rgba` is sRGB-encoded, row-major from the top.
///
/// # Errors
/// If the picture cannot be encoded or the file not be written; then there is no file.
pub fn save_numbered(
    folder: &Path,
    scene: &str,
    size: Size,
    rgba: &[[u8; 4]],
) -> anyhow::Result<PathBuf> {
    let png = encode(size, rgba)?;
    let scene: String =
        scene.chars().map(|c| if c.is_alphanumeric() || c == '.' { c } else { '-' }).collect();
    for number in 1..=MOST {
        let path = folder.join(format!("frameless-{scene}-{number:04}.png"));
        match write_new(&path, &png) {
            Err(error) if error.kind() == ErrorKind::AlreadyExists => continue,
            Err(error) => anyhow::bail!("cannot write {}: {error}", path.display()),
            Ok(()) => return Ok(path),
        }
    }
    anyhow::bail!("{} already holds {MOST} pictures of {scene}", folder.display())
}

const MOST: u32 = 9999;

/// Writes a PNG to `path`, replacing what is there.
///
/// # Errors
/// If the picture cannot be encoded or the file not be written.
pub fn save(path: &Path, size: Size, rgba: &[[u8; 4]]) -> anyhow::Result<()> {
    let png = encode(size, rgba)?;
    std::fs::write(path, png)
        .map_err(|error| anyhow::anyhow!("cannot write {}: {error}", path.display()))
}

fn encode(size: Size, rgba: &[[u8; 4]]) -> anyhow::Result<Vec<u8>> {
    let mut png = Vec::new();
    image::codecs::png::PngEncoder::new(&mut png).write_image(
        rgba.as_flattened(),
        size.width,
        size.height,
        ExtendedColorType::Rgba8,
    )?;
    Ok(png)
}

fn write_new(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let mut file = OpenOptions::new().write(true).create_new(true).open(path)?;
    let written = file.write_all(bytes);
    if written.is_err() {
        // A full disk: nothing half-written may stay. That it cannot be removed changes nothing in the report.
        std::fs::remove_file(path).ok();
    }
    written
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_are_counted_and_never_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let size = Size::new(2, 1);
        let (red, blue) = ([[255, 0, 0, 255]; 2], [[0, 0, 255, 255]; 2]);
        let first = save_numbered(folder.path(), "a/b c.glb", size, &red).unwrap();
        let second = save_numbered(folder.path(), "a/b c.glb", size, &blue).unwrap();
        assert_eq!(first.file_name().unwrap(), "frameless-a-b-c.glb-0001.png");
        assert_eq!(second.file_name().unwrap(), "frameless-a-b-c.glb-0002.png");
        let read = image::open(first).unwrap().to_rgba8();
        assert_eq!((read.dimensions(), read.into_raw()), ((2, 1), red.as_flattened().to_vec()));
    }

    #[test]
    fn a_folder_that_is_not_there_is_named() {
        let missing = Path::new("/nowhere/at/all");
        let error = save_numbered(missing, "x", Size::new(1, 1), &[[0; 4]]).unwrap_err();
        assert!(error.to_string().contains("/nowhere/at/all"), "{error}");
    }
}
