//! Radiance's pictures (`.hdr`), row by row into what is kept of them: four bytes per pixel.
//!
//! The header is read by the library `image`, which could read the rest only into floats, all of them at once.
//!
//! ```text
//! channel = mantissa · 2^(exponent − 136)        (Ward 1991, "Real Pixels"); exponent 0: black
//! ```

use std::cell::Cell;
use std::fmt::Display;
use std::io::{self, BufRead, Read};

use image::ImageDecoder;
use image::codecs::hdr::HdrDecoder;

use crate::gltf::{Limits, Problem, check_environment_size, one_line};

/// Columns, rows, and texels from the top left.
type Picture = (u32, u32, Vec<[u8; 4]>);
/// How many bytes have been read until something was found to be wrong, and what.
type Fault = (u64, Problem);

/// The channels of a texel, to the last bit as `image` has them.
#[inline]
pub(crate) fn linear_from_rgbe([r, g, b, exponent]: [u8; 4]) -> [f32; 3] {
    // 2^(exponent − 128), by its bits; the least is subnormal.
    let bits = match exponent {
        0 | 1 => u32::from(exponent) << 22,
        _ => u32::from(exponent - 1) << 23,
    };
    let unit = f32::from_bits(bits) * (1.0 / 256.0);
    [r, g, b].map(|mantissa| unit * f32::from(mantissa))
}

/// A picture from a file of so many bytes.
pub(crate) fn read_picture(
    file: impl BufRead,
    bytes: u64,
    limits: &Limits,
) -> Result<Picture, Fault> {
    let read = Cell::new(0);
    let mut file = Counted { file, read: &read };
    let unexpected = |came: &dyn Display| {
        let wanted = "a Radiance picture (.hdr)".to_owned();
        (read.get(), Problem::Unexpected { wanted, came: one_line(came) })
    };
    let cut = |error: io::Error| match error.kind() {
        io::ErrorKind::UnexpectedEof => unexpected(&"the end of the file"),
        _ => unexpected(&error),
    };
    let begin = file.file.fill_buf().map_err(|error| (0, Problem::Io(error)))?;
    if ![&b"#?RADIANCE"[..], b"#?RGBE"].iter().any(|name| begin.starts_with(name)) {
        return Err(unexpected(&"other bytes"));
    }
    let header = read_header(&mut file).map_err(cut)?;
    let (width, height) =
        HdrDecoder::new(&header[..]).map_err(|error| unexpected(&error))?.dimensions();
    check_environment_size(width, height, bytes, limits)
        .map_err(|problem| (read.get(), problem))?;
    if width == 0 || height == 0 {
        return Err(unexpected(&"no pixels"));
    }
    let mut texels = vec![[0; 4]; width as usize * height as usize];
    for row in texels.chunks_exact_mut(width as usize) {
        read_row(&mut file, row).map_err(cut)?;
    }
    Ok((width, height, texels))
}

/// The lines until an empty one, and that of the size, under the name that the decoder knows.
fn read_header(file: &mut impl BufRead) -> io::Result<Vec<u8>> {
    /// The decoder keeps each line several times; programs write a few hundred bytes, and a line for each of their runs.
    const MOST: u64 = 1 << 16;
    let mut file = file.take(MOST);
    let mut line = |header: &mut Vec<u8>| {
        let begin = header.len();
        match file.read_until(b'\n', header)? {
            _ if header.ends_with(b"\n") => Ok(header.len() - begin > 1),
            _ if file.limit() == 0 => Err(invalid("a header of more than 64 KiB")),
            _ => Err(io::ErrorKind::UnexpectedEof.into()),
        }
    };
    line(&mut Vec::new())?;
    let mut header = b"#?RADIANCE\n".to_vec();
    while line(&mut header)? {}
    line(&mut header)?;
    Ok(header)
}

fn read_row(file: &mut impl Read, row: &mut [[u8; 4]]) -> io::Result<()> {
    let first = read_bytes(file)?;
    // A texel that no writer makes says that the channels come one after the other.
    if let [2, 2, 0..128, _] = first {
        return (0..4).try_for_each(|channel| read_channel(file, row, channel));
    }
    read_texels(file, row, first)
}

/// Runs of up to 127 equal bytes, and up to 128 bytes as they are.
fn read_channel(file: &mut impl Read, row: &mut [[u8; 4]], channel: usize) -> io::Result<()> {
    const RUN: u8 = 128;
    let mut rest = row;
    while !rest.is_empty() {
        let [code] = read_bytes(file)?;
        let length = usize::from(if code > RUN { code - RUN } else { code });
        let (these, after) = rest.split_at_mut_checked(length).ok_or_else(too_long)?;
        if code > RUN {
            let [value] = read_bytes(file)?;
            these.iter_mut().for_each(|texel| texel[channel] = value);
        } else {
            let mut values = [0; RUN as usize];
            file.read_exact(&mut values[..length])?;
            these.iter_mut().zip(values).for_each(|(texel, value)| texel[channel] = value);
        }
        rest = after;
    }
    Ok(())
}

