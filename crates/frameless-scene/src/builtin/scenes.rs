//! The eight scenes.

use std::f64::consts::TAU;

use glam::{DVec3, Quat, Vec3};

use super::builder::Builder;
use super::motion::{Rolling, along, jumps, spin, yaw};
use super::textures::{ball, checker, hash};
use super::world::{CAMERA_DISTANCE, LIGHT_INTENSITY, LIGHT_POSITION, World};
use crate::{Channel, Scene, Target};

/// Of the rolling sphere, in metres: 60 pixels of a picture with 384 rows.
const SPHERE_RADIUS: f32 = 0.86;
/// Half the way of the rolling sphere, in metres.
const SPHERE_REACH: f64 = 2.7;
/// Seconds from one end of the way to the other: 3.6 m/s, 250 pixels of 384 rows per second.
const SPHERE_CROSSING_SECS: f64 = 1.5;
/// Seconds in which the camera goes round once: 0.30 rad/s.
const ORBIT_SECS: f64 = 21.0;
/// Keys per turn of whatever goes round; see [`super::motion`] for the error.
const KEYS_PER_TURN: u32 = 32;

pub(super) fn sphere() -> Scene {
    let mut builder = Builder::new("sphere", 2.0 * SPHERE_CROSSING_SECS);
    World::build(&mut builder);
    let sphere = rolling_sphere(&mut builder);
    for channel in sphere.through(&to_and_fro(1)) {
        builder.animate(channel);
    }
    builder.finish()
}

pub(super) fn many() -> Scene {
    let mut builder = Builder::new("many", 8.0);
    let world = World::build(&mut builder);
    movers(&mut builder, &world, 40, 0.85);
    builder.finish()
}

pub(super) fn orbit() -> Scene {
    let mut builder = Builder::new("orbit", ORBIT_SECS);
    let world = World::build(&mut builder);
    world.fill_front(&mut builder);
    orbit_and_pan(&mut builder, &world);
    builder.finish()
}

/// Each step carries the camera further around; every other step pans it as well, first one way, then back.
pub(super) fn stopgo() -> Scene {
    const STEP_SECS: f64 = 0.7;
    const MOVING_SECS: f64 = 0.35;
    const STEPS: u32 = 28;
    const PAN_RAD: f64 = 0.1;
    let duration_secs = STEP_SECS * f64::from(STEPS);
    let mut builder = Builder::new("stopgo", duration_secs);
    let world = World::build(&mut builder);
    world.fill_front(&mut builder);
    // Number of steps done at a time, and steps per second: smoothstep while moving, then rest.
    let steps = |secs: f64| {
        // The keys are multiples of 1/16 of a step, up to rounding.
        let sixteenths = (secs / STEP_SECS * 16.0).round();
        let (done, part) = ((sixteenths / 16.0).floor(), (sixteenths / 16.0).fract());
        let u = (part * STEP_SECS / MOVING_SECS).min(1.0);
        (done, u * u * (3.0 - 2.0 * u), 6.0 * u * (1.0 - u) / MOVING_SECS)
    };
    let turn = TAU / f64::from(STEPS);
    builder.animate(yaw(world.orbit, duration_secs, 16 * STEPS, |secs| {
        let (done, moved, speed) = steps(secs);
        (turn * (done + moved), turn * speed)
    }));
    builder.animate(yaw(world.pan, duration_secs, 16 * STEPS, |secs| {
        let (done, moved, speed) = steps(secs);
        match done as u32 % 4 {
            0 => (PAN_RAD * moved, PAN_RAD * speed),
            1 => (PAN_RAD, 0.0),
            2 => (PAN_RAD * (1.0 - moved), -PAN_RAD * speed),
            _ => (0.0, 0.0),
        }
    }));
    builder.finish()
}

pub(super) fn sudden() -> Scene {
    const LIGHT_JUMPS_SECS: f32 = 1.0;
    const BOX_TELEPORTS_SECS: f32 = 1.6;
    const NIGHT_POSITION: Vec3 = Vec3::new(-4.5, 7.0, 3.5);
    const NIGHT_INTENSITY: Vec3 = Vec3::new(70.0, 100.0, 165.0);
    let mut builder = Builder::new("sudden", 4.0);
    let world = World::build(&mut builder);
    let night = LIGHT_JUMPS_SECS;
    let position = Target::Translation(world.light);
    builder.animate(jumps(position, [(0.0, LIGHT_POSITION), (night, NIGHT_POSITION)]));
    let intensity = Target::LightIntensity(0);
    builder.animate(jumps(intensity, [(0.0, LIGHT_INTENSITY), (night, NIGHT_INTENSITY)]));
    let texture = checker([4, 4], Vec3::new(0.86, 0.20, 0.18), Vec3::new(0.93, 0.92, 0.86));
    let material = builder.matte(texture);
    let (here, there) = (Vec3::new(2.4, 1.0, 2.0), Vec3::new(-0.8, 1.0, 3.0));
    let node = builder.block("box", material, (here, Vec3::new(0.8, 1.0, 0.8), 0.5), 2.0);
    let place = Target::Translation(node);
    builder.animate(jumps(place, [(0.0, here), (BOX_TELEPORTS_SECS, there)]));
    builder.finish()
}

