//! The file's binary data: buffers, and the views that cut pieces out of them.

use std::borrow::Cow;
use std::ops::Range;
use std::path::Path;

use super::compressed;
use super::error::Fault;
use super::json::Json;
use super::limits::Budget;
use super::uri::Uri;
use super::warnings::Warnings;

/// A piece of a buffer.
#[derive(Clone, Copy, Debug)]
pub(super) struct View<'a> {
    pub(super) bytes: &'a [u8],
    /// Bytes from element to element; `None`: as many as an element has.
    pub(super) stride: Option<usize>,
    /// Whether these are bytes of the file, and not what was decoded of them.
    pub(super) in_file: bool,
}

/// Reads all buffers; the first may be the GLB's binary chunk `bin`.
pub(super) fn load_buffers<'a>(
    root: &Json<'a>,
    bin: Option<&'a [u8]>,
    folder: Option<&Path>,
    budget: &mut Budget,
    warnings: &mut Warnings,
) -> Result<Vec<Cow<'a, [u8]>>, Fault> {
    let list = root.list("buffers")?;
    let first_uses_bin = match list.first() {
        Some(first) => first.field("uri")?.is_none(),
        None => false,
    };
    if bin.is_some() && !first_uses_bin {
        warnings.add("the binary chunk of the GLB is used by no buffer");
    }
    let mut buffers = Vec::new();
    for (number, json) in list.iter().enumerate() {
        let bin = bin.filter(|_| number == 0);
        buffers.push(load_buffer(json, bin, folder, budget)?);
    }
    Ok(buffers)
}

fn load_buffer<'a>(
    json: &Json<'a>,
    bin: Option<&'a [u8]>,
    folder: Option<&Path>,
    budget: &mut Budget,
) -> Result<Cow<'a, [u8]>, Fault> {
    let length = json.required("byteLength")?;
    let wanted = length.unsigned()?;
    let data: Cow<'a, [u8]> = match json.field("uri")? {
        None if bin.is_none() && compressed::is_fallback(json)? => return Ok(Cow::Borrowed(&[])),
        Some(uri) => Uri::parse(&uri)?.read(uri.pointer(), folder, budget)?.into(),
        None => bin.map(Cow::Borrowed).ok_or_else(|| {
            json.fault("a uri, or the binary chunk of a GLB for the first buffer")
        })?,
    };
    if data.len() < wanted {
        let came = format!("{} bytes", data.len());
        return Err(Fault::at(length.pointer(), format!("{wanted} bytes of data"), came));
    }
    Ok(cut(data, wanted))
}

fn cut(data: Cow<'_, [u8]>, length: usize) -> Cow<'_, [u8]> {
    match data {
        Cow::Borrowed(bytes) => Cow::Borrowed(&bytes[..length]),
        Cow::Owned(mut bytes) => {
            bytes.truncate(length);
            Cow::Owned(bytes)
        }
    }
}

/// All buffer views, each within its buffer, or as it was `decoded`.
pub(super) fn parse_views<'b>(
    root: &Json<'_>,
    buffers: &'b [Cow<'_, [u8]>],
    decoded: &'b [Option<Vec<u8>>],
) -> Result<Vec<View<'b>>, Fault> {
    let views = root.list("bufferViews")?;
    let views = views.iter().zip(decoded);
    views.map(|(json, decoded)| parse_view(json, buffers, decoded.as_deref())).collect()
}

/// A view of a buffer, or of what has been decoded in its place.
fn parse_view<'b>(
    json: &Json<'_>,
    buffers: &'b [Cow<'_, [u8]>],
    decoded: Option<&'b [u8]>,
) -> Result<View<'b>, Fault> {
    /// glTF 2.0 §5.11.4.
    const LARGEST_STRIDE: usize = 252;
    let buffer = &buffers[json.required("buffer")?.index(buffers.len(), "buffers")?];
    let offset = json.unsigned_or("byteOffset", 0)?;
    let length = json.required("byteLength")?;
    let (buffer, offset) = match decoded {
        Some(decoded) => (decoded, 0),
        None => (&buffer[..], offset),
    };
    let bytes = slice(buffer, offset, length.unsigned()?).ok_or_else(|| {
        length.fault(format!(
            "a view within its buffer of {} bytes, from byte {offset}",
            buffer.len()
        ))
    })?;
    let stride = match json.field("byteStride")? {
        None => None,
        Some(stride) => match stride.unsigned()? {
            bytes @ 1..=LARGEST_STRIDE => Some(bytes),
            _ => return Err(stride.fault("a stride from 1 to 252 bytes")),
        },
    };
    Ok(View { bytes, stride, in_file: decoded.is_none() })
}

/// How many bytes these are, those once that are in several of them.
pub(super) fn distinct_bytes<'b>(pieces: impl Iterator<Item = &'b [u8]>) -> u64 {
    let mut ranges: Vec<Range<usize>> = pieces
        .map(|piece| piece.as_ptr_range())
        .map(|range| range.start.addr()..range.end.addr())
        .collect();
    ranges.sort_unstable_by_key(|range| range.start);
    let mut up_to = 0;
    let counted = ranges.into_iter().map(|range| {
        let new = range.end.saturating_sub(range.start.max(up_to));
        up_to = up_to.max(range.end);
        new as u64
    });
    counted.sum()
}

/// `bytes[offset..offset + length]`, if that exists.
pub(super) fn slice(bytes: &[u8], offset: usize, length: usize) -> Option<&[u8]> {
    bytes.get(offset..offset.checked_add(length)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_of_several_pieces_count_once() {
        let bytes = [0; 100];
        let count = |pieces: &[Range<usize>]| {
            distinct_bytes(pieces.iter().map(|piece| &bytes[piece.clone()]))
        };
        assert_eq!(count(&[]), 0);
        assert_eq!(count(&[0..100, 0..100]), 100);
        assert_eq!(count(&[50..60, 0..10, 5..20]), 30);
        assert_eq!(count(&[0..100, 10..20, 30..40, 90..100]), 100);
        assert_eq!(count(&[10..10, 20..30]), 10);
    }
}
