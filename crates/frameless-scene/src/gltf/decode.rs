//! From the bytes of a PNG, JPEG or WebP to pixels, and whether any of them were damaged.
//!
//! Decoders draw what they can of a file that is cut, or whose checksums are wrong, and say nothing: so each picture is read strictly first,
//! and what is wrong with it then is told, if it can be read at all. A byte that was changed inside a JPEG or WebP may still go unseen: they
//! have no checksums.

use std::fmt::Display;
use std::io::Cursor;

use image::{ColorType, ImageDecoder, ImageFormat, ImageReader};
use zune_core::bytestream::ZCursor;
use zune_core::colorspace::ColorSpace;
use zune_core::options::DecoderOptions;
use zune_jpeg::JpegDecoder;

use crate::Image;

use super::error::one_line;

/// A picture, and what is wrong with the file that it is of.
pub(super) struct Decoded {
    pub(super) image: Image,
    pub(super) damage: Option<String>,
    /// Whether a strict decoder gave up, and a lenient one began again.
    pub(super) is_read_twice: bool,
}

/// What the decoders of this program read.
pub(super) fn format_of(picture: &[u8]) -> Option<ImageFormat> {
    let known = [ImageFormat::Png, ImageFormat::Jpeg, ImageFormat::WebP];
    image::guess_format(picture).ok().filter(|format| known.contains(format))
}

/// A decoder that reads what it can of a picture.
pub(super) fn lenient<'b>(
    picture: &'b [u8],
    limits: &image::Limits,
) -> image::ImageResult<impl ImageDecoder + use<'b>> {
    let mut reader = ImageReader::new(Cursor::new(picture)).with_guessed_format()?;
    reader.limits(limits.clone());
    reader.into_decoder()
}

/// Decodes a picture as far as it goes.
pub(super) fn decode(picture: &[u8], limits: &image::Limits) -> Result<Decoded, String> {
    let (strict, told) = match format_of(picture) {
        Some(ImageFormat::Png) => (strict_png(picture, limits), None),
        Some(ImageFormat::Jpeg) => (strict_jpeg(picture), missing_end(picture)),
        _ => (Err(String::new()), missing_bytes(picture)),
    };
    let (decoded, wrong) = match strict {
        Ok(image) => (image, None),
        Err(wrong) => (leniently(picture, limits)?, Some(wrong)),
    };
    // Nothing is said of those that only the lenient decoder reads.
    let wrong = wrong.filter(|wrong| !wrong.is_empty());
    let is_read_twice = wrong.is_some();
    Ok(Decoded { image: without_repetition(decoded), damage: told.or(wrong), is_read_twice })
}

/// As far as the lenient decoder reads it.
fn leniently(picture: &[u8], limits: &image::Limits) -> Result<Image, String> {
    let decoder = lenient(picture, limits).map_err(said)?;
    let (size, color, length) = (decoder.dimensions(), decoder.color_type(), decoder.total_bytes());
    let layout = Layout::of(color).ok_or("colours of another kind")?;
    let mut texels = layout.texels(size, length)?;
    decoder.read_image(&mut texels.as_flattened_mut()[..length as usize]).map_err(said)?;
    Ok(layout.rgba(size, texels, u16::from_ne_bytes))
}

/// What a decoder makes of each pixel.
#[derive(Clone, Copy, Debug)]
struct Layout {
    channels: usize,
    bytes_per_channel: usize,
}

impl Layout {
    fn of(color: ColorType) -> Option<Layout> {
        use ColorType::{L8, L16, La8, La16, Rgb8, Rgb16, Rgba8, Rgba16};
        [L8, La8, Rgb8, Rgba8, L16, La16, Rgb16, Rgba16].contains(&color).then(|| {
            let channels = usize::from(color.channel_count());
            Layout { channels, bytes_per_channel: usize::from(color.bytes_per_pixel()) / channels }
        })
    }

    fn bytes_per_pixel(self) -> usize {
        self.channels * self.bytes_per_channel
    }