pub(super) fn shadow() -> Scene {
    const DURATION_SECS: f64 = 7.0;
    const REFLECTANCE: Vec3 = Vec3::new(0.90, 0.91, 0.92);
    let mut builder = Builder::new("shadow", DURATION_SECS);
    let world = World::build(&mut builder);
    builder.animate(circling_light(&world, DURATION_SECS, 1));
    let mirror = builder.mirror(REFLECTANCE);
    builder.sphere("mirror ball", mirror, Vec3::new(0.5, 1.25, 2.6), 1.25);
    framed_mirror(&mut builder, mirror);
    let texture = ball(6, [Vec3::new(0.85, 0.2, 0.2), Vec3::new(0.9, 0.85, 0.8), Vec3::ZERO]);
    let material = builder.matte(texture);
    let behind = Vec3::new(0.0, 1.9, CAMERA_DISTANCE + 1.5);
    let node = builder.sphere("behind the camera", material, behind, 0.8);
    let reach = DVec3::new(1.9, 0.5, 0.4);
    let mover = Lissajous { centre: behind.as_dvec3(), reach, cycles: 2, phase: 0.0 };
    builder.animate(mover.channel(node, DURATION_SECS));
    builder.animate(spin(node, DURATION_SECS, Vec3::Y, 3));
    builder.finish()
}

/// The sphere of [`sphere`] comes to rest at 0.8 s. Long after, it goes back, so that the loop has no jump.
pub(super) fn settle() -> Scene {
    const DURATION_SECS: f64 = 20.0;
    const MOVING_SECS: f64 = 0.8;
    let mut builder = Builder::new("settle", DURATION_SECS);
    World::build(&mut builder);
    let sphere = rolling_sphere(&mut builder);
    let speed = 2.0 * SPHERE_REACH / SPHERE_CROSSING_SECS;
    let rest = -SPHERE_REACH + speed * MOVING_SECS;
    let stops = [
        (0.0, -SPHERE_REACH),
        (MOVING_SECS, rest),
        (DURATION_SECS - MOVING_SECS, rest),
        (DURATION_SECS, -SPHERE_REACH),
    ];
    for channel in sphere.through(&stops) {
        builder.animate(channel);
    }
    builder.finish()
}

pub(super) fn mix() -> Scene {
    let mut builder = Builder::new("mix", ORBIT_SECS);
    let world = World::build(&mut builder);
    orbit_and_pan(&mut builder, &world);
    builder.animate(circling_light(&world, ORBIT_SECS, 2));
    let sphere = rolling_sphere(&mut builder);
    for channel in sphere.through(&to_and_fro(7)) {
        builder.animate(channel);
    }
    // Above the sphere.
    movers(&mut builder, &world, 10, 3.1);
    builder.finish()
}

/// A standing mirror on the left, turned so that the camera sees in it what is behind itself.
fn framed_mirror(builder: &mut Builder, mirror: u32) {
    const YAW_RAD: f32 = 0.42;
    const HALF: Vec3 = Vec3::new(1.0, 1.6, 0.03);
    const FRAME: Vec3 = Vec3::new(0.12, 0.12, 0.0);
    let centre = Vec3::new(-2.9, 1.75, 2.4);
    let ahead = Quat::from_rotation_y(YAW_RAD) * Vec3::Z;
    builder.block("mirror", mirror, (centre, HALF, YAW_RAD), 1.0);
    let (a, b) = (Vec3::new(0.85, 0.66, 0.28), Vec3::new(0.42, 0.26, 0.14));
    let wood = builder.matte(checker([8, 8], a, b));
    // A little behind the glass, so that no two faces lie in one plane.
    let behind = (centre - 0.02 * ahead, HALF + FRAME, YAW_RAD);
    builder.block("mirror's frame", wood, behind, 1.2);
}

/// The sketch's sphere, between two blocks from which it bounces.
fn rolling_sphere(builder: &mut Builder) -> Rolling {
    let rgb = Vec3::new;
    let colors = [rgb(0.90, 0.32, 0.16), rgb(0.95, 0.78, 0.24), rgb(0.16, 0.42, 0.62)];
    let material = builder.matte(ball(6, colors));
    let centre = Vec3::new(0.0, SPHERE_RADIUS, 3.0);
    let node = builder.sphere("sphere", material, centre, SPHERE_RADIUS);
    let bumper = builder.matte(checker([2, 2], rgb(0.92, 0.80, 0.20), rgb(0.16, 0.16, 0.18)));
    let half = Vec3::new(0.25, SPHERE_RADIUS, 0.8);
    for side in [-1.0, 1.0] {
        let x = side * (SPHERE_REACH as f32 + SPHERE_RADIUS + half.x);
        let place = Vec3::new(x, half.y, centre.z);
        builder.block("bumper", bumper, (place, half, 0.0), 0.8);
    }
    let tilt = Quat::from_rotation_x(1.0) * Quat::from_rotation_z(0.5);
    Rolling { node, radius: SPHERE_RADIUS, centre, tilt }
}

