//! Pictures in the file: PNG, JPEG or WebP, told apart by their first bytes.
//!
//! A picture that cannot be decoded does not stop the scene: a magenta and grey checker stands in for it, which nobody takes
//! for the real one, and a warning names it.

use std::io::Cursor;

use image::{DynamicImage, ImageDecoder, ImageFormat, ImageReader};

use crate::Image;

use super::buffers::View;
use super::document::Document;
use super::error::{Fault, one_line};
use super::json::Json;
use super::limits::{Budget, PictureBytes};
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

impl<'a> FileImage<'a> {
    pub(super) fn parse(json: &Json<'a>, view_count: usize) -> Result<FileImage<'a>, Fault> {
        let source = match (json.field("uri")?, json.field("bufferView")?) {
            (Some(uri), _) => Source::Uri(Uri::parse(&uri)?),
            (None, Some(view)) => Source::View(view.index(view_count, "buffer views")?),
            (None, None) => Source::Missing,
        };
        Ok(FileImage { json: json.clone(), source })
    }

    /// Holds the picture's header against the limits.
    pub(super) fn open(&self, document: &mut Document<'_>) -> Result<Encoded, Fault> {
        let pointer = self.json.pointer();
        let bytes = match &self.source {
            Source::Missing => return Err(Fault::at(pointer, "a uri or a bufferView", "neither")),
            Source::View(view) => Bytes::View(*view),
            Source::Uri(uri) => {
                Bytes::Read(uri.read(pointer, document.folder, &mut document.budget)?)
            }
        };
        let limits = decoder_limits(&document.budget);
        let encoded = Encoded { bytes, pointer: pointer.to_owned(), limits };
        let picture = picture(encoded.bytes.get(&document.views));
        let decoder = encoded.decoder(&picture)?;
        let ((width, height), decoded_bytes) = (decoder.dimensions(), decoder.total_bytes());
        drop(decoder);
        // Bytes that several pictures are of speak for one of them.
        let bytes = match &self.source {
            Source::View(view) => Some(PictureBytes::View(*view)),
            Source::Uri(Uri::Relative(path)) => Some(PictureBytes::File(path.clone())),
            _ => None,
        };
        let has_been_told = bytes.is_some_and(|bytes| !document.budget.pictures.insert(bytes));
        let told = if has_been_told { 0 } else { picture.len() };
        document.budget.add_image(pointer, [width, height], decoded_bytes, told)?;
        if width == 0 || height == 0 {
            return Err(Fault::at(pointer, "an image", "no pixels"));
        }
        Ok(encoded)
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
    bytes: Bytes,
    pointer: String,
    limits: image::Limits,
}

#[derive(Debug)]
enum Bytes {
    /// Of the buffer view with this index.
    View(usize),
    /// Of a file of its own.
    Read(Vec<u8>),
}

impl Bytes {
    fn get<'b>(&'b self, views: &[View<'b>]) -> &'b [u8] {
        match self {
            Bytes::View(view) => views[*view].bytes,
            Bytes::Read(bytes) => bytes,
        }
    }
}

impl Encoded {
    fn fault(&self, error: &dyn std::fmt::Display) -> Fault {
        Fault::at(&self.pointer, "an image", error)
    }

    fn decoder<'b>(&self, bytes: &'b [u8]) -> Result<impl ImageDecoder + 'b, Fault> {
        let reader = ImageReader::new(Cursor::new(bytes)).with_guessed_format();
        let mut reader = reader.map_err(|error| self.fault(&error))?;
        let known = [ImageFormat::Png, ImageFormat::Jpeg, ImageFormat::WebP];
        if !reader.format().is_some_and(|format| known.contains(&format)) {
            return Err(Fault::at(&self.pointer, "a PNG, JPEG or WebP image", "other bytes"));
        }
        reader.limits(self.limits.clone());
        reader.into_decoder().map_err(|error| self.fault(&error))
    }

    pub(super) fn decode(&self, views: &[View<'_>]) -> Result<Image, Fault> {
        let picture = picture(self.bytes.get(views));
        let decoder = self.decoder(&picture)?;
        let (width, height) = decoder.dimensions();
        let decoded = DynamicImage::from_decoder(decoder).map_err(|error| self.fault(&error))?;
        // In place: a copy would be the largest thing in memory.
        let rgba = bytemuck::try_cast_vec(decoded.into_rgba8().into_raw());
        let rgba = rgba.map_err(|(error, _)| self.fault(&error))?;
        Ok(Image { width, height, rgba })
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