    /// Room for what is decoded, of `length` bytes, and for what is made of it in the same place: a copy would be the largest thing in memory.
    fn texels(self, (width, height): (u32, u32), length: u64) -> Result<Vec<[u8; 4]>, String> {
        let pixels = width as usize * height as usize;
        if length != (pixels * self.bytes_per_pixel()) as u64 {
            return Err("another number of bytes than its pixels have".to_owned());
        }
        Ok(vec![[0; 4]; pixels.max((length as usize).div_ceil(4))])
    }

    /// The picture of which the pixels stand at the beginning of `texels`.
    fn rgba(
        self,
        (width, height): (u32, u32),
        mut texels: Vec<[u8; 4]>,
        word: fn([u8; 2]) -> u16,
    ) -> Image {
        let pixels = width as usize * height as usize;
        let bytes = texels.as_flattened_mut();
        match (self.bytes_per_channel, self.channels) {
            (1, 1) => expand(bytes, pixels, |[l]| [l, l, l, 255]),
            (1, 2) => expand(bytes, pixels, |[l, a]| [l, l, l, a]),
            (1, 3) => expand(bytes, pixels, |[r, g, b]| [r, g, b, 255]),
            (1, _) => {}
            (_, 1) => expand(bytes, pixels, |[l, m]| {
                let l = byte(word([l, m]));
                [l, l, l, 255]
            }),
            (_, 2) => expand(bytes, pixels, |[l, m, a, b]| {
                let l = byte(word([l, m]));
                [l, l, l, byte(word([a, b]))]
            }),
            (_, 3) => contract(bytes, pixels, |[r, s, g, h, b, c]| {
                [byte(word([r, s])), byte(word([g, h])), byte(word([b, c])), 255]
            }),
            (_, _) => contract(bytes, pixels, |[r, s, g, h, b, c, a, d]| {
                [[r, s], [g, h], [b, c], [a, d]].map(|two| byte(word(two)))
            }),
        }
        texels.truncate(pixels);
        texels.shrink_to_fit();
        Image { width, height, rgba: texels }
    }
}

/// The nearest of 8 bits.
fn byte(word: u16) -> u8 {
    ((u32::from(word) + 128) / 257) as u8
}

/// From the last to the first, as each takes no less than before.
fn expand<const N: usize>(bytes: &mut [u8], pixels: usize, rgba: impl Fn([u8; N]) -> [u8; 4]) {
    for pixel in (0..pixels).rev() {
        place(bytes, pixel, &rgba);
    }
}

/// From the first to the last, as each takes no more than before.
fn contract<const N: usize>(bytes: &mut [u8], pixels: usize, rgba: impl Fn([u8; N]) -> [u8; 4]) {
    for pixel in 0..pixels {
        place(bytes, pixel, &rgba);
    }
}

#[inline]
fn place<const N: usize>(bytes: &mut [u8], pixel: usize, rgba: impl Fn([u8; N]) -> [u8; 4]) {
    let mut from = [0; N];
    from.copy_from_slice(&bytes[N * pixel..N * pixel + N]);
    bytes[4 * pixel..4 * pixel + 4].copy_from_slice(&rgba(from));
}

/// A picture all of one colour as one texel, which looks the same from everywhere.
fn without_repetition(image: Image) -> Image {
    /// Texels of pictures that are not worth it.
    const FEW: usize = 64 * 64;
    match image.rgba.split_first() {
        Some((&first, rest)) if rest.len() >= FEW && rest.iter().all(|&texel| texel == first) => {
            Image { width: 1, height: 1, rgba: vec![first] }
        }
        _ => image,
    }
}

fn said(error: impl Display) -> String {
    one_line(&error)
}

/// With all checksums right.
fn strict_png(picture: &[u8], limits: &image::Limits) -> Result<Image, String> {
    let mut options = png::DecodeOptions::default();
    options.set_ignore_adler32(false);
    let mut decoder = png::Decoder::new_with_options(Cursor::new(picture), options);
    let most = limits.max_alloc.and_then(|bytes| usize::try_from(bytes).ok());
    decoder.set_limits(png::Limits { bytes: most.unwrap_or(usize::MAX) });
    // Four channels at once, or grey and alpha.
    decoder.set_transformations(png::Transformations::EXPAND | png::Transformations::ALPHA);
    let mut reader = decoder.read_info().map_err(said)?;
    let length = reader.output_buffer_size().ok_or("too large")?;
    let (size, (color, depth)) = (reader.info().size(), reader.output_color_type());
    let bytes_per_channel = if depth == png::BitDepth::Sixteen { 2 } else { 1 };
    let layout = Layout { channels: color.samples(), bytes_per_channel };
    let mut texels = layout.texels(size, length as u64)?;
    reader.next_frame(&mut texels.as_flattened_mut()[..length]).map_err(said)?;
    Ok(layout.rgba(size, texels, u16::from_be_bytes))
}