/// Stops of the sphere that crosses `2 · rounds` times, from the left.
fn to_and_fro(rounds: u32) -> Vec<(f64, f64)> {
    let side =
        |crossing: u32| if crossing.is_multiple_of(2) { -SPHERE_REACH } else { SPHERE_REACH };
    (0..=2 * rounds).map(|i| (SPHERE_CROSSING_SECS * f64::from(i), side(i))).collect()
}

/// Once around, looking left and right of the middle four times.
fn orbit_and_pan(builder: &mut Builder, world: &World) {
    const PAN_RAD: f64 = 0.26;
    const PANS: u32 = 4;
    builder.animate(spin(world.orbit, ORBIT_SECS, Vec3::Y, 1));
    let rate = TAU * f64::from(PANS) / ORBIT_SECS;
    builder.animate(yaw(world.pan, ORBIT_SECS, PANS * KEYS_PER_TURN, |secs| {
        let (sin, cos) = (rate * secs).sin_cos();
        (PAN_RAD * sin, PAN_RAD * rate * cos)
    }));
}

/// A light that goes round `turns` times above the front of the court.
fn circling_light(world: &World, duration_secs: f64, turns: u32) -> Channel {
    const CENTRE: DVec3 = DVec3::new(0.0, 7.5, 2.8);
    const REACH: (f64, f64) = (4.2, 2.5);
    let rate = TAU * f64::from(turns) / duration_secs;
    along(world.light, duration_secs, turns * KEYS_PER_TURN, |secs| {
        let (sin, cos) = (rate * secs).sin_cos();
        let position = CENTRE + DVec3::new(REACH.0 * cos, 0.0, REACH.1 * sin);
        (position, rate * DVec3::new(-REACH.0 * sin, 0.0, REACH.1 * cos))
    })
}

/// The path centre + (x cos a, y sin 2a, z sin a) with a = phase + cycles · 2π t / duration.
struct Lissajous {
    centre: DVec3,
    reach: DVec3,
    cycles: i32,
    phase: f64,
}

impl Lissajous {
    fn channel(&self, node: u32, duration_secs: f64) -> Channel {
        let rate = TAU * f64::from(self.cycles) / duration_secs;
        let keys = self.cycles.unsigned_abs() * KEYS_PER_TURN;
        along(node, duration_secs, keys, |secs| {
            let a = self.phase + rate * secs;
            let place = DVec3::new(a.cos(), (2.0 * a).sin(), a.sin());
            let change = DVec3::new(-a.sin(), 2.0 * (2.0 * a).cos(), a.cos());
            (self.centre + self.reach * place, rate * self.reach * change)
        })
    }
}

/// Small spheres and boxes that fly figures of eight at 1.5 to 4.5 m/s and spin, `lowest` or more above the
/// floor on average.
fn movers(builder: &mut Builder, world: &World, count: u32, lowest: f32) {
    let duration_secs = builder.duration_secs();
    for i in 0..count {
        let random = |what: u32, low: f32, high: f32| low + (high - low) * hash(i, what, 40);
        let reach = f64::from(random(0, 0.5, 1.4));
        let size = random(1, 0.15, 0.27);
        let centre = Vec3::new(
            random(2, -3.2, 3.2),
            lowest + random(3, 0.0, 1.0) * (3.9 - lowest),
            random(4, 0.4, 4.0),
        );
        let tint = Vec3::new(random(5, 0.5, 1.0), random(6, 0.5, 1.0), random(7, 0.5, 1.0));
        let material = world.materials[i as usize % world.materials.len()];
        let material = builder.tinted(material, tint);
        let node = if i % 3 == 2 {
            let half = Vec3::splat(size * 0.85);
            builder.block("flying box", material, (centre, half, 0.0), 4.0 * size)
        } else {
            builder.sphere("flying ball", material, centre, size)
        };
        let speed = f64::from(random(8, 1.5, 4.5));
        let cycles = (speed * duration_secs / (TAU * reach)).round().max(1.0) as i32;
        let direction = if hash(i, 9, 40) < 0.5 { -1 } else { 1 };
        let path = Lissajous {
            centre: centre.as_dvec3(),
            reach: reach * DVec3::new(1.0, 0.35, 0.7),
            cycles: direction * cycles,
            phase: TAU * f64::from(hash(i, 10, 40)),
        };
        builder.animate(path.channel(node, duration_secs));
        let axis = Vec3::new(random(11, -1.0, 1.0), 1.0, random(12, -1.0, 1.0)).normalize();
        builder.animate(spin(node, duration_secs, axis, direction * cycles));
    }
}
