//! Pictures in the file: PNG, JPEG or WebP, told apart by their first bytes.
//!
//! A picture that cannot be decoded does not stop the scene: a magenta and grey checker stands in for it, which nobody takes
//! for the real one, and a warning names it. One for which there is no room is kept at half its size, or less ([`super::room`]).

use std::path::Path;

use image::ImageDecoder;

use crate::Image;

use super::buffers::View;
use super::decode::{Decoded, decode, format_of, lenient, work_pixels, working_bytes};
use super::document::Document;
use super::error::{Fault, one_line};
use super::json::Json;
use super::limits::{Budget, PictureSize};
use super::png_chunks::picture;
use super::uri::Uri;

/// Where a picture's bytes are.
#[derive(Debug)]
enum Source<'a> {
    Uri(Uri<'a>),
    /// Index into the buffer views.
    View(usize),
    Missing,
}

/// A picture of the file, not yet read.
#[derive(Debug)]
pub(super) struct FileImage<'a> {
    json: Json<'a>,
    source: Source<'a>,
}

/// What a picture is of: pictures with equal ones are the same.
#[derive(Debug, PartialEq, Eq, Hash)]
pub(super) enum Bytes<'a> {
    /// Address and length.
    There(usize, usize),
    File(&'a Path),
}

impl<'a> FileImage<'a> {
    pub(super) fn parse(json: &Json<'a>, view_count: usize) -> Result<FileImage<'a>, Fault> {
        let source = match (json.field("uri")?, json.field("bufferView")?) {
            (Some(uri), _) => Source::Uri(Uri::parse(&uri)?),
            (None, Some(view)) => Source::View(view.index(view_count, "buffer views")?),
            (None, None) => Source::Missing,
        };
        Ok(FileImage { json: json.clone(), source })
    }

    /// The buffer view that it is in, if it is in one.
    pub(super) fn view(&self) -> Option<usize> {
        match self.source {
            Source::View(view) => Some(view),
            Source::Uri(_) | Source::Missing => None,
        }
    }

    /// What it is of, if that is anything.
    pub(super) fn bytes(&self, views: &[View<'_>]) -> Option<Bytes<'_>> {
        let there = |bytes: &[u8]| Some(Bytes::There(bytes.as_ptr().addr(), bytes.len()));
        match &self.source {
            Source::Missing => None,
            Source::View(view) => there(views[*view].bytes),
            Source::Uri(Uri::Relative(path)) => Some(Bytes::File(path)),
            Source::Uri(Uri::Data(text) | Uri::Plain(text)) => there(text.as_bytes()),
        }
    }

    /// Holds the picture's header against the limits.
    pub(super) fn open(&self, document: &mut Document<'_>) -> Result<Encoded, Fault> {
        let pointer = self.json.pointer();
        let found = match &self.source {
            Source::Missing => return Err(Fault::at(pointer, "a uri or a bufferView", "neither")),
            Source::View(view) => Found::View(*view),
            Source::Uri(uri) => {
                let bytes = uri.read(pointer, document.folder, &mut document.budget)?;
                document.budget.tell(bytes.len() as u64);
                Found::Read(bytes)
            }
        };
        let limits = decoder_limits(&document.budget);
        let bytes = found.get(&document.views);
        document.budget.look_through(pointer, bytes.len())?;
        let picture = picture(bytes);
        if format_of(&picture).is_none() {
            return Err(Fault::at(pointer, "a PNG, JPEG or WebP image", "other bytes"));
        }
        let decoder = lenient(&picture, &limits);
        let decoder = decoder.map_err(|error| Fault::at(pointer, "an image", error))?;
        let ((width, height), decoded_bytes) = (decoder.dimensions(), decoder.total_bytes());
        drop(decoder);
        let working_bytes = working_bytes(&picture, [width, height], decoded_bytes);
        let size = PictureSize {
            pixels: [width, height],
            decoded_bytes,
            working_bytes,
            encoded_bytes: picture.len(),
        };
        document.budget.add_image(pointer, &size)?;
        if width == 0 || height == 0 {
            return Err(Fault::at(pointer, "an image", "no pixels"));
        }
        let work_pixels = work_pixels(&picture, [width, height]);
        drop(picture);
        Ok(Encoded { found, pointer: pointer.to_owned(), limits, working_bytes, work_pixels })
    }

    /// Says what is wrong with the file of a picture that is drawn all the same.
    pub(super) fn warn_of_damage(&self, damage: &str, document: &mut Document<'_>) {
        let what = "images whose files are damaged are drawn as far as they can be read";
        let called = self.json.called("image");
        document.warnings.about(what, format!("{called} ({damage})"));
    }

    /// Says that it is smaller than in the file, and why.
    pub(super) fn warn_of_size(&self, fault: &Fault, document: &mut Document<'_>) {
        let what = format!("images are kept at half their size or less, being {}", fault.problem);
        document.warnings.about(what, self.json.called("image"));
    }

    /// The checker, with a warning that says why.
    pub(super) fn stand_in(&self, fault: &Fault, document: &mut Document<'_>) -> Image {
        let what = "images that cannot be read are replaced by a magenta checker";
        let called = self.json.called("image");
        document.warnings.about(what, format!("{called} ({})", one_line(&fault.problem)));
        checker()
    }
}

/// A picture that may be decoded, in any thread.
#[derive(Debug)]
pub(super) struct Encoded {
    found: Found,
    pointer: String,
    limits: image::Limits,
    /// What is in memory while it is decoded.
    pub(super) working_bytes: u64,
    /// How much there is to do until it is decoded, in pixels of an ordinary one.
    pub(super) work_pixels: u64,
}

#[derive(Debug)]
enum Found {
    /// In the buffer view with this index.
    View(usize),
    /// In a file of its own.
    Read(Vec<u8>),
}

impl Found {
    fn get<'b>(&'b self, views: &[View<'b>]) -> &'b [u8] {
        match self {
            Found::View(view) => views[*view].bytes,
            Found::Read(bytes) => bytes,
        }
    }
}

impl Encoded {
    pub(super) fn decode(&self, views: &[View<'_>]) -> Result<Decoded, Fault> {
        let picture = picture(self.found.get(views));
        let decoded = decode(&picture, &self.limits);
        decoded.map_err(|error| Fault::at(&self.pointer, "an image", error))
    }
}

fn decoder_limits(budget: &Budget) -> image::Limits {
    /// A decoder keeps a picture in up to 16 bits for each of four channels, and some of it twice.
    const DECODER_BYTES_PER_PIXEL: u64 = 16;
    let mut limits = image::Limits::default();
    limits.max_alloc = Some(budget.limits.image_pixels.saturating_mul(DECODER_BYTES_PER_PIXEL));
    limits
}

/// 8 × 8 texels, magenta and grey in turn.
fn checker() -> Image {
    const SIDE: u32 = 8;
    const COLORS: [[u8; 4]; 2] = [[255, 0, 255, 255], [128, 128, 128, 255]];
    let texel = |i: u32| COLORS[((i / SIDE + i % SIDE) % 2) as usize];
    Image { width: SIDE, height: SIDE, rgba: (0..SIDE * SIDE).map(texel).collect() }
}
