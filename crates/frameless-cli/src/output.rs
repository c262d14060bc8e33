//! Writing what the user asked for: pictures whole or not at all, text until nobody reads it any more.

use std::io::{Cursor, ErrorKind, Write};
use std::path::Path;

use anyhow::{Context, Result, anyhow};

use crate::failure::Failure;

/// Write to standard output. That the reader has gone (`frameless info x | head -1`) is no error.
pub(crate) fn print(text: &str) -> Result<()> {
    let mut out = std::io::stdout().lock();
    read_or_not(out.write_all(text.as_bytes()).and_then(|()| out.flush()))
}

/// Print the help or the version, in colour on a terminal.
pub(crate) fn print_help(help: &clap::Error) -> Result<()> {
    read_or_not(help.print())
}

fn read_or_not(written: std::io::Result<()>) -> Result<()> {
    match written {
        Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(()),
        result => result.context("cannot write to standard output"),
    }
}

/// `line` with control characters replaced: names come from files, and none of them may end the line or
/// command the terminal.
pub(crate) fn printable(line: &str) -> String {
    line.chars().map(|c| if c.is_control() { char::REPLACEMENT_CHARACTER } else { c }).collect()
}

/// Refuse, before any work is done, a path to which no PNG can be written.
pub(crate) fn check_png_path(path: &Path) -> Result<(), Failure> {
    let shown = path.display();
    let is_png = path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("png"));
    if !is_png {
        return Err(Failure::bad_input(anyhow!("{shown}: wanted a file name that ends in .png")));
    }
    if path.is_dir() {
        return Err(Failure::bad_input(anyhow!("{shown}: is a folder, wanted a file")));
    }
    let folder = folder_of(path);
    if !folder.is_dir() {
        let folder = folder.display();
        return Err(Failure::bad_input(anyhow!("{shown}: there is no folder {folder}")));
    }
    Ok(())
}

/// Write a PNG of row-major RGBA: first beside its place, then renamed, so that no half picture is ever
/// found under its name.
pub(crate) fn write_png(path: &Path, width: u32, height: u32, rgba: Vec<[u8; 4]>) -> Result<()> {
    let cannot = || format!("cannot write {}", path.display());
    let picture = image::RgbaImage::from_raw(width, height, rgba.into_flattened())
        .ok_or_else(|| anyhow!("{width}×{height} is not the number of pixels traced"))?;
    let mut png = Cursor::new(Vec::new());
    picture.write_to(&mut png, image::ImageFormat::Png).with_context(cannot)?;
    let mut builder = tempfile::Builder::new();
    builder.prefix(".frameless-").suffix(".png");
    readable_by_others(&mut builder);
    let mut file = builder.tempfile_in(folder_of(path)).with_context(cannot)?;
    file.write_all(png.get_ref()).with_context(cannot)?;
    file.persist(path).with_context(cannot)?;
    Ok(())
}

/// Temporary files are private by default, which a picture is not: leave that to the user's umask.
fn readable_by_others(builder: &mut tempfile::Builder<'_, '_>) {
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(std::fs::Permissions::from_mode(0o666));
    }
    #[cfg(not(unix))]
    let _ = builder;
}

/// Remove a file if it is there.
pub(crate) fn remove_file(path: &Path) -> Result<()> {
    match std::fs::remove_file(path) {
        Err(error) if error.kind() != ErrorKind::NotFound => {
            Err(error).with_context(|| format!("cannot replace {}", path.display()))
        }
        _ => Ok(()),
    }
}

fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}
