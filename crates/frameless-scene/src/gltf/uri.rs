//! What a buffer's or image's URI names: bytes inside the document, or a file in the scene file's folder.
//!
//! A scene file comes from strangers, so nothing outside its folder is opened: no absolute path, no `..`, no link that
//! leads out, no scheme but `data:`.

use std::fs::File;
use std::io::Read;
use std::path::{Component, Path, PathBuf};

use base64::Engine;
use base64::alphabet::STANDARD;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};
use percent_encoding::percent_decode_str;

use super::error::{Fault, Place, Problem, quoted};
use super::json::Json;
use super::limits::{Budget, within};

/// A checked URI.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum Uri<'a> {
    /// Base64 text of a `data:` URI.
    Data(&'a str),
    /// Text of a `data:` URI that is bytes as they are, some of them percent-encoded.
    Plain(&'a str),
    /// A path below the scene file's folder.
    Relative(PathBuf),
}

impl<'a> Uri<'a> {
    pub(super) fn parse(json: &Json<'a>) -> Result<Uri<'a>, Fault> {
        let text = json.text()?;
        // Schemes are the same in capitals (RFC 3986 §3.1).
        let scheme = text.get(..5).filter(|scheme| scheme.eq_ignore_ascii_case("data:"));
        if let Some(data) = scheme.map(|scheme| &text[scheme.len()..]) {
            let payload = data.split_once(',');
            let uri = payload.and_then(|(header, payload)| match header.strip_suffix(";base64") {
                Some(media_type) => is_media_type(media_type).then_some(Uri::Data(payload)),
                None => is_media_type(header).then_some(Uri::Plain(payload)),
            });
            return uri.ok_or_else(|| json.fault("data:<media type>;base64,<text>"));
        }
        relative_path(text)
            .map(Uri::Relative)
            .ok_or_else(|| json.fault("a relative path that stays in the file's folder"))
    }

    /// The bytes that the URI names.
    pub(super) fn read(
        &self,
        pointer: &str,
        folder: Option<&Path>,
        budget: &mut Budget,
    ) -> Result<Vec<u8>, Fault> {
        match self {
            Uri::Data(text) => decode_base64(text, pointer, budget),
            Uri::Plain(text) => {
                budget.read(pointer, text.len())?;
                Ok(percent_decode_str(text).collect())
            }
            Uri::Relative(path) => {
                let Some(folder) = folder else {
                    return Err(Fault::at(
                        pointer,
                        "a data: URI, since there is no folder to look in",
                        quoted(&path.to_string_lossy()),
                    ));
                };
                open_inside(folder, path)
                    .map_err(|problem| Fault { place: Place::Pointer(pointer.to_owned()), problem })
                    .and_then(|file| read_file((file, path), pointer, budget))
            }
        }
    }
}

/// `[type/subtype](;attribute=value)*` (RFC 2397 §2).
fn is_media_type(text: &str) -> bool {
    let mut parts = text.split(';');
    let kind = parts.next().unwrap_or_default();
    (kind.is_empty() || kind.contains('/')) && parts.all(|parameter| parameter.contains('='))
}

/// The percent-decoded path, if every step of it leads downwards.
fn relative_path(uri: &str) -> Option<PathBuf> {
    let first_step = uri.split('/').next().unwrap_or_default();
    let decoded = percent_decode_str(uri).decode_utf8().ok()?;
    if first_step.contains(':') || decoded.is_empty() || decoded.contains('\0') {
        return None;
    }
    let path = PathBuf::from(decoded.as_ref());
    let downwards = |step| matches!(step, Component::Normal(_) | Component::CurDir);
    // However it is written, it is the same file.
    let steps = path.components().filter(|step| matches!(step, Component::Normal(_)));
    path.components().all(downwards).then(|| steps.collect())
}

fn decode_base64(text: &str, pointer: &str, budget: &mut Budget) -> Result<Vec<u8>, Fault> {
    /// Exporters disagree whether the text is padded with `=`.
    const LENIENT: GeneralPurpose = GeneralPurpose::new(
        &STANDARD,
        GeneralPurposeConfig::new().with_decode_padding_mode(DecodePaddingMode::Indifferent),
    );
    budget.read(pointer, 3 * (text.len() / 4 + 1))?;
    LENIENT.decode(text).map_err(|error| Fault::at(pointer, "base64 text", error))
}

/// Opens `path` if, after following links, it is a plain file inside `folder`.
fn open_inside(folder: &Path, path: &Path) -> Result<File, Problem> {
    let shown = quoted(&path.to_string_lossy());
    let named = |error: std::io::Error| {
        Problem::Io(std::io::Error::new(error.kind(), format!("{shown}: {error}")))
    };
    let folder = folder.canonicalize().map_err(named)?;
    let path = folder.join(path).canonicalize().map_err(named)?;
    if !path.starts_with(&folder) || !path.is_file() {
        let wanted = "a plain file in the file's folder".to_owned();
        return Err(Problem::Unexpected { wanted, came: shown });
    }
    File::open(&path).map_err(named)
}

/// Reads an open file, refusing one that is too large before its bytes are in memory.
pub(super) fn read_file(
    (file, path): (File, &Path),
    pointer: &str,
    budget: &mut Budget,
) -> Result<Vec<u8>, Fault> {
    let failed =
        |error| Fault { place: Place::Pointer(pointer.to_owned()), problem: Problem::Io(error) };
    let limit = budget.limits.file_bytes;
    let bytes = file.metadata().map_err(failed)?.len();
    within(bytes, limit, "bytes of file", pointer)?;
    budget.add_file(path, bytes as usize);
    budget.read(pointer, bytes as usize)?;
    let mut content = Vec::with_capacity(bytes as usize);
    // The file may grow while it is read: what it was is what counts.
    file.take(bytes).read_to_end(&mut content).map_err(failed)?;
    Ok(content)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_paths_that_lead_downwards_are_taken() {
        for (uri, path) in [
            ("a.bin", Some("a.bin")),
            ("./a/b.bin", Some("a/b.bin")),
            ("Box%20With%20Spaces.bin", Some("Box With Spaces.bin")),
            ("Box With Spaces.bin", Some("Box With Spaces.bin")),
            ("%C3%A4.bin", Some("ä.bin")),
            ("../a.bin", None),
            ("a/../../b.bin", None),
            ("%2e%2e/a.bin", None),
            ("..%2fa.bin", None),
            ("/etc/passwd", None),
            ("%2fetc%2fpasswd", None),
            ("file:///etc/passwd", None),
            ("http://example.com/a.bin", None),
            ("c:a.bin", None),
            ("a%00.bin", None),
            ("%ff.bin", None),
            ("", None),
        ] {
            assert_eq!(relative_path(uri).as_deref(), path.map(Path::new), "{uri:?}");
        }
    }

    #[test]
    fn data_uri_headers() {
        for header in ["", "image/png", "text/plain;charset=utf-8", ";charset=US-ASCII"] {
            assert!(is_media_type(header), "{header}");
        }
        for header in ["base64", "application/octet-stream;", "a/b;base64;"] {
            assert!(!is_media_type(header), "{header}");
        }
    }
}
