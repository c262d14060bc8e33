//! A scene made by code, for rays: a hall full of displaced, overlapping bodies, fluted columns and bushes, of more than a million triangles.

use std::f32::consts::{PI, TAU};

use frameless::Rng;
use frameless_scene::{
    Camera, Geometry, Instance, Material, Mesh, Node, Projection, Scene, Transform, look_at,
};
use glam::{Affine3A, EulerRot, Quat, Vec3};

/// Half the hall's width, height and length in metres.
const HALF: Vec3 = Vec3::new(8.0, 3.5, 12.0);
const BODIES: u32 = 66;
const COLUMNS: u32 = 14;
const BUSHES: u32 = 24;
const LEAVES: u32 = 6_000;

/// The hall. `detail` of 1 is the whole of it; less makes it coarser, for tests.
pub(super) fn hall(detail: f32) -> Scene {
    let mut rng = Rng::new(5);
    let mut scene = empty("generated");
    let fine = |count: f32| ((count * detail.sqrt()) as u32).max(4);
    for wall in 0..6 {
        add(&mut scene, wall_mesh(wall, fine(84.0)), Transform::IDENTITY);
    }
    for _ in 0..BODIES {
        let mesh = body(&mut rng, fine(80.0), fine(80.0));
        let at = random_place(&mut rng, (0.35, 1.5));
        add(&mut scene, mesh, at);
    }
    for column in 0..COLUMNS {
        let x = if column.is_multiple_of(2) { -5.0 } else { 5.0 };
        let z = -10.0 + 20.0 * (column / 2) as f32 / (COLUMNS / 2 - 1) as f32;
        let at = Transform { translation: Vec3::new(x, 0.0, z), ..Transform::IDENTITY };
        add(&mut scene, column_mesh(fine(96.0), fine(40.0)), at);
    }
    for _ in 0..BUSHES {
        let mesh = bush(&mut rng, (LEAVES as f32 * detail) as u32);
        let at = random_place(&mut rng, (0.6, 1.4));
        add(&mut scene, mesh, at);
    }
    look(&mut scene, Vec3::new(0.4, 0.5, 11.2), Vec3::new(0.0, -0.6, 0.0), 1.1);
    scene
}

/// `count` times the same body of 70,000 triangles, and where each of them stands.
pub(super) fn swarm(count: u32, detail: f32) -> Scene {
    let mut rng = Rng::new(6);
    let mut scene = empty("generated");
    let side = (187.0 * detail.sqrt()) as u32;
    let mesh = body(&mut rng, side.max(4), side.max(4));
    scene.geometries.push(Geometry::Mesh(mesh));
    // As dense for any number of them.
    let spread = 1.2 * (count as f32).cbrt();
    for _ in 0..count {
        let mut part = || (2.0 * rng.unit_f32() - 1.0) * if count == 1 { 0.0 } else { spread };
        let translation = Vec3::new(part(), part(), part());
        let rest = Transform {
            translation,
            rotation: random_turn(&mut rng),
            scale: Vec3::splat(0.5 + 0.5 * rng.unit_f32()),
        };
        let node = scene.nodes.len() as u32;
        scene.nodes.push(Node { name: "body".into(), parent: None, rest });
        scene.instances.push(Instance { node, geometry: 0 });
    }
    look(&mut scene, Vec3::new(0.3, 0.2, 1.0) * (2.0 * spread + 1.0), Vec3::ZERO, 0.9);
    scene
}

fn empty(name: &str) -> Scene {
    let materials = vec![Material::default()];
    Scene { name: name.into(), materials, ambient: Vec3::ONE, ..Scene::default() }
}

fn add(scene: &mut Scene, mesh: Mesh, rest: Transform) {
    let (node, geometry) = (scene.nodes.len() as u32, scene.geometries.len() as u32);
    scene.nodes.push(Node { name: "body".into(), parent: None, rest });
    scene.geometries.push(Geometry::Mesh(mesh));
    scene.instances.push(Instance { node, geometry });
}

fn look(scene: &mut Scene, from: Vec3, to: Vec3, yfov_rad: f32) {
    let rest = transform(&look_at(from, to, Vec3::Y));
    let node = scene.nodes.len() as u32;
    scene.nodes.push(Node { name: "camera".into(), parent: None, rest });
    let projection = Projection::Perspective { yfov_rad };
    scene.cameras.push(Camera { name: "camera".into(), node, projection });
}

fn transform(affine: &Affine3A) -> Transform {
    let (scale, rotation, translation) = affine.to_scale_rotation_translation();
    Transform { translation, rotation, scale }
}

