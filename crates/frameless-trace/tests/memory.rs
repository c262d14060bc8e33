//! How much memory it takes to prepare a large mesh. A process of its own: whatever else ran in it would be counted.
#![cfg(all(target_os = "linux", target_env = "gnu"))]

use std::sync::Arc;

use frameless_scene::{
    Camera, Geometry, Instance, Material, Mesh, Node, Projection, Scene, Transform,
    TriangleMaterials,
};
use frameless_trace::{World, thread_pool};
use glam::Vec3;

/// Of this process, in bytes: `VmRSS`, what it holds of the machine's memory, or `VmHWM`, the most that it has held.
fn held(key: &str) -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").expect("Linux tells");
    let line = status.lines().find(|line| line.starts_with(key)).expect("it is there");
    let kib: f64 =
        line.split_whitespace().nth(1).and_then(|kib| kib.parse().ok()).expect("a number");
    1024.0 * kib
}

/// Waves of a million triangles that share their vertices.
fn waves() -> Scene {
    const SIDE: u32 = 708;
    let height = |x: f32, z: f32| 0.1 * (9.0 * x).sin() * (7.0 * z).cos();
    let vertex = |k: u32| {
        let [x, z] = [k % (SIDE + 1), k / (SIDE + 1)].map(|i| 2.0 * i as f32 / SIDE as f32);
        Vec3::new(x, height(x, z), z)
    };
    let square = |k: u32| {
        let a = k / SIDE * (SIDE + 1) + k % SIDE;
        [[a, a + SIDE + 1, a + 1], [a + 1, a + SIDE + 1, a + SIDE + 2]]
    };
    let triangles: Vec<[u32; 3]> = (0..SIDE * SIDE).flat_map(square).collect();
    let mesh = Mesh {
        positions: (0..(SIDE + 1) * (SIDE + 1)).map(vertex).collect(),
        triangle_materials: TriangleMaterials::all(0, triangles.len()),
        triangles,
        ..Mesh::default()
    };
    let node = Node { name: String::new(), parent: None, rest: Transform::IDENTITY };
    let projection = Projection::Perspective { yfov_rad: 1.0 };
    Scene {
        geometries: vec![Geometry::Mesh(mesh)],
        materials: vec![Material::default()],
        nodes: vec![node],
        instances: vec![Instance { node: 0, geometry: 0 }],
        cameras: vec![Camera { name: String::new(), node: 0, projection }],
        ..Scene::default()
    }
}

/// The tree has 35 bytes per triangle, and joining its parts takes 15 for a moment. Where the allocator keeps what it is given back it is 54,
/// and 47 are left; where joining begins before what the parts needed is let go, 58.
#[test]
fn a_million_triangles_are_prepared_in_little_more_than_their_tree() {
    const MOST_BYTES: f64 = 52.0;
    const BYTES_LEFT: f64 = 38.0;
    let scene = Arc::new(waves());
    let Geometry::Mesh(mesh) = &scene.geometries[0] else { unreachable!("it is a mesh") };
    let (count, before) = (mesh.triangles.len() as f64, held("VmRSS:"));
    let world = thread_pool(2).install(|| World::new(scene.clone()));
    let [most, left] = ["VmHWM:", "VmRSS:"].map(|key| (held(key) - before) / count);
    assert!(
        most <= MOST_BYTES && left <= BYTES_LEFT,
        "{most:.1} bytes per triangle at most, {left:.1} left"
    );
    drop(world);
}