/// Without anything that is left out or made up.
fn strict_jpeg(picture: &[u8]) -> Result<Image, String> {
    let options = DecoderOptions::default()
        .set_strict_mode(true)
        .set_max_width(usize::MAX)
        .set_max_height(usize::MAX);
    let mut decoder = JpegDecoder::new_with_options(ZCursor::new(picture), options);
    decoder.decode_headers().map_err(said)?;
    // Those of which there is a way to four channels; all others are for the other decoder, and nothing is said.
    let (Some(ColorSpace::YCbCr | ColorSpace::Luma), Some(info)) =
        (decoder.input_colorspace(), decoder.info())
    else {
        return Err(String::new());
    };
    // What it decodes to is settled with the headers.
    let options = options.jpeg_set_out_colorspace(ColorSpace::RGBA);
    let mut decoder = JpegDecoder::new_with_options(ZCursor::new(picture), options);
    let rgba = decoder.decode().map_err(said)?;
    let rgba: Vec<[u8; 4]> = bytemuck::try_cast_vec(rgba).map_err(|_| String::new())?;
    let (width, height) = (u32::from(info.width), u32::from(info.height));
    let has_all = rgba.len() == width as usize * height as usize;
    has_all.then_some(Image { width, height, rgba }).ok_or_else(String::new)
}

/// JPEGs end with a marker (ITU T.81 §B.1.1.3).
fn missing_end(picture: &[u8]) -> Option<String> {
    const END: [u8; 2] = [0xff, 0xd9];
    let has_end = picture.windows(2).rev().any(|two| two == END);
    (!has_end).then(|| "its end is missing".to_owned())
}

/// WebP files say how long they are after four bytes, and count from there.
fn missing_bytes(picture: &[u8]) -> Option<String> {
    let length: [u8; 4] = picture.get(4..8)?.try_into().ok()?;
    let (wanted, came) = (u64::from(u32::from_le_bytes(length)) + 8, picture.len() as u64);
    (came < wanted).then(|| format!("{came} of its {wanted} bytes are there"))
}

/// What is in memory while a picture is decoded, by this or the lenient decoder, of the bytes that it says it decodes to.
///
/// Of JPEGs that come in several scans all coefficients are kept, two bytes each, of all blocks, as many as the finest channel has.
pub(super) fn working_bytes(picture: &[u8], [width, height]: [u32; 2], decoded_bytes: u64) -> u64 {
    const RGBA: u64 = 4;
    let pixels = u64::from(width) * u64::from(height);
    let rgba = RGBA.saturating_mul(pixels);
    // As the decoder has it, then as we do.
    let both = decoded_bytes.saturating_add(rgba);
    match format_of(picture) {
        Some(ImageFormat::Jpeg) => match Frame::of(picture).filter(|frame| frame.is_kept) {
            Some(frame) => frame.coefficients(pixels).saturating_mul(2).saturating_add(rgba),
            None => rgba,
        },
        // Eight bits per channel are decoded to what we have.
        Some(ImageFormat::Png) if decoded_bytes <= rgba => rgba,
        _ => both,
    }
}