fn random_turn(rng: &mut Rng) -> Quat {
    let [a, b, c] = [(); 3].map(|()| TAU * rng.unit_f32());
    Quat::from_euler(EulerRot::YXZ, a, b, c)
}

/// Somewhere in the hall, but not before the camera's eyes.
fn random_place(rng: &mut Rng, (least, most): (f32, f32)) -> Transform {
    let mut part = |half: f32| (2.0 * rng.unit_f32() - 1.0) * 0.85 * half;
    let translation = Vec3::new(part(HALF.x), part(HALF.y), part(HALF.z) - 1.5);
    let scale = Vec3::splat(least + (most - least) * rng.unit_f32());
    Transform { translation, rotation: random_turn(rng), scale }
}

/// A mesh of two triangles per cell over (u, v) in [0, 1]².
fn grid(columns: u32, rows: u32, place: impl Fn(f32, f32) -> Vec3) -> Mesh {
    let mut mesh = Mesh::default();
    for row in 0..=rows {
        for column in 0..=columns {
            mesh.positions.push(place(column as f32 / columns as f32, row as f32 / rows as f32));
        }
    }
    for (row, column) in (0..rows).flat_map(|row| (0..columns).map(move |column| (row, column))) {
        let a = row * (columns + 1) + column;
        let b = a + columns + 1;
        mesh.triangles.extend([[a, a + 1, b + 1], [a, b + 1, b]]);
    }
    mesh.triangle_materials.resize(mesh.triangles.len(), 0);
    mesh
}

/// A side of the hall, a little uneven.
fn wall_mesh(side: u32, cells: u32) -> Mesh {
    let (axis, sign) = ((side / 2) as usize, if side.is_multiple_of(2) { 1.0 } else { -1.0 });
    grid(cells, cells, |u, v| {
        let mut place = Vec3::ZERO;
        place[axis] = sign * (1.0 + 0.01 * (31.0 * u).sin() * (23.0 * v).cos());
        place[(axis + 1) % 3] = 2.0 * u - 1.0;
        place[(axis + 2) % 3] = 2.0 * v - 1.0;
        place * HALF
    })
}

/// A sphere of radius about 1 with waves of its own.
fn body(rng: &mut Rng, columns: u32, rows: u32) -> Mesh {
    let waves: [[f32; 4]; 5] = std::array::from_fn(|k| {
        let most = 3.0 * (k + 1) as f32;
        [(); 4].map(|()| most * (2.0 * rng.unit_f32() - 1.0))
    });
    grid(columns, rows, |u, v| {
        let (along, down) = (TAU * u, PI * v);
        let p = Vec3::new(along.cos() * down.sin(), down.cos(), along.sin() * down.sin());
        let height = waves.iter().zip(1..).map(|([x, y, z, phase], k)| {
            0.25 / k as f32 * (x * p.x + y * p.y + z * p.z + phase).sin()
        });
        p * (1.0 + height.sum::<f32>())
    })
}

fn column_mesh(columns: u32, rows: u32) -> Mesh {
    grid(columns, rows, |u, v| {
        let (angle, height) = (TAU * u, 2.0 * v - 1.0);
        let radius = 0.45 + 0.03 * (16.0 * angle).cos() + 0.15 * height.powi(8);
        Vec3::new(radius * angle.cos(), height * HALF.y, radius * angle.sin())
    })
}

/// Leaves that share no vertices.
fn bush(rng: &mut Rng, leaves: u32) -> Mesh {
    let mut mesh = Mesh::default();
    for leaf in 0..leaves {
        let mut part = |half: f32| (2.0 * rng.unit_f32() - 1.0) * half;
        let centre = Vec3::new(part(1.0), part(1.0), part(1.0));
        let centre = centre * (0.4 + 0.6 * centre.length()) / 1.4;
        for _ in 0..3 {
            mesh.positions.push(centre + Vec3::new(part(0.05), part(0.05), part(0.05)));
        }
        mesh.triangles.push([3 * leaf, 3 * leaf + 1, 3 * leaf + 2]);
    }
    mesh.triangle_materials.resize(mesh.triangles.len(), 0);
    mesh
}

#[cfg(test)]
mod tests {
    use super::*;

    fn triangles(scene: &Scene) -> usize {
        let count = |geometry: &Geometry| match geometry {
            Geometry::Mesh(mesh) => mesh.triangles.len(),
            Geometry::Sphere { .. } => 0,
        };
        scene.geometries.iter().map(count).sum()
    }

    #[test]
    fn the_hall_is_as_large_as_it_says() {
        assert!(triangles(&hall(1.0)) >= 1_000_000, "{}", triangles(&hall(1.0)));
        assert!(triangles(&swarm(10, 1.0)) >= 69_000);
    }
}
