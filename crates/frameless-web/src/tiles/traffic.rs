//! What a moving scene costs, and what it looks like at the other end: everything but the socket, on the simulated clock.

use std::sync::Arc;
use std::time::{Duration, Instant};

use frameless::{Clock, Size, Time};
use frameless_scene::builtin;
use frameless_session::{Session, Settings};
use frameless_trace::{CpuTracer, ViewSource, World};

use super::{Atlas, Occasion, Publisher, Seen, Taken, Times, encode};
use crate::wire::Codec;

const SIZE: Size = Size { width: 512, height: 384 };
const SAMPLES_PER_SEC: f64 = 900_000.0;

/// Of a client that acknowledges everything at once.
struct Measured {
    bytes_per_sec: f64,
    lossy_bytes_per_sec: f64,
    /// Mean over the pictures of the squared error, as PSNR in dB.
    psnr: f64,
    tiles_per_picture: f64,
}

fn measure(scene: &str, pictures_per_sec: u32, from_secs: f64, secs: f64) -> Measured {
    let world = Arc::new(World::new(Arc::new(builtin(scene).expect("built in"))));
    let tracing = frameless_trace::Settings::default();
    let tracer = CpuTracer::new(world, ViewSource::Camera(0), tracing, 0);
    let clock = Clock::simulated(SAMPLES_PER_SEC);
    let mut session = Session::new(SIZE, clock, Settings::default(), 1, tracer);
    let begin = Instant::now();
    let (mut publisher, mut seen) = (Publisher::new(begin), Seen::nothing());
    let mut canvas = vec![[0; 3]; SIZE.pixels()];
    let (mut bytes, mut lossy_bytes, mut tiles, mut squares, mut pictures) = (0, 0, 0, 0.0, 0u32);
    for number in 1..=((from_secs + secs) * f64::from(pictures_per_sec)) as u32 {
        let now_secs = f64::from(number) / f64::from(pictures_per_sec);
        while session.now() < Time::from_secs(now_secs) {
            session.step().expect("finite colours");
        }
        let now = begin + Duration::from_secs_f64(now_secs);
        let taken = publisher.take(session.picture(Vec::new()), Vec::new(), Occasion::Motion, now);
        let Taken::New(shown) = taken else { continue };
        let counts = now_secs > from_secs;
        for exact_tiles in [0, 32] {
            let now_ms = (1000.0 * now_secs) as u64;
            let times = Times { now_ms, calm_ms: u64::MAX };
            let chosen = seen.choose(&shown, times, [2048, exact_tiles], exact_tiles > 0);
            if chosen.tiles.is_empty() {
                continue;
            }
            seen.sent(&shown, &chosen, now_ms);
            let atlas = Atlas::of(&shown.grid(), &chosen.tiles, &shown.rgba, Vec::new());
            let codec = if chosen.lossless { Codec::Png } else { Codec::Jpeg };
            let payload = encode(codec, &atlas).expect("an atlas");
            draw(&payload, &shown.grid(), &chosen.tiles, &mut canvas);
            if counts {
                let length = payload.len() + 32 + 2 * chosen.tiles.len();
                bytes += length;
                if !chosen.lossless {
                    lossy_bytes += length;
                    tiles += chosen.tiles.len();
                }
            }
        }
        if counts {
            let pairs = canvas.iter().zip(&shown.rgba);
            let sum: u64 = pairs
                .flat_map(|(a, b)| a.iter().zip(b))
                .map(|(a, b)| u64::from(a.abs_diff(*b)).pow(2))
                .sum();
            squares += sum as f64 / (3 * SIZE.pixels()) as f64;
            pictures += 1;
        }
    }
    Measured {
        bytes_per_sec: bytes as f64 / secs,
        lossy_bytes_per_sec: lossy_bytes as f64 / secs,
        psnr: 10.0 * (255.0f64.powi(2) / (squares / f64::from(pictures))).log10(),
        tiles_per_picture: tiles as f64 / f64::from(pictures),
    }
}

fn draw(payload: &[u8], grid: &super::Grid, tiles: &[u16], canvas: &mut [[u8; 3]]) {
    let atlas = image::load_from_memory(payload).expect("a picture").to_rgb8();
    let columns = atlas.width() / super::SIDE;
    for (k, &tile) in tiles.iter().enumerate() {
        let (x, y) = (k as u32 % columns * super::SIDE, k as u32 / columns * super::SIDE);
        for (dy, row) in grid.rows(tile.into()).enumerate() {
            for (dx, at) in row.enumerate() {
                canvas[at] = atlas.get_pixel(x + dx as u32, y + dy as u32).0;
            }
        }
    }
}

#[test]
fn a_moving_ball_costs_little_and_looks_right() {
    let measured = measure("sphere", 30, 3.0, 1.5);
    println!(
        "{:.0} KB/s, {:.0} of them lossy, {:.1} dB, {:.0} tiles per picture",
        measured.bytes_per_sec / 1e3,
        measured.lossy_bytes_per_sec / 1e3,
        measured.psnr,
        measured.tiles_per_picture
    );
    // At what a slow machine traces; on the page of a faster one it is 2 dB more (docs/performance.md).
    assert!(measured.psnr >= 36.5, "{} dB", measured.psnr);
    assert!(measured.bytes_per_sec <= 600e3, "{} bytes/s", measured.bytes_per_sec);
    // 768 tiles: what rests is not sent again and again.
    assert!(measured.tiles_per_picture < 150.0, "{} tiles", measured.tiles_per_picture);
}
