//! EXT_meshopt_compression: buffer views that have to be decoded before anything can be read from them.
//! <https://github.com/KhronosGroup/glTF/tree/main/extensions/2.0/Vendor/EXT_meshopt_compression>
//!
//! The decoder is meshoptimizer's own, made for input from strangers; what it asserts of its arguments is checked here.

use std::borrow::Cow;

use super::buffers::{distinct_bytes, slice};
use super::error::{Fault, one_line};
use super::json::Json;
use super::limits::Budget;

/// The extension's name.
pub(super) const NAME: &str = "EXT_meshopt_compression";

/// Whether a buffer is there only for readers without the extension, so that its bytes may be missing.
pub(super) fn is_fallback(buffer: &Json<'_>) -> Result<bool, Fault> {
    buffer.extension(NAME)?.map_or(Ok(false), |extension| extension.flag("fallback"))
}

/// Per buffer view: its bytes, if they are compressed.
pub(super) fn decode_views<'a>(
    root: &Json<'a>,
    buffers: &[Cow<'_, [u8]>],
    budget: &mut Budget,
) -> Result<Vec<Option<Vec<u8>>>, Fault> {
    let parse = |view: &Json<'a>| match view.extension(NAME)? {
        Some(json) => Compressed::parse(&json, buffers).map(|compressed| Some((json, compressed))),
        None => Ok(None),
    };
    let views = root.list("bufferViews")?;
    let views = views.iter().map(parse).collect::<Result<Vec<_>, Fault>>()?;
    budget.tell(distinct_bytes(views.iter().flatten().map(|(_, compressed)| compressed.bytes)));
    let decode = |view: Option<(Json<'_>, Compressed<'_>)>| {
        view.map(|(json, compressed)| compressed.decode(&json, budget)).transpose()
    };
    views.into_iter().map(decode).collect()
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Mode {
    Attributes,
    Triangles,
    Indices,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Filter {
    None,
    Octahedral,
    Quaternion,
    Exponential,
}

/// `count` elements of `stride` bytes each, encoded; what the decoder wants of these numbers holds.
struct Compressed<'a> {
    bytes: &'a [u8],
    stride: usize,
    count: usize,
    mode: Mode,
    filter: Filter,
}

