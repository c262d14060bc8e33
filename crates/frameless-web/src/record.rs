//! A recording of what is published, as H.264 in MP4, for browsers that record none themselves: sent while it is made, so that
//! nothing of it is kept here. It ends when the client has heard enough, or when the picture takes another size.

use std::sync::Arc;
use std::task::{Context, Poll};
use std::time::{Duration, Instant};

use anyhow::{Context as _, Result, bail};
use axum::body::Bytes;
use frameless::Size;
use muxide::fragmented::{FragmentConfig, FragmentedMuxer};
use openh264::OpenH264API;
use openh264::encoder::{
    BitRate, Encoder, EncoderConfig, FrameRate, FrameType, IntraFramePeriod, QpRange,
    RateControlMode, UsageType, VuiConfig,
};
use openh264::formats::{RgbSliceU8, YUVBuffer};
use tokio::sync::{OwnedSemaphorePermit, Semaphore, mpsc, watch};

use crate::tiles::Published;

/// A video has frames, whatever it is of. Where nothing changes a frame costs a few bytes.
const FRAMES_PER_SEC: u32 = 30;
// Two seconds at the most, so that players can seek.
const KEY_FRAME_EVERY: u32 = 2 * FRAMES_PER_SEC;
// What is sent at once: the most that is missing at the end of a recording.
const FRAGMENT_FRAMES: u32 = FRAMES_PER_SEC / 3;
// Above 30 edges of half-refined pictures smear.
const QUANTIZER: (u8, u8) = (10, 29);
// Far more than needed: quality is limited by the quantizer.
const BITS_PER_SEC: u32 = 60_000_000;
// Of a block of H.264; the encoder takes nothing smaller.
const SMALLEST_SIDE: u32 = 16;
// Of the file's clock, per second: the usual one for video.
const TICKS_PER_SEC: u32 = 90_000;
// A fragment ends early where it has so many bytes.
const LARGEST_FRAGMENT: usize = 4 << 20;
// A client that takes nothing for so many fragments, twenty seconds, has gone.
const FRAGMENTS_WAITING: usize = 60;
// The same in bytes, whatever is recorded: four times the largest fragment, which is more than any second of a real picture takes.
const BYTES_WAITING: u32 = 4 * LARGEST_FRAGMENT as u32;
// The first picture is there as soon as the loop has begun.
const PICTURE_WITHIN: Duration = Duration::from_secs(10);

type Pictures = watch::Receiver<Option<Arc<Published>>>;

/// An MP4 file while it is made.
pub(crate) struct Recording {
    pieces: mpsc::Receiver<std::io::Result<Piece>>,
}

/// A part of the file that waits to be taken.
struct Piece {
    bytes: Bytes,
    // Of [`BYTES_WAITING`].
    _room: OwnedSemaphorePermit,
}

impl Recording {
    /// The next piece; an error, once and last, if the recording has failed or too little of it is taken.
    pub(crate) fn poll_piece(
        &mut self,
        context: &mut Context<'_>,
    ) -> Poll<Option<std::io::Result<Bytes>>> {
        let taken = self.pieces.poll_recv(context);
        taken.map(|piece| piece.map(|piece| piece.map(|piece| piece.bytes)))
    }
}

/// Begins a recording in a thread of its own, which ends when the recording is dropped, when too little of it is taken, or when the
/// picture takes another size.
///
/// # Errors
/// If there is no thread.
pub(crate) fn begin(pictures: Pictures) -> std::io::Result<Recording> {
    let (outlet, recording) = Outlet::new();
    std::thread::Builder::new().name("recording".to_owned()).spawn(move || {
        if let Err(error) = record(&pictures, &outlet) {
            log::warn!("the recording broke off: {error:#}");
            // Fails if nobody waits for it any longer.
            outlet.pieces.blocking_send(Err(std::io::Error::other(error))).ok();
        }
    })?;
    Ok(recording)
}

/// Where a recording goes to. Never waits.
struct Outlet {
    pieces: mpsc::Sender<std::io::Result<Piece>>,
    room: Arc<Semaphore>,
}

impl Outlet {
    fn new() -> (Outlet, Recording) {
        let (sender, pieces) = mpsc::channel(FRAGMENTS_WAITING);
        let room = Arc::new(Semaphore::new(BYTES_WAITING as usize));
        (Outlet { pieces: sender, room }, Recording { pieces })
    }

