//! Pictures for the built-in scenes, painted from formulas: high contrast, seamless when repeated.
//!
//! Colours are sRGB-encoded, in [0, 1]; (u, v) runs over [0, 1) from the top left.

use glam::{Vec2, Vec3};

use crate::Image;

/// Two colours in alternating cells.
pub(super) fn checker(cells: [u32; 2], a: Vec3, b: Vec3) -> Image {
    paint(512, |uv| {
        let (column, row) = (cell(uv.x, cells[0]), cell(uv.y, cells[1]));
        if (column + row) % 2 == 0 { a } else { b }
    })
}

/// Floor tiles: a checker whose tiles have a joint around them, a shade of their own and some grain.
pub(super) fn tiles(across: u32, a: Vec3, b: Vec3) -> Image {
    const JOINT: f32 = 0.025;
    paint(1024, |uv| {
        let (column, row) = (cell(uv.x, across), cell(uv.y, across));
        let inside = (uv * across as f32).fract();
        let to_edge = inside.min(Vec2::ONE - inside).min_element();
        if to_edge < JOINT {
            return 0.6 * a.min(b);
        }
        let color = if (column + row) % 2 == 0 { a } else { b };
        let shade = 0.88 + 0.16 * hash(column, row, 11);
        color * shade * (0.9 + 0.2 * noise(uv, 64, 5))
    })
}

/// A brick wall in running bond, eight bricks wide and eight rows high.
pub(super) fn bricks() -> Image {
    const ROWS: u32 = 8;
    const MORTAR: Vec3 = Vec3::new(0.80, 0.77, 0.72);
    paint(1024, |uv| {
        let row = cell(uv.y, ROWS);
        let shifted = (uv.x + 0.5 * (row % 2) as f32 / ROWS as f32).fract();
        let column = cell(shifted, ROWS);
        let inside = Vec2::new((shifted * ROWS as f32).fract(), (uv.y * ROWS as f32).fract());
        if inside.x < 0.06 || inside.y < 0.12 {
            return MORTAR * (0.9 + 0.1 * noise(uv, 128, 3));
        }
        let (dark, light) = (Vec3::new(0.45, 0.22, 0.17), Vec3::new(0.80, 0.52, 0.36));
        dark.lerp(light, hash(column, row, 7)) * (0.8 + 0.3 * noise(uv, 64, 9))
    })
}

/// Wavy veins of two colours, after Perlin's marble (SIGGRAPH 1985): the sine of noise.
pub(super) fn veins(waves: u32, a: Vec3, b: Vec3) -> Image {
    paint(512, |uv| {
        let turbulence = 0.65 * noise(uv, 6, 1) + 0.35 * noise(uv, 14, 2);
        let phase = std::f32::consts::TAU * (waves as f32 * uv.x + 1.8 * turbulence);
        // Steeper than a sine, so that edges can be seen.
        let mix = (0.5 + 1.1 * phase.sin()).clamp(0.0, 1.0);
        a.lerp(b, mix)
    })
}

/// Dots of one colour on another.
pub(super) fn dots(across: [u32; 2], dot: Vec3, ground: Vec3) -> Image {
    const RADIUS: f32 = 0.32;
    paint(512, |uv| {
        let row = cell(uv.y, across[1]);
        let x = uv.x * across[0] as f32 + 0.5 * (row % 2) as f32;
        let y = uv.y * across[1] as f32;
        let from_centre = Vec2::new(x.fract(), y.fract()) - 0.5;
        if from_centre.length() < RADIUS { dot } else { ground }
    })
}

/// For the rolling sphere: a beach ball of three colours, each gore cut into four and shifted from band to band, so
/// that rolling shows from every side; features as large as a quarter of the ball.
pub(super) fn ball(gores: u32, colors: [Vec3; 3]) -> Image {
    const BANDS: u32 = 4;
    paint(512, |uv| colors[((cell(uv.x, gores) + 2 * cell(uv.y, BANDS)) % 3) as usize])
}

/// A number in [0, 1) that looks random and depends on the arguments only.
pub(super) fn hash(x: u32, y: u32, seed: u32) -> f32 {
    let mut h =
        x.wrapping_mul(0x8da6_b343) ^ y.wrapping_mul(0xd816_3841) ^ seed.wrapping_mul(0xcb1a_b31f);
    // The finaliser of MurmurHash3 (Appleby): every bit of the input moves every bit of the output.
    h = (h ^ (h >> 16)).wrapping_mul(0x85eb_ca6b);
    h = (h ^ (h >> 13)).wrapping_mul(0xc2b2_ae35);
    h ^= h >> 16;
    (h >> 8) as f32 / (1u32 << 24) as f32
}

fn paint(side: u32, color: impl Fn(Vec2) -> Vec3) -> Image {
    let texel = |i: u32| {
        let (x, y) = (i % side, i / side);
        let uv = (Vec2::new(x as f32, y as f32) + 0.5) / side as f32;
        let [r, g, b] = color(uv).clamp(Vec3::ZERO, Vec3::ONE).to_array();
        [encode(r), encode(g), encode(b), 255]
    };
    Image { width: side, height: side, rgba: (0..side * side).map(texel).collect() }
}

fn encode(channel: f32) -> u8 {
    (channel * 255.0).round() as u8
}

/// Which of `count` equal parts of [0, 1) `x` lies in.
fn cell(x: f32, count: u32) -> u32 {
    ((x * count as f32) as u32).min(count - 1)
}

/// Value noise in [0, 1) on a `period` × `period` lattice that wraps around; smoothstep in between.
fn noise(uv: Vec2, period: u32, seed: u32) -> f32 {
    let scaled = uv * period as f32;
    let (x, y) = (cell(uv.x, period), cell(uv.y, period));
    let f = scaled.fract();
    let weight = f * f * (Vec2::splat(3.0) - 2.0 * f);
    let at = |dx, dy| hash((x + dx) % period, (y + dy) % period, seed);
    let top = at(0, 0) + (at(1, 0) - at(0, 0)) * weight.x;
    let bottom = at(0, 1) + (at(1, 1) - at(0, 1)) * weight.x;
    top + (bottom - top) * weight.y
}