impl<'a> Compressed<'a> {
    fn parse(json: &Json<'_>, buffers: &'a [Cow<'_, [u8]>]) -> Result<Compressed<'a>, Fault> {
        let buffer = &buffers[json.required("buffer")?.index(buffers.len(), "buffers")?];
        let length = json.required("byteLength")?;
        let offset = json.unsigned_or("byteOffset", 0)?;
        let bytes = slice(buffer, offset, length.unsigned()?).ok_or_else(|| {
            length.fault(format!("bytes within the buffer's {}, from {offset}", buffer.len()))
        })?;
        let mode_json = json.required("mode")?;
        let mode = match mode_json.text()? {
            "ATTRIBUTES" => Mode::Attributes,
            "TRIANGLES" => Mode::Triangles,
            "INDICES" => Mode::Indices,
            _ => return Err(mode_json.fault("ATTRIBUTES, TRIANGLES or INDICES")),
        };
        let filter_json = json.field("filter")?;
        let filter = match filter_json.as_ref().map(Json::text).transpose()? {
            None | Some("NONE") => Filter::None,
            Some("OCTAHEDRAL") => Filter::Octahedral,
            Some("QUATERNION") => Filter::Quaternion,
            Some("EXPONENTIAL") => Filter::Exponential,
            Some(_) => {
                let wanted = "NONE, OCTAHEDRAL, QUATERNION or EXPONENTIAL";
                return Err(json.required("filter")?.fault(wanted));
            }
        };
        let stride_json = json.required("byteStride")?;
        let stride = stride_json.unsigned()?;
        let fits = match (mode, filter) {
            (Mode::Attributes, Filter::None | Filter::Exponential) => {
                stride % 4 == 0 && (4..=256).contains(&stride)
            }
            (Mode::Attributes, Filter::Octahedral) => stride == 4 || stride == 8,
            (Mode::Attributes, Filter::Quaternion) => stride == 8,
            (Mode::Triangles | Mode::Indices, Filter::None) => stride == 2 || stride == 4,
            (Mode::Triangles | Mode::Indices, _) => false,
        };
        if !fits {
            return Err(
                stride_json.fault(format!("a stride that {mode:?} with {filter:?} can have"))
            );
        }
        let count_json = json.required("count")?;
        let count = count_json.unsigned()?;
        if mode == Mode::Triangles && count % 3 != 0 {
            return Err(count_json.fault("three indices per triangle"));
        }
        Ok(Compressed { bytes, stride, count, mode, filter })
    }

    fn decode(&self, json: &Json<'_>, budget: &mut Budget) -> Result<Vec<u8>, Fault> {
        budget.allocate(json.pointer(), self.count, self.stride)?;
        // As bytes, in this machine's order, where the decoder lets us: a copy would be the largest thing in memory.
        let (bytes, count) = (self.bytes, self.count);
        let decoded = match (self.mode, self.stride) {
            (Mode::Attributes, _) => self.attributes(),
            (Mode::Triangles, 2) => {
                meshopt::decode_index_buffer::<[u8; 2]>(bytes, count).map(little_endian)
            }
            (Mode::Triangles, _) => {
                meshopt::decode_index_buffer::<[u8; 4]>(bytes, count).map(little_endian)
            }
            (Mode::Indices, 2) => meshopt::decode_index_sequence::<u16>(bytes, count)
                .map(|indices| indices.into_iter().flat_map(u16::to_le_bytes).collect()),
            (Mode::Indices, _) => meshopt::decode_index_sequence::<u32>(bytes, count)
                .map(|indices| indices.into_iter().flat_map(u32::to_le_bytes).collect()),
        };
        let mut bytes = decoded.map_err(|error| {
            Fault::at(json.pointer(), "data that meshoptimizer can decode", said(&error))
        })?;
        self.unfilter(&mut bytes);
        Ok(bytes)
    }

    fn attributes(&self) -> meshopt::Result<Vec<u8>> {
        macro_rules! of_words {
            ($($words:literal)*) => {
                match self.stride / 4 {
                    $($words => meshopt::decode_vertex_buffer::<Element<$words>>(self.bytes, self.count)
                        .map(flat),)*
                    words => unreachable!("{words} words: see `parse`"),
                }
            };
        }
        of_words!(1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16 17 18 19 20 21 22 23 24 25 26 27 28 29 30 31 32
            33 34 35 36 37 38 39 40 41 42 43 44 45 46 47 48 49 50 51 52 53 54 55 56 57 58 59 60 61 62 63 64)
    }

    fn unfilter(&self, bytes: &mut [u8]) {
        match (self.filter, self.stride) {
            (Filter::None, _) => {}
            (Filter::Octahedral, 4) => {
                each(
                    bytes,
                    |four| four.map(|b| b as i8),
                    meshopt::decode_filter_oct,
                    |four| four.map(|i| i as u8),
                );
            }
            (Filter::Octahedral, _) => {
                each(bytes, shorts, meshopt::decode_filter_oct, bytes_of_shorts);
            }
            (Filter::Quaternion, _) => {
                each(bytes, shorts, meshopt::decode_filter_quat, bytes_of_shorts);
            }
            (Filter::Exponential, _) => {
                let word = |bytes: [u8; 4]| [u32::from_le_bytes(bytes)];
                each(bytes, word, meshopt::decode_filter_exp, |[word]| word.to_le_bytes());
            }
        }
    }
}

/// What its decoder's numbers mean.
fn said(error: &meshopt::Error) -> String {
    let text = match error {
        meshopt::Error::Native(-1) => "bytes that begin otherwise, or a newer version",
        meshopt::Error::Native(-2) => "data that ends too early, or is damaged",
        meshopt::Error::Native(-3) => "more data than there are elements, or damaged data",
        _ => return one_line(error),
    };
    text.to_owned()
}

/// Runs a filter over all elements of `N` bytes, which it sees as numbers.
fn each<T, const N: usize>(
    bytes: &mut [u8],
    read: impl Fn([u8; N]) -> T,
    filter: impl Fn(&mut [T]),
    write: impl Fn(T) -> [u8; N],
) {
    let (elements, _) = bytes.as_chunks_mut::<N>();
    let mut numbers: Vec<T> = elements.iter().map(|element| read(*element)).collect();
    filter(&mut numbers);
    for (element, number) in elements.iter_mut().zip(numbers) {
        *element = write(number);
    }
}

fn shorts(b: [u8; 8]) -> [i16; 4] {
    std::array::from_fn(|k| i16::from_le_bytes([b[2 * k], b[2 * k + 1]]))
}

fn bytes_of_shorts(shorts: [i16; 4]) -> [u8; 8] {
    let pairs = shorts.map(i16::to_le_bytes);
    std::array::from_fn(|k| pairs[k / 2][k % 2])
}

/// An element of `N` words, as the decoder wants its type.
#[derive(Clone, Copy)]
struct Element<const N: usize>([[u8; 4]; N]);

impl<const N: usize> Default for Element<N> {
    fn default() -> Self {
        Element([[0; 4]; N])
    }
}

/// Their bytes, where they lie.
fn flat<const N: usize>(elements: Vec<Element<N>>) -> Vec<u8> {
    let words: Vec<[[u8; 4]; N]> = elements.into_iter().map(|element| element.0).collect();
    words.into_flattened().into_flattened()
}

/// The bytes of numbers that are in this machine's order, as glTF has them.
fn little_endian<const N: usize>(mut numbers: Vec<[u8; N]>) -> Vec<u8> {
    if cfg!(target_endian = "big") {
        numbers.iter_mut().for_each(|number| number.reverse());
    }
    numbers.into_flattened()
}