    /// Hands a piece over; an error if too much waits already.
    fn send(&self, piece: Vec<u8>) -> Result<()> {
        const TOO_SLOW: &str = "what has been recorded is taken too slowly";
        // One that is larger than all room has it all.
        let wanted = u32::try_from(piece.len()).unwrap_or(BYTES_WAITING).min(BYTES_WAITING);
        let room = Arc::clone(&self.room).try_acquire_many_owned(wanted).context(TOO_SLOW)?;
        match self.pieces.try_send(Ok(Piece { bytes: piece.into(), _room: room })) {
            Err(mpsc::error::TrySendError::Full(_)) => bail!(TOO_SLOW),
            // Nobody listens: seen by whoever asks `has_ended`.
            Err(mpsc::error::TrySendError::Closed(_)) | Ok(()) => Ok(()),
        }
    }

    fn has_ended(&self) -> bool {
        self.pieces.is_closed()
    }
}

fn record(pictures: &Pictures, outlet: &Outlet) -> Result<()> {
    let newest = || pictures.borrow().clone();
    let asked = Instant::now();
    while newest().is_none() && asked.elapsed() < PICTURE_WITHIN && !outlet.has_ended() {
        std::thread::sleep(Duration::from_secs(1) / FRAMES_PER_SEC);
    }
    let begun = Instant::now();
    let first = newest().context("there is no picture yet")?;
    let (generation, mut film) = (first.generation, Film::new(first.size)?);
    while let Some(picture) = newest().filter(|picture| picture.generation == generation) {
        let piece = film.push(&picture)?;
        if !piece.is_empty() {
            outlet.send(piece)?;
        }
        // Frames that there was no time for are left out: the next one stands in their place for as long.
        let elapsed = begun.elapsed().as_secs_f64() * f64::from(FRAMES_PER_SEC);
        film.frame = (elapsed as u32).max(film.frame + 1);
        let due = begun + Duration::from_secs(1) * film.frame / FRAMES_PER_SEC;
        std::thread::sleep(due.saturating_duration_since(Instant::now()));
        if outlet.has_ended() {
            break;
        }
    }
    Ok(())
}

/// Encodes pictures of one size, and says what the file grows by.
struct Film {
    encoder: Encoder,
    width: u32,
    height: u32,
    /// Number of the next picture's frame.
    frame: u32,
    // None before the first frame: the file's head has the encoder's parameters in it.
    muxer: Option<FragmentedMuxer>,
    // Of the fragment that grows.
    frames: u32,
    bytes: usize,
}

impl Film {
    /// A row or column beyond an even number is left out: H.264 wants it so.
    fn new(size: Size) -> Result<Film> {
        let even = |side: u32| (side & !1).max(SMALLEST_SIDE);
        let config = EncoderConfig::new()
            .usage_type(UsageType::CameraVideoRealTime)
            .rate_control_mode(RateControlMode::Off)
            .bitrate(BitRate::from_bps(BITS_PER_SEC))
            .max_frame_rate(FrameRate::from_hz(FRAMES_PER_SEC as f32))
            .qp(QpRange::new(QUANTIZER.0, QUANTIZER.1))
            .skip_frames(false)
            .scene_change_detect(false)
            .intra_frame_period(IntraFramePeriod::from_num_frames(KEY_FRAME_EVERY))
            .vui(VuiConfig::bt601());
        let encoder = Encoder::with_api_config(OpenH264API::from_source(), config)?;
        let (width, height) = (even(size.width), even(size.height));
        Ok(Film { encoder, width, height, frame: 0, muxer: None, frames: 0, bytes: 0 })
    }

    /// Appends a frame. What the file grows by may be nothing yet.
    fn push(&mut self, picture: &Published) -> Result<Vec<u8>> {
        let rgb = self.cut(picture);
        let source = RgbSliceU8::new(&rgb, (self.width as usize, self.height as usize));
        let bits = self.encoder.encode(&YUVBuffer::from_rgb8_source(source))?;
        let is_key = matches!(bits.frame_type(), FrameType::IDR | FrameType::I);
        let stream = bits.to_vec();
        let mut piece = Vec::new();
        let muxer = match &mut self.muxer {
            Some(muxer) => muxer,
            none => {
                let muxer = none.insert(head(self.width, self.height, &stream)?);
                piece = muxer.init_segment();
                muxer
            }
        };
        let at = u64::from(self.frame) * u64::from(TICKS_PER_SEC / FRAMES_PER_SEC);
        muxer.write_video(at, at, &with_lengths(&stream), is_key)?;
        self.frames += 1;
        self.bytes += stream.len();
        if self.frames == FRAGMENT_FRAMES || self.bytes >= LARGEST_FRAGMENT {
            (self.frames, self.bytes) = (0, 0);
            piece.extend(muxer.flush_segment().unwrap_or_default());
        }
        Ok(piece)
    }

