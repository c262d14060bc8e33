//! The rays that are traced: seen by a camera in four orders, and what follows from where they hit.

use std::f32::consts::TAU;

use frameless::{Request, Rng, Size};
use frameless_scene::{Geometry, Projection, Scene, State, View, look_at};
use frameless_trace::{Camera, Caster, Hit, Moment, Ray, SHADED, WAVE, World};
use glam::{Vec3, Vec3A};

/// Rays of one kind in one order.
pub(super) struct Set {
    pub(super) name: String,
    pub(super) rays: Vec<Ray>,
    pub(super) asks: Asks,
}

/// What of each ray is asked.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Asks {
    /// Where it first hits.
    Nearest,
    /// Whether anything is hit at t < 1.
    Blocked,
}

/// Rays of a clustered batch, as long as those of the loop.
const BATCH: usize = 1024;
/// Pixels per side of the square that such a batch is in.
const CLUSTER: u32 = 64;
/// Pixels per side of the tiles in which it is sorted.
const TILE: u32 = 16;

/// All sets of a scene: as many rays in each as the picture has pixels, or as of them hit something.
pub(super) fn of_scene(world: &World, size: Size) -> Vec<Set> {
    let moment = world.moment(0.0);
    let camera = Camera::new(&view(world, &moment), size);
    let mut rng = Rng::new(7);
    let scan: Vec<u32> = (0..size.pixels() as u32).collect();
    let random = shuffled(&mut rng, &scan);
    let (clustered, sorted) = clusters(&mut rng, size);
    let seen = |name: &str, pixels: &[u32]| {
        let rays = pixels.iter().map(|&pixel| camera.ray(&Request::centre(pixel))).collect();
        Set { name: name.into(), rays, asks: Asks::Nearest }
    };
    let mut sets = vec![
        seen("primary-scan", &scan),
        seen("primary-random", &random),
        seen("primary-clustered", &clustered),
        seen("primary-sorted", &sorted),
    ];
    sets.extend(after_hits(world, &moment, &sets[1].rays, &mut rng));
    sets
}

/// Of the scene's own camera; of a file that has none, from where there is most room towards the middle: a camera that was added would see
/// the walls from outside.
fn view(world: &World, moment: &Moment) -> View {
    let (scene, state) = (world.scene(), moment.state());
    if !scene.notes.iter().any(|note| note.starts_with("no camera")) {
        return scene.view_at(state, 0);
    }
    let Some(bounds) = scene.bounds_at(state) else { return scene.view_at(state, 0) };
    let part = |k: u32| (k as f32 + 0.5) / 5.0;
    let places = (0..25).map(|k| {
        let share = Vec3::new(part(k % 5), 0.55, part(k / 5));
        bounds.min + share * (bounds.max - bounds.min)
    });
    // Where there is most room: the way until something is hit is longest on average, and everything is inside.
    let mut rng = Rng::new(9);
    let directions: Vec<Vec3A> = (0..64).map(|_| unit(&mut rng)).collect();
    let mut caster = world.caster(moment);
    let mut room = |place: Vec3| -> f32 {
        let way = |&direction: &Vec3A| {
            let hit = caster.nearest(&Ray { origin: place.into(), direction });
            hit.map_or(0.0, |hit| hit.t)
        };
        directions.iter().map(way).sum()
    };
    let rooms: Vec<(Vec3, f32)> = places.map(|place| (place, room(place))).collect();
    let eye =
        rooms.iter().max_by(|a, b| a.1.total_cmp(&b.1)).map_or(bounds.centre(), |most| most.0);
    let level = Vec3::new(bounds.centre().x, eye.y, bounds.centre().z);
    let world_from_camera = look_at(eye, level, Vec3::Y);
    View { world_from_camera, projection: Projection::Perspective { yfov_rad: 1.0 } }
}

/// What the camera sees of instances, in random order.
pub(super) fn of_instances(world: &World, count: u32, size: Size) -> Set {
    let moment = world.moment(0.0);
    let camera = Camera::new(&world.scene().view_at(moment.state(), 0), size);
    let scan: Vec<u32> = (0..size.pixels() as u32).collect();
    let random = shuffled(&mut Rng::new(8), &scan);
    let rays = random.iter().map(|&pixel| camera.ray(&Request::centre(pixel))).collect();
    Set { name: format!("instances-{count}"), rays, asks: Asks::Nearest }
}

fn shuffled(rng: &mut Rng, all: &[u32]) -> Vec<u32> {
    let mut all = all.to_vec();
    for last in (1..all.len()).rev() {
        all.swap(last, rng.below(last as u32 + 1) as usize);
    }
    all
}

/// Batches of random pixels, each within a random square; and the same batches sorted by tile, along a Morton curve in each.
fn clusters(rng: &mut Rng, size: Size) -> (Vec<u32>, Vec<u32>) {
    let (mut clustered, mut sorted) = (Vec::new(), Vec::new());
    let (width, height) = (size.width.min(CLUSTER), size.height.min(CLUSTER));
    while clustered.len() < size.pixels() {
        let left = rng.below(size.width - width + 1);
        let top = rng.below(size.height - height + 1);
        let mut pixel = || size.index(left + rng.below(width), top + rng.below(height));
        let mut batch: Vec<u32> = (0..BATCH).map(|_| pixel()).collect();
        clustered.extend(&batch);
        batch.sort_by_key(|&pixel| {
            let (x, y) = size.xy(pixel);
            (y / TILE, x / TILE, morton(x % TILE, y % TILE))
        });
        sorted.extend(&batch);
    }
    (clustered, sorted)
}

