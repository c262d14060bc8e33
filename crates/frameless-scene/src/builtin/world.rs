//! What all built-in scenes share: a walled court with things standing in it, a light and a camera.

use std::f32::consts::TAU;

use glam::{Quat, Vec3};

use super::builder::{Builder, add_rectangle};
use super::textures::{bricks, checker, dots, hash, tiles, veins};
use crate::{Mesh, Transform};

/// Where the lamp hangs unless a scene moves it.
pub(super) const LIGHT_POSITION: Vec3 = Vec3::new(3.5, 8.0, 5.0);
/// W/sr. At about 8 m a white surface facing the lamp then has a radiance of 0.75.
pub(super) const LIGHT_INTENSITY: Vec3 = Vec3::new(155.0, 149.0, 138.0);
/// Distance of the camera from the axis around which it orbits, in metres.
pub(super) const CAMERA_DISTANCE: f32 = 8.8;

/// Half the side of the court and the height of its walls, in metres.
const COURT: (f32, f32) = (12.0, 5.0);
const AMBIENT: Vec3 = Vec3::new(0.20, 0.21, 0.23);
const SKY: [Vec3; 2] = [Vec3::new(0.62, 0.66, 0.68), Vec3::new(0.12, 0.30, 0.66)];
const YFOV_RAD: f32 = 50.0 * TAU / 360.0;
/// Camera above the middle it looks at, and the middle above the floor, in metres.
const CAMERA_RISE: f32 = 1.5;
const MIDDLE_HEIGHT: f32 = 1.1;

/// The nodes that a scene may move.
pub(super) struct World {
    /// Turns around the middle of the court and carries the camera.
    pub(super) orbit: u32,
    /// Turns the camera on the spot.
    pub(super) pan: u32,
    pub(super) light: u32,
    /// Materials for further things, each with a texture of its own.
    pub(super) materials: Vec<u32>,
}

impl World {
    pub(super) fn build(builder: &mut Builder) -> World {
        builder.backdrop(AMBIENT, SKY);
        let (orbit, pan) = camera(builder);
        let light = builder.point_light(LIGHT_POSITION, LIGHT_INTENSITY);
        court(builder);
        let materials = materials(builder);
        furniture(builder, &materials);
        World { orbit, pan, light, materials }
    }

    /// More furniture in the front of the court, where nothing moves.
    pub(super) fn fill_front(&self, builder: &mut Builder) {
        /// Numbers of pieces that [`furniture`] has not used, with x and z of where they stand.
        const PIECES: [(u32, f32, f32); 7] = [
            (17, -1.2, 2.3),
            (18, 1.5, 2.9),
            (19, 4.2, 2.2),
            (20, -3.8, 2.9),
            (21, -2.3, 4.6),
            (22, 0.1, 4.3),
            (23, 3.1, 4.6),
        ];
        for (i, x, z) in PIECES {
            piece(builder, &self.materials, i, Vec3::new(x, 0.0, z));
        }
    }
}

/// A camera on a rig: orbit → pan → camera.
fn camera(builder: &mut Builder) -> (u32, u32) {
    let at = |translation| Transform { translation, ..Transform::IDENTITY };
    let orbit = builder.node("orbit", None, at(Vec3::Y * MIDDLE_HEIGHT));
    let arm = Vec3::new(0.0, CAMERA_RISE, CAMERA_DISTANCE);
    let pan = builder.node("pan", Some(orbit), at(arm));
    let pitch = Quat::from_rotation_x(-(CAMERA_RISE / CAMERA_DISTANCE).atan());
    let rest = Transform { rotation: pitch, ..Transform::IDENTITY };
    let camera = builder.node("camera", Some(pan), rest);
    builder.camera(camera, YFOV_RAD);
    (orbit, pan)
}

/// Tiled floor, four brick walls, open to the sky.
fn court(builder: &mut Builder) {
    let floor = builder.matte(tiles(4, Vec3::new(0.86, 0.82, 0.74), Vec3::new(0.36, 0.43, 0.52)));
    let wall = builder.matte(bricks());
    let (half, height) = COURT;
    let mut mesh = Mesh::default();
    let ground = (Vec3::ZERO, Vec3::X * half, Vec3::NEG_Z * half);
    add_rectangle(&mut mesh, floor, ground, 4.0);
    let up = Vec3::Y * 0.5 * height;
    for inward in [Vec3::X, Vec3::NEG_X, Vec3::Z, Vec3::NEG_Z] {
        let side = (up - inward * half, Vec3::Y.cross(inward) * half, up);
        add_rectangle(&mut mesh, wall, side, 4.0);
    }
    builder.mesh("court", mesh);
    let posts = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
    for (x, z) in posts {
        let centre = Vec3::new(x * (half - 0.5), 0.5 * height + 0.4, z * (half - 0.5));
        let post = (centre, Vec3::new(0.7, 0.5 * height + 0.4, 0.7), 0.0);
        builder.block("corner post", floor, post, 4.0);
    }
}

fn materials(builder: &mut Builder) -> Vec<u32> {
    let rgb = Vec3::new;
    let cream = rgb(0.93, 0.89, 0.78);
    [
        checker([12, 6], rgb(0.84, 0.24, 0.19), cream),
        veins(3, rgb(0.10, 0.28, 0.42), rgb(0.84, 0.87, 0.82)),
        dots([8, 4], rgb(0.95, 0.78, 0.22), rgb(0.20, 0.24, 0.46)),
        checker([8, 8], rgb(0.16, 0.46, 0.42), rgb(0.90, 0.82, 0.52)),
        veins(4, rgb(0.55, 0.17, 0.33), rgb(0.93, 0.72, 0.52)),
        dots([6, 6], rgb(0.80, 0.30, 0.22), rgb(0.90, 0.87, 0.80)),
        checker([16, 8], rgb(0.22, 0.20, 0.26), rgb(0.72, 0.76, 0.80)),
    ]
    .into_iter()
    .map(|image| builder.matte(image))
    .collect()
}

/// Blocks and spheres on a sunflower's spiral (Vogel 1979), flattened so that the front of the court (z > 1.8)
/// stays free for what moves.
fn furniture(builder: &mut Builder, materials: &[u32]) {
    const COUNT: u32 = 16;
    const MIDDLE: Vec3 = Vec3::new(0.0, 0.0, -2.0);
    let golden_angle = TAU * (1.0 - 2.0 / (1.0 + 5f32.sqrt()));
    for i in 0..COUNT {
        let radius = ((i as f32 + 0.5) / COUNT as f32).sqrt();
        let (sin, cos) = (golden_angle * i as f32).sin_cos();
        let place = MIDDLE + Vec3::new(6.2 * radius * cos, 0.0, 3.1 * radius * sin);
        piece(builder, materials, i, place);
    }
}

/// Piece number `i` of the furniture: a block or a sphere of random size that stands on `place`.
fn piece(builder: &mut Builder, materials: &[u32], i: u32, place: Vec3) {
    let random = |what| hash(i, what, 77);
    let material = materials[i as usize % materials.len()];
    if i.is_multiple_of(2) {
        let half =
            Vec3::new(0.35 + 0.25 * random(0), 0.55 + 0.75 * random(1), 0.35 + 0.25 * random(2));
        let block = (place + Vec3::Y * half.y, half, 3.0 * random(3));
        builder.block("block", material, block, 1.6);
    } else {
        let radius = 0.45 + 0.3 * random(4);
        builder.sphere("ball", material, place + Vec3::Y * radius, radius);
    }
}