/// Texels as they are, with markers that repeat the one before: several in a row are the digits of a number, the lowest first.
fn read_texels(file: &mut impl Read, row: &mut [[u8; 4]], first: [u8; 4]) -> io::Result<()> {
    if let [1, 1, 1, _] = first {
        return Err(invalid("a row that begins with a run"));
    }
    row[0] = first;
    let (mut last, mut digit, mut rest) = (first, 1_usize, &mut row[1..]);
    while !rest.is_empty() {
        let texel = read_bytes(file)?;
        let length = match texel {
            [1, 1, 1, count] => {
                let length = usize::from(count).saturating_mul(digit);
                digit = digit.saturating_mul(256);
                length
            }
            _ => {
                (last, digit) = (texel, 1);
                1
            }
        };
        let (these, after) = rest.split_at_mut_checked(length).ok_or_else(too_long)?;
        these.fill(last);
        rest = after;
    }
    Ok(())
}

fn too_long() -> io::Error {
    invalid("a row of more texels than there are columns")
}

fn invalid(came: &str) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, came)
}

fn read_bytes<const N: usize>(file: &mut impl Read) -> io::Result<[u8; N]> {
    let mut bytes = [0; N];
    file.read_exact(&mut bytes)?;
    Ok(bytes)
}

/// A file, and how many of its bytes have been taken.
struct Counted<'a, F> {
    file: F,
    read: &'a Cell<u64>,
}

impl<F: Read> Read for Counted<'_, F> {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        let count = self.file.read(into)?;
        self.read.set(self.read.get() + count as u64);
        Ok(count)
    }
}

