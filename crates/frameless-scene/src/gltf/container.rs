//! From bytes to JSON text and binary chunk: GLB (glTF 2.0 §4) or plain JSON, told apart by the first four bytes.
//!
//! | bytes | GLB header      | each chunk |
//! |-------|-----------------|------------|
//! | 0–3   | `glTF`          | length     |
//! | 4–7   | version         | type       |
//! | 8–11  | length in total | data …     |

use super::error::Fault;
use super::warnings::Warnings;

const MAGIC: &[u8] = b"glTF";
const HEADER_BYTES: usize = 12;
const CHUNK_HEADER_BYTES: usize = 8;
const JSON_CHUNK: u32 = u32::from_le_bytes(*b"JSON");
const BIN_CHUNK: u32 = u32::from_le_bytes(*b"BIN\0");

/// The parts of a scene file.
#[derive(Debug)]
pub(super) struct Container<'a> {
    pub(super) json: &'a [u8],
    /// Where `json` begins in the file, for error messages.
    pub(super) json_offset: usize,
    /// What the first buffer holds if it has no URI.
    pub(super) bin: Option<&'a [u8]>,
}

impl<'a> Container<'a> {
    pub(super) fn split(bytes: &'a [u8], warnings: &mut Warnings) -> Result<Container<'a>, Fault> {
        if bytes.starts_with(MAGIC) {
            return split_glb(bytes, warnings);
        }
        const BYTE_ORDER_MARK: &[u8] = b"\xEF\xBB\xBF";
        if let Some(json) = bytes.strip_prefix(BYTE_ORDER_MARK) {
            warnings.add("the file begins with a byte order mark, which glTF forbids: skipped");
            return Ok(Container { json, json_offset: BYTE_ORDER_MARK.len(), bin: None });
        }
        match bytes.trim_ascii_start().first() {
            Some(b'{') if bytes.get(1) == Some(&0) => {
                Err(Fault::at_byte(0, "JSON in UTF-8", "text in UTF-16"))
            }
            None | Some(b'{') => Ok(Container { json: bytes, json_offset: 0, bin: None }),
            Some(_) => {
                let wanted = "glTF: a binary file that begins with `glTF`, or JSON in UTF-8";
                Err(Fault::at_byte(0, wanted, said(bytes)))
            }
        }
    }
}

/// What bytes seem to be that are neither.
fn said(bytes: &[u8]) -> &'static str {
    match bytes {
        [0xff, 0xfe, 0, 0, ..] | [0, 0, 0xfe, 0xff, ..] => "text in UTF-32",
        [0xff, 0xfe, ..] | [0xfe, 0xff, ..] | [0, b'{', ..] => "text in UTF-16",
        _ => "other bytes",
    }
}

fn split_glb<'a>(bytes: &'a [u8], warnings: &mut Warnings) -> Result<Container<'a>, Fault> {
    let bytes = checked_length(bytes, warnings)?;
    let first = Chunk::at(bytes, HEADER_BYTES)?;
    if first.kind != JSON_CHUNK {
        return Err(Fault::at_byte(HEADER_BYTES + 4, "a JSON chunk first", first.name()));
    }
    let mut bin = None;
    let mut offset = first.end;
    while offset < bytes.len() {
        let chunk = Chunk::at(bytes, offset)?;
        if chunk.kind == BIN_CHUNK {
            if bin.is_some() {
                return Err(Fault::at_byte(offset, "one binary chunk at most", chunk.name()));
            }
            bin = Some(chunk.data);
        } else {
            warnings.about("GLB chunks that have no place were ignored", chunk.name());
        }
        offset = chunk.end;
    }
    Ok(Container { json: first.data, json_offset: HEADER_BYTES + CHUNK_HEADER_BYTES, bin })
}

/// The bytes that the header declares, which must be there; what comes after them is ignored.
fn checked_length<'a>(bytes: &'a [u8], warnings: &mut Warnings) -> Result<&'a [u8], Fault> {
    let version = u32_at(bytes, 4).ok_or_else(|| Fault::at_byte(4, "a GLB version", "the end"))?;
    if version != 2 {
        return Err(Fault::at_byte(4, "GLB version 2", format!("version {version}")));
    }
    let declared = u32_at(bytes, 8).ok_or_else(|| Fault::at_byte(8, "a GLB length", "the end"))?;
    let declared = declared as usize;
    if declared < HEADER_BYTES + CHUNK_HEADER_BYTES {
        return Err(Fault::at_byte(8, "a length of at least 20 bytes", declared));
    }
    if declared < bytes.len() {
        warnings.add(format!("{} bytes after the end of the GLB ignored", bytes.len() - declared));
    }
    bytes.get(..declared).ok_or_else(|| {
        let wanted = format!("the {declared} bytes that the header declares");
        Fault::at_byte(8, &wanted, format!("{} bytes", bytes.len()))
    })
}

struct Chunk<'a> {
    kind: u32,
    data: &'a [u8],
    end: usize,
    offset: usize,
}

impl<'a> Chunk<'a> {
    fn at(bytes: &'a [u8], offset: usize) -> Result<Chunk<'a>, Fault> {
        let header = u32_at(bytes, offset).zip(u32_at(bytes, offset + 4));
        let Some((length, kind)) = header else {
            return Err(Fault::at_byte(offset, "a chunk header of 8 bytes", "the end of the GLB"));
        };
        let begin = offset + CHUNK_HEADER_BYTES;
        let left = bytes.len() - begin;
        if length as usize > left {
            let came = format!("{left} bytes to the end of the GLB");
            return Err(Fault::at_byte(offset, &format!("a chunk of {length} bytes"), came));
        }
        let end = begin + length as usize;
        Ok(Chunk { kind, data: &bytes[begin..end], end, offset })
    }

    fn name(&self) -> String {
        format!(
            "chunk {:?} at byte {}",
            self.kind.to_le_bytes().escape_ascii().to_string(),
            self.offset
        )
    }
}

fn u32_at(bytes: &[u8], offset: usize) -> Option<u32> {
    let end = offset.checked_add(4)?;
    Some(u32::from_le_bytes(bytes.get(offset..end)?.try_into().ok()?))
}