/// The bits of two numbers below 16, interleaved.
fn morton(x: u32, y: u32) -> u32 {
    (0..4).map(|bit| (x >> bit & 1) << (2 * bit) | (y >> bit & 1) << (2 * bit + 1)).sum()
}

/// To a light half-way between the eye and the middle of what it sees; mirrored; and in random directions, by the cosine.
fn after_hits(world: &World, moment: &Moment, seen: &[Ray], rng: &mut Rng) -> [Set; 3] {
    let mut caster = world.caster(moment);
    let hits: Vec<(Ray, Hit)> =
        seen.iter().filter_map(|&ray| Some((ray, caster.nearest(&ray)?))).collect();
    let surfaces: Vec<Surface> = hits
        .iter()
        .map(|(ray, hit)| Surface::of(world.scene(), moment.state(), ray, hit))
        .collect();
    let middle =
        surfaces.iter().map(|surface| surface.place).sum::<Vec3A>() / surfaces.len().max(1) as f32;
    let light = seen.first().map_or(Vec3A::ZERO, |ray| 0.5 * (ray.origin + middle));
    let towards =
        |surface: &Surface| Ray { origin: surface.place, direction: light - surface.place };
    let shadow = surfaces.iter().map(towards).collect();
    let mirrored = surfaces.iter().zip(&hits).map(|(surface, (ray, _))| {
        let d = ray.direction;
        Ray { origin: surface.place, direction: d - 2.0 * d.dot(surface.normal) * surface.normal }
    });
    let reflection = mirrored.collect();
    let scattered = |surface: &Surface| {
        let direction = (surface.normal + unit(rng)).normalize_or(surface.normal);
        Ray { origin: surface.place, direction }
    };
    let diffuse = surfaces.iter().map(scattered).collect();
    let set = |name: &str, rays, asks| Set { name: name.into(), rays, asks };
    [
        set("shadow", shadow, Asks::Blocked),
        set("reflection", reflection, Asks::Nearest),
        set("diffuse", diffuse, Asks::Nearest),
    ]
}

/// Where a ray has hit, a little above it on the ray's side.
struct Surface {
    place: Vec3A,
    normal: Vec3A,
}

impl Surface {
    fn of(scene: &Scene, state: &State, ray: &Ray, hit: &Hit) -> Surface {
        /// Of the largest coordinate: far more than rounding, and less than anything seen.
        const ABOVE: f32 = 1e-4;
        let place = ray.origin + hit.t * ray.direction;
        let [a, b, c] = corners(scene, state, hit);
        let normal = (b - a).cross(c - a).normalize_or(Vec3::Y);
        let normal = Vec3A::from(normal);
        let normal = if normal.dot(ray.direction) > 0.0 { -normal } else { normal };
        let above = ABOVE * place.abs().max_element().max(1.0);
        Surface { place: place + above * normal, normal }
    }
}

fn corners(scene: &Scene, state: &State, hit: &Hit) -> [Vec3; 3] {
    let place = scene.world_from_instance(hit.instance as usize, state);
    let geometry = scene.instances[hit.instance as usize].geometry;
    match &scene.geometries[geometry as usize] {
        Geometry::Mesh(mesh) => mesh.triangles[hit.primitive as usize]
            .map(|vertex| place.transform_point3(mesh.positions[vertex as usize])),
        Geometry::Sphere { .. } => [Vec3::ZERO; 3],
    }
}

/// Uniform on the sphere (Archimedes).
fn unit(rng: &mut Rng) -> Vec3A {
    let z = 2.0 * rng.unit_f32() - 1.0;
    let (sin, cos) = (TAU * rng.unit_f32()).sin_cos();
    let r = (1.0 - z * z).max(0.0).sqrt();
    Vec3A::new(r * cos, r * sin, z)
}

/// Traces every ray of the set with our kernel, one by one; t, or how far the light is where nothing is in its way.
pub(super) fn trace_ours(caster: &mut Caster<'_>, set: &Set, found: &mut [f32]) {
    match set.asks {
        Asks::Nearest => {
            for (ray, found) in set.rays.iter().zip(found) {
                *found = caster.nearest(ray).map_or(f32::INFINITY, |hit| hit.t);
            }
        }
        Asks::Blocked => {
            for (ray, found) in set.rays.iter().zip(found) {
                *found = if caster.is_blocked(ray, 1.0) { 0.0 } else { 1.0 };
            }
        }
    }
}

/// Room for what is found of a set by [`trace_together`].
pub(super) struct Together {
    hits: Vec<Option<Hit>>,
    blocked: Vec<bool>,
}

impl Together {
    pub(super) fn of(set: &Set) -> Together {
        Together { hits: vec![None; set.rays.len()], blocked: vec![false; set.rays.len()] }
    }

    /// As from [`trace_ours`].
    pub(super) fn found(&self, set: &Set) -> Vec<f32> {
        match set.asks {
            Asks::Nearest => {
                self.hits.iter().map(|hit| hit.map_or(f32::INFINITY, |hit| hit.t)).collect()
            }
            Asks::Blocked => {
                self.blocked.iter().map(|&blocked| if blocked { 0.0 } else { 1.0 }).collect()
            }
        }
    }
}

/// The same as the renderer does it: as many at once, in the order that they are in.
pub(super) fn trace_together(caster: &mut Caster<'_>, set: &Set, found: &mut Together) {
    match set.asks {
        Asks::Nearest => {
            for (rays, hits) in set.rays.chunks(WAVE).zip(found.hits.chunks_mut(WAVE)) {
                caster.nearest_of(rays, hits);
            }
        }
        Asks::Blocked => {
            for (rays, blocked) in set.rays.chunks(SHADED).zip(found.blocked.chunks_mut(SHADED)) {
                caster.is_blocked_of(rays, 1.0, blocked);
            }
        }
    }
}