impl<F: BufRead> BufRead for Counted<'_, F> {
    fn fill_buf(&mut self) -> io::Result<&[u8]> {
        self.file.fill_buf()
    }

    fn consume(&mut self, count: usize) {
        self.file.consume(count);
        self.read.set(self.read.get() + count as u64);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn decode(bytes: &[u8], limits: &Limits) -> Result<Picture, Fault> {
        read_picture(bytes, bytes.len() as u64, limits)
    }

    fn header(width: u32, height: u32) -> Vec<u8> {
        let text = format!("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {height} +X {width}\n");
        text.into_bytes()
    }

    /// Two texels of flat RGBE: mantissas 128, 64, 32 by 2^(129 − 136) and black.
    fn hdr(width: u32) -> Vec<u8> {
        [&header(width, 1)[..], &[128, 64, 32, 129, 0, 0, 0, 0]].concat()
    }

    #[test]
    fn radiance_is_read_as_it_is_written() {
        let (width, height, texels) = decode(&hdr(2), &Limits::default()).unwrap();
        assert_eq!((width, height), (2, 1));
        assert_eq!(
            texels.into_iter().map(linear_from_rgbe).collect::<Vec<_>>(),
            [[1.0, 0.5, 0.25], [0.0; 3]]
        );
    }

    #[test]
    fn what_is_no_picture_too_large_or_cut_off_is_refused() {
        let whole = hdr(2);
        let refusal =
            |bytes: &[u8], limits: &Limits| decode(bytes, limits).unwrap_err().1.to_string();
        for length in 0..whole.len() {
            let text = refusal(&whole[..length], &Limits::default());
            assert!(text.contains("wanted a Radiance picture"), "{length}: {text}");
        }
        let huge = hdr(4_000_000_000);
        assert!(refusal(&huge, &Limits::default()).contains("pixels in one image"));
        let small = Limits { decoded_bytes: 8, ..Limits::default() };
        assert!(refusal(&whole, &small).contains("decoded bytes"));
    }

    #[test]
    fn both_names_are_known() {
        let old = [b"#?RGBE", &hdr(2)[10..]].concat();
        assert_eq!(
            decode(&old, &Limits::default()).unwrap(),
            decode(&hdr(2), &Limits::default()).unwrap()
        );
    }

    /// Each line of it is kept several times: one of 20 MB took 557 MB.
    #[test]
    fn a_header_is_short() {
        let with = |lines: usize| {
            let [name, rest] = [&hdr(2)[..11], &hdr(2)[11..]].map(<[u8]>::to_vec);
            [name, b"a=b\n".repeat(lines), rest].concat()
        };
        assert!(decode(&with(16_000), &Limits::default()).is_ok());
        let (offset, problem) = decode(&with(17_000), &Limits::default()).unwrap_err();
        assert_eq!(offset, 1 << 16);
        assert!(problem.to_string().contains("64 KiB"), "{problem}");
    }

    #[test]
    fn a_file_that_ends_too_soon_is_said_to() {
        let whole = hdr(2);
        for length in [9, 20, 42, whole.len() - 1] {
            let (offset, problem) = decode(&whole[..length], &Limits::default()).unwrap_err();
            let text = problem.to_string();
            let expected = if length < 10 { "other bytes" } else { "the end of the file" };
            assert!(text.contains(expected), "{length}: {text}");
            assert!(length < 10 || offset == length as u64, "{length}: {offset}");
        }
    }

    #[test]
    fn errors_name_the_byte() {
        let mut bytes = header(16, 2);
        let (begin, row) = (bytes.len() as u64, [2, 2, 0, 16, 144, 1, 144, 2, 144, 3, 144, 4]);
        bytes.extend(row);
        bytes.extend([2, 2, 0, 17]);
        assert_eq!(decode(&bytes, &Limits::default()).unwrap_err().0, begin + 12 + 4);
        assert_eq!(decode(b"x", &Limits::default()).unwrap_err().0, 0);
    }

    /// Run-length coding makes 16 pixels of a byte: 49 million of 3 MB.
    #[test]
    fn few_bytes_make_few_pixels() {
        let mut bytes = header(16_384, 3_000);
        let begin = bytes.len();
        let run = |length: u8| [128 + length, 127];
        let row = [&[2, 2, 64, 0][..], &[run(127).repeat(129), run(1).to_vec()].concat().repeat(4)];
        bytes.extend(row.concat().repeat(3_000));
        let (offset, problem) = decode(&bytes, &Limits::default()).unwrap_err();
        assert_eq!(offset, begin as u64);
        let text = problem.to_string();
        assert!(text.contains("pixels in images of few bytes"), "{text}");
        assert!(text.contains("--max-texture-pixels"), "{text}");
        let more = Limits { total_pixels: 64 * 49_152_000, ..Limits::default() };
        assert!(decode(&bytes, &more).is_ok());
    }

    /// By the same formula, to the last bit, whatever the bytes are.
    #[test]
    fn numbers_are_those_of_the_library_image() {
        for exponent in 0..=255 {
            for mantissas in [[0, 1, 255], [128, 127, 3], [254, 64, 200]] {
                let [r, g, b] = mantissas;
                let bytes = [&header(1, 1)[..], &[r, g, b, exponent]].concat();
                let reader = image::ImageReader::with_format(
                    std::io::Cursor::new(&bytes),
                    image::ImageFormat::Hdr,
                );
                let expected = reader.decode().unwrap().into_rgb32f().into_raw();
                let (.., texels) = decode(&bytes, &Limits::default()).unwrap();
                assert_eq!(linear_from_rgbe(texels[0]), expected[..]);
                assert!(expected.iter().all(|c| c.is_finite() && *c >= 0.0));
            }
        }
    }

    /// Rows as they are, with runs of channels, and with the runs of old; and rows that have too much or begin with a run.
    #[test]
    fn rows_of_all_kinds_are_those_of_the_library_image() {
        let flat: Vec<u8> = (0..80).map(|k| k * 3 + 9).collect();
        let channel = |value: u8| [vec![128 + 12, value], vec![8], (0..8).collect()].concat();
        let runs = [vec![2, 2, 0, 20], (1..5).flat_map(channel).collect()].concat();
        // Two markers: 3 + 256 · 0, then 16 of one texel.
        let old =
            [vec![9, 8, 7, 130, 1, 1, 1, 3, 1, 1, 1, 0], vec![5, 4, 3, 129], vec![1, 1, 1, 15]]
                .concat();
        let too_long = [vec![2, 2, 0, 20], vec![128 + 12, 1, 128 + 12, 1]].concat();
        let old_too_long = [9, 8, 7, 130, 1, 1, 1, 20].to_vec();
        let first_is_run = [1, 1, 1, 20].to_vec();
        for row in [flat, runs, old, too_long, old_too_long, first_is_run] {
            let bytes = [&header(20, 1)[..], &row[..]].concat();
            let reader = image::ImageReader::with_format(
                std::io::Cursor::new(&bytes),
                image::ImageFormat::Hdr,
            );
            let expected = reader.decode().map(|picture| picture.into_rgb32f().into_raw());
            match (decode(&bytes, &Limits::default()), expected) {
                (Ok((.., texels)), Ok(expected)) => {
                    let came: Vec<_> = texels.into_iter().flat_map(linear_from_rgbe).collect();
                    assert_eq!(came, expected);
                }
                (Err(_), Err(_)) => {}
                (came, expected) => panic!("{row:?}: {} {}", came.is_ok(), expected.is_ok()),
            }
        }
    }

    /// As damaged files have it: so many that their lengths do not fit a number.
    #[test]
    fn many_old_runs_of_nothing_end_with_the_file() {
        let bytes = [&header(20, 1)[..], &[9, 8, 7, 130], &[1, 1, 1, 0].repeat(99)].concat();
        assert!(decode(&bytes, &Limits::default()).is_err());
    }
}