/// How much there is to do until a picture is decoded: as for so many pixels of an ordinary one, 8 bits per channel without loss.
pub(super) fn work_pixels(picture: &[u8], [width, height]: [u32; 2]) -> u64 {
    let pixels = u64::from(width) * u64::from(height);
    match format_of(picture) {
        // Each scan looks at all coefficients again, and once they are all there each block is transformed.
        Some(ImageFormat::Jpeg) => match Frame::of(picture).filter(|frame| frame.is_kept) {
            Some(frame) => {
                let looks = SCANS_PER_TRANSFORM.saturating_add(frame.scans);
                let more = frame.coefficients(pixels).saturating_mul(looks) / SCANS_PER_PIXEL;
                pixels.saturating_add(more)
            }
            None => pixels,
        },
        Some(ImageFormat::WebP) => pixels.saturating_mul(3) / 2,
        _ if is_deep_png(picture) => pixels.saturating_mul(2),
        _ => pixels,
    }
}

/// Scans of next to no bytes take a 64th of what a pixel takes, 0.15 of 10 ns.
const SCANS_PER_PIXEL: u64 = 64;
/// What else is done once for each coefficient, in scans.
const SCANS_PER_TRANSFORM: u64 = 8;

/// Whether a PNG has 16 bits per channel (ISO 15948 §11.2.2).
fn is_deep_png(picture: &[u8]) -> bool {
    /// After the signature, and the chunk's length and name: width, height, depth.
    const DEPTH: usize = 8 + 8 + 8;
    picture.get(DEPTH) == Some(&16)
}

/// How the samples of a JPEG are arranged (ITU T.81 §B.2.2).
struct Frame {
    /// Σ horizontal · vertical sampling over all channels, and the most of each.
    samples: u64,
    most: [u64; 2],
    /// Whether all of them are kept until the end: a progressive one, or one whose channels come one after the other.
    is_kept: bool,
    /// Times that samples are gone through.
    scans: u64,
}

impl Frame {
    /// By the header; `None` if this is no JPEG that anything can be decoded of.
    fn of(picture: &[u8]) -> Option<Frame> {
        let mut rest = picture.strip_prefix(b"\xff\xd8")?;
        let mut frame: Option<Frame> = None;
        let mut channels = 0;
        loop {
            // Between segments there may be anything.
            let begin = rest.windows(2).position(|two| two[0] == 0xff && two[1] >= 0xc0)?;
            let (kind, after) = (rest[begin + 1], &rest[begin + 2..]);
            let length = usize::from(u16::from_be_bytes(*after.first_chunk::<2>()?));
            let segment = after.get(2..length)?;
            rest = &after[length..];
            match kind {
                0xc0..=0xc3 => {
                    channels = *segment.get(5)?;
                    let sampling = segment.get(6..)?.chunks_exact(3).take(channels.into());
                    let sampling = sampling.map(|one| [one[1] >> 4, one[1] & 15].map(u64::from));
                    let (mut samples, mut most) = (0, [1, 1]);
                    for [x, y] in sampling {
                        samples += x * y;
                        most = [most[0].max(x), most[1].max(y)];
                    }
                    frame = Some(Frame { samples, most, is_kept: kind == 0xc2, scans: 0 });
                }
                0xda => {
                    let is_part = *segment.first()? < channels;
                    let scans = 1 + rest.windows(2).filter(|two| *two == [0xff, 0xda]).count();
                    return frame.map(|frame| Frame {
                        is_kept: frame.is_kept || is_part,
                        scans: scans as u64,
                        ..frame
                    });
                }
                _ => {}
            }
        }
    }