    /// R G B of what lies within the film; black beyond a picture smaller than that.
    fn cut(&self, picture: &Published) -> Vec<u8> {
        let row_bytes = 3 * self.width as usize;
        let mut rgb = vec![0; row_bytes * self.height as usize];
        let rows = picture.rgba.chunks(picture.size.width as usize);
        for (to, from) in rgb.chunks_mut(row_bytes).zip(rows) {
            for (to, [r, g, b, _]) in to.chunks_exact_mut(3).zip(from) {
                to.copy_from_slice(&[*r, *g, *b]);
            }
        }
        rgb
    }
}

// Types of units in a stream of H.264: parameters of the sequence, and of a picture.
const SEQUENCE: u8 = 7;
const PICTURE: u8 = 8;

fn head(width: u32, height: u32, stream: &[u8]) -> Result<FragmentedMuxer> {
    let parameters = |kind: u8| -> Result<Vec<u8>> {
        let unit = units(stream).find(|unit| unit[0] & 31 == kind);
        Ok(unit.context("the encoder's first frame has no parameters")?.to_vec())
    };
    let mut config = FragmentConfig::new(width, height, TICKS_PER_SEC);
    (config.sps, config.pps) = (parameters(SEQUENCE)?, parameters(PICTURE)?);
    Ok(FragmentedMuxer::new(config)?)
}

/// The units of a stream, each of which begins with 0 0 1 or 0 0 0 1; without that, and without the zeros that may follow it.
fn units(stream: &[u8]) -> impl Iterator<Item = &[u8]> {
    let begins: Vec<usize> = stream
        .windows(3)
        .enumerate()
        .filter(|(_, three)| *three == [0, 0, 1])
        .map(|(at, _)| at)
        .collect();
    let ends: Vec<usize> = begins.iter().skip(1).copied().chain([stream.len()]).collect();
    begins.into_iter().zip(ends).filter_map(|(begin, end)| {
        let unit = &stream[begin + 3..end];
        let length = unit.iter().rposition(|&byte| byte != 0)? + 1;
        Some(&unit[..length])
    })
}

/// As MP4 wants a frame: its length before each unit; the parameters are in the head.
fn with_lengths(stream: &[u8]) -> Vec<u8> {
    let mut sample = Vec::with_capacity(stream.len() + 8);
    for unit in units(stream).filter(|unit| ![SEQUENCE, PICTURE].contains(&(unit[0] & 31))) {
        sample.extend((unit.len() as u32).to_be_bytes());
        sample.extend(unit);
    }
    sample
}

#[cfg(test)]
mod tests {
    use frameless_session::{Ages, Picture, Status};

    use super::*;
    use crate::tiles::{Occasion, Publisher, Taken};

    const SIZE: Size = Size { width: 65, height: 34 };

    fn published(size: Size, level: u8) -> Arc<Published> {
        let status = Status {
            scene_secs: 0.0,
            samples_per_sec: 0.0,
            pictures_per_sec: 0.0,
            ages: Ages::default(),
            overlay: None,
        };
        let rgba = vec![[level, 255 - level, 40, 255]; size.pixels()];
        let picture = Picture { size, rgba, mark: 0, status };
        let now = Instant::now();
        match Publisher::new(now).take(picture, Vec::new(), Occasion::Motion, now) {
            Taken::New(published) => published,
            Taken::Same(_) => panic!("the first picture is always published"),
        }
    }

    /// The 32-bit numbers after the names of all boxes of that name.
    fn numbers<const N: usize>(file: &[u8], name: &[u8; 4]) -> Vec<[u32; N]> {
        let words = file.windows(4).enumerate().filter(|(_, word)| word == name);
        let number = |at: usize| u32::from_be_bytes(file[at..at + 4].try_into().expect("four"));
        words.map(|(at, _)| std::array::from_fn(|i| number(at + 4 + 4 * i))).collect()
    }

