//! What of a PNG is its picture.
//!
//! A profile of colours (iCCP) may inflate to gigabytes, and whatever else is in a file besides the picture makes it look as if there were data
//! for many pixels: decoders get the picture alone.

use std::borrow::Cow;
use std::ops::Range;

const SIGNATURE: &[u8] = b"\x89PNG\r\n\x1a\n";
/// What the picture needs, in PNG's own order.
const NEEDED: [&[u8; 4]; 5] = [b"IHDR", b"PLTE", b"tRNS", b"IDAT", b"IEND"];
/// Of a chunk: length, kind and checksum.
const AROUND: usize = 12;

/// The chunks without which there is no picture, up to the first that is cut off; other bytes than a PNG's as they are.
pub(super) fn picture(bytes: &[u8]) -> Cow<'_, [u8]> {
    if !bytes.starts_with(SIGNATURE) {
        return Cow::Borrowed(bytes);
    }
    let needed: Vec<Range<usize>> = Chunks { bytes, at: SIGNATURE.len() }
        .filter(|chunk| NEEDED.iter().any(|kind| bytes[chunk.start + 4..].starts_with(*kind)))
        .collect();
    let length = SIGNATURE.len() + needed.iter().map(ExactSizeIterator::len).sum::<usize>();
    if length == bytes.len() {
        return Cow::Borrowed(bytes);
    }
    let mut picture = Vec::with_capacity(length);
    picture.extend_from_slice(SIGNATURE);
    needed.into_iter().for_each(|chunk| picture.extend_from_slice(&bytes[chunk]));
    Cow::Owned(picture)
}

/// Where the chunks are, to the end of the picture.
struct Chunks<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl Iterator for Chunks<'_> {
    type Item = Range<usize>;

    fn next(&mut self) -> Option<Range<usize>> {
        let header = self.bytes.get(self.at..)?.first_chunk::<8>()?;
        let (length, kind) = header.split_first_chunk::<4>()?;
        let end = self.at.checked_add(u32::from_be_bytes(*length) as usize)?.checked_add(AROUND)?;
        let chunk = self.at..end;
        self.bytes.get(chunk.clone())?;
        self.at = if kind == b"IEND" { self.bytes.len() } else { end };
        Some(chunk)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chunk(kind: &[u8; 4], data: &[u8]) -> Vec<u8> {
        [&(data.len() as u32).to_be_bytes(), kind.as_slice(), data, &[0; 4]].concat()
    }

    #[test]
    fn the_picture_alone_is_left() {
        let [header, data, end] = [(b"IHDR", 13), (b"IDAT", 20), (b"IEND", 0)]
            .map(|(kind, length): (&[u8; 4], usize)| chunk(kind, &vec![7; length]));
        let plain = [SIGNATURE, &header, &data, &end].concat();
        assert!(matches!(picture(&plain), Cow::Borrowed(bytes) if bytes == plain));
        let (profile, text) = (chunk(b"iCCP", &[1; 99]), chunk(b"tEXt", &[2; 99]));
        let more = [SIGNATURE, &header, &profile, &data, &text, &end, &[0; 99]].concat();
        assert_eq!(picture(&more), plain);
        let cut = [SIGNATURE, &header, &profile, &data[..9]].concat();
        assert_eq!(picture(&cut), [SIGNATURE, &header].concat());
        assert_eq!(picture(b"\xff\xd8 no PNG").as_ref(), b"\xff\xd8 no PNG");
    }
}