    fn coefficients(&self, pixels: u64) -> u64 {
        pixels.saturating_mul(self.samples) / (self.most[0] * self.most[1])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Start of frame (progressive or not), then of scan.
    fn header(progressive: bool, sampling: &[u8], channels_in_scan: u8) -> Vec<u8> {
        let channels = sampling.len() as u8;
        let length = 8 + 3 * channels;
        let kind = if progressive { 0xc2 } else { 0xc0 };
        let mut bytes = b"\xff\xd8\xff\xe0\x00\x04ab".to_vec();
        bytes.extend([0xff, kind, 0, length, 8, 0, 100, 0, 100, channels]);
        sampling.iter().for_each(|&sampling| bytes.extend([1, sampling, 0]));
        bytes.extend([0xff, 0xda, 0, 3, channels_in_scan]);
        bytes
    }

    #[test]
    fn what_is_kept_while_a_jpeg_is_decoded_is_known() {
        let bytes = |header: Vec<u8>| working_bytes(&header, [100, 100], 30_000);
        let plain = 40_000;
        assert_eq!(bytes(header(false, &[0x22, 0x11, 0x11], 3)), plain);
        assert_eq!(bytes(header(true, &[0x22, 0x11, 0x11], 3)), plain + 2 * 15_000);
        assert_eq!(bytes(header(true, &[0x11; 4], 1)), plain + 2 * 40_000);
        assert_eq!(bytes(header(false, &[0x11; 3], 1)), plain + 2 * 30_000);
        let cut = header(true, &[0x11; 4], 1);
        for length in 0..cut.len() {
            let _ = working_bytes(&cut[..length], [u32::MAX; 2], u64::MAX);
        }
    }

    /// Of every kind, strictly and leniently, as the library `image` converts them.
    #[test]
    fn pixels_are_those_of_the_library_image() {
        use image::{DynamicImage, Rgba};
        let texel = |x: u32, y: u32| {
            let word = |k: u32| ((x * 7919 + y * 104_729 + k * 28_657) % 65_536) as u16;
            Rgba([word(1), word(2), word(3), word(4)])
        };
        let all = DynamicImage::ImageRgba16(image::ImageBuffer::from_fn(37, 5, texel));
        let kinds = [
            DynamicImage::from(all.to_luma8()),
            all.to_luma_alpha8().into(),
            all.to_rgb8().into(),
            all.to_rgba8().into(),
            all.to_luma16().into(),
            all.to_luma_alpha16().into(),
            all.to_rgb16().into(),
            all,
        ];
        for kind in kinds {
            let mut png = Cursor::new(Vec::new());
            kind.write_to(&mut png, ImageFormat::Png).unwrap();
            let (png, color, limits) = (png.into_inner(), kind.color(), image::Limits::default());
            let expected = kind.into_rgba8().into_raw();
            let strict = strict_png(&png, &limits).unwrap();
            assert_eq!(strict.rgba.as_flattened(), expected, "{color:?}");
            let lenient = leniently(&png, &limits).unwrap();
            assert_eq!(lenient.rgba.as_flattened(), expected, "{color:?}");
            assert_eq!((lenient.width, lenient.height), (37, 5));
        }
    }

    #[test]
    fn scans_and_deep_channels_are_work() {
        let work = |picture: &[u8]| work_pixels(picture, [100, 100]);
        let plain = header(false, &[0x22, 0x11, 0x11], 3);
        assert_eq!(work(&plain), 10_000);
        let progressive = header(true, &[0x22, 0x11, 0x11], 3);
        assert_eq!(work(&progressive), 10_000 + 15_000 * (8 + 1) / 64);
        let scan = b"\xff\xda\x00\x03\x03";
        let many = [&progressive[..], &scan.repeat(99)].concat();
        assert_eq!(work(&many), 10_000 + 15_000 * (8 + 100) / 64);
        let mut png = b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\0\0d\0\0\0d\x08\0\0\0\0".to_vec();
        assert_eq!(work(&png), 10_000);
        png[24] = 16;
        assert_eq!(work(&png), 20_000);
        assert_eq!(work(b"RIFF\0\0\0\0WEBPVP8 "), 15_000);
    }

    #[test]
    fn what_is_all_of_one_colour_is_one_texel() {
        let flat = |side: u32| Image {
            width: side,
            height: side,
            rgba: vec![[1, 2, 3, 4]; (side * side) as usize],
        };
        assert_eq!(without_repetition(flat(64)), flat(64));
        assert_eq!(without_repetition(flat(65)), flat(1));
        for texel in [0, 1, 4224] {
            let mut other = flat(65);
            other.rgba[texel][3] = 5;
            assert_eq!(without_repetition(other.clone()), other);
        }
    }

    #[test]
    fn what_is_cut_is_seen() {
        assert!(missing_end(b"\xff\xd8 picture \xff\xd9 and more").is_none());
        assert!(missing_end(b"\xff\xd8 pictu").is_some());
        assert!(missing_bytes(b"RIFF\x02\0\0\0WEB").is_none());
        assert!(missing_bytes(b"RIFF\x04\0\0\0WEB").is_some());
    }
}