    #[test]
    fn frames_come_in_fragments_after_one_head() {
        let mut film = Film::new(SIZE).expect("it begins");
        let mut file = Vec::new();
        for frame in 0..2 * FRAGMENT_FRAMES {
            film.frame = frame;
            file.extend(film.push(&published(SIZE, 10 * frame as u8)).expect("it is encoded"));
        }
        assert_eq!(&file[4..8], b"ftyp");
        // tkhd ends with width and height in 1/65,536 pixel.
        let tracks = numbers::<21>(&file, b"tkhd");
        assert_eq!([tracks[0][19] >> 16, tracks[0][20] >> 16], [64, 34]);
        // trun: flags, how many frames, where they lie, and how long the first is shown.
        let runs = numbers::<4>(&file, b"trun");
        let frames: Vec<_> = runs.iter().map(|run| (run[1], run[3])).collect();
        assert_eq!(frames, [(FRAGMENT_FRAMES, 3000); 2]);
        // tfdt, version 1: when a fragment begins, in 64 bits.
        let begins: Vec<_> = numbers::<3>(&file, b"tfdt").iter().map(|at| at[2]).collect();
        assert_eq!(begins, [0, 3000 * FRAGMENT_FRAMES]);
    }

    #[test]
    fn the_smallest_picture_can_be_recorded() {
        let one = Size::new(1, 1);
        let mut film = Film::new(one).expect("it begins");
        assert!(!film.push(&published(one, 7)).expect("it is encoded").is_empty());
    }

    #[test]
    fn units_are_found_whatever_separates_them() {
        let stream = [0, 0, 0, 1, 0x67, 5, 0, 0, 1, 0x68, 6, 0, 0, 0, 1, 0x65, 0, 7, 0];
        let found: Vec<&[u8]> = units(&stream).collect();
        assert_eq!(found, [&[0x67, 5][..], &[0x68, 6], &[0x65, 0, 7]]);
        assert_eq!(with_lengths(&stream), [0, 0, 0, 3, 0x65, 0, 7]);
        assert_eq!(units(&[]).count() + units(&[0, 0, 1]).count(), 0);
    }

    #[test]
    fn what_waits_is_bounded_by_its_bytes_and_too_much_is_an_error() {
        let (outlet, mut recording) = Outlet::new();
        let third = || vec![0; BYTES_WAITING as usize / 3];
        for _ in 0..3 {
            outlet.send(third()).expect("there is room");
        }
        assert!(outlet.send(third()).unwrap_err().to_string().contains("too slowly"));
        drop(recording.pieces.try_recv().expect("a piece"));
        outlet.send(third()).expect("one was taken");
        while recording.pieces.try_recv().is_ok() {}
        outlet.send(vec![0; 2 * BYTES_WAITING as usize]).expect("it is alone");
        assert!(outlet.send(vec![0]).is_err());
        drop(recording);
        assert!(outlet.has_ended());
    }

    #[test]
    fn noise_makes_short_fragments() {
        let size = Size::new(1920, 1080);
        let mut rng = frameless::Rng::new(1);
        let mut film = Film::new(size).expect("it begins");
        let mut picture = Arc::into_inner(published(size, 0)).expect("ours alone");
        let mut largest = 0;
        for frame in 0..4 {
            for pixel in &mut picture.rgba {
                *pixel = [0; 4].map(|_| (256.0 * rng.unit_f32()) as u8);
            }
            film.frame = frame;
            largest = largest.max(film.push(&picture).expect("it is encoded").len());
        }
        assert!((1..BYTES_WAITING as usize).contains(&largest), "{largest} bytes");
    }

    #[test]
    fn another_size_ends_a_recording_and_so_does_nobody_listening() {
        let (show, pictures) = watch::channel(Some(published(SIZE, 9)));
        let mut recording = begin(pictures.clone()).expect("a thread");
        let head = recording.pieces.blocking_recv().expect("a piece").expect("no error");
        assert_eq!(&head.bytes[4..8], b"ftyp");
        let mut other = Arc::into_inner(published(Size::new(32, 32), 9)).expect("ours alone");
        other.generation = 2;
        show.send_replace(Some(Arc::new(other)));
        while let Some(piece) = recording.pieces.blocking_recv() {
            assert!(piece.is_ok(), "another size is no error");
        }
        let listening = begin(pictures.clone()).expect("a thread");
        drop(listening);
        let begun = Instant::now();
        while show.receiver_count() > 1 && begun.elapsed() < Duration::from_secs(10) {
            std::thread::sleep(Duration::from_millis(5));
        }
        assert_eq!(show.receiver_count(), 1);
    }
}
