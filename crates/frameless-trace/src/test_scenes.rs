//! Small scenes for tests.

use std::sync::Arc;

use frameless::{Rng, Size};
use frameless_scene::{
    Camera, Geometry, Instance, Light, LightKind, Material, Mesh, Node, Projection, Scene,
    Transform, TriangleMaterials,
};
use glam::{Quat, Vec3, Vec4};

use crate::ViewSource;

pub(crate) const SIZE: Size = Size { width: 32, height: 24 };
pub(crate) const CAMERA: ViewSource = ViewSource::Camera(0);

/// Nothing but a camera at (0, 0, 5) that looks along −z, 90° high.
pub(crate) fn empty() -> Scene {
    let camera = Transform { translation: Vec3::new(0.0, 0.0, 5.0), ..Transform::IDENTITY };
    Scene {
        nodes: vec![node(camera)],
        cameras: vec![Camera {
            name: String::new(),
            node: 0,
            projection: Projection::Perspective { yfov_rad: std::f32::consts::FRAC_PI_2 },
        }],
        ..Scene::default()
    }
}

pub(crate) fn node(rest: Transform) -> Node {
    Node { name: String::new(), parent: None, rest }
}

/// Appends a geometry with one instance; returns the instance's index.
pub(crate) fn add(scene: &mut Scene, geometry: Geometry, rest: Transform) -> u32 {
    scene.nodes.push(node(rest));
    scene.geometries.push(geometry);
    scene.instances.push(Instance {
        node: scene.nodes.len() as u32 - 1,
        geometry: scene.geometries.len() as u32 - 1,
    });
    scene.instances.len() as u32 - 1
}

pub(crate) fn add_material(scene: &mut Scene, base: Vec3, metallic: f32, roughness: f32) -> u32 {
    scene.materials.push(Material {
        base_color: Vec4::from((base, 1.0)),
        metallic,
        roughness,
        ..Material::default()
    });
    scene.materials.len() as u32 - 1
}

pub(crate) fn add_point_light(scene: &mut Scene, at: Vec3, intensity: f32) {
    scene.nodes.push(node(Transform { translation: at, ..Transform::IDENTITY }));
    scene.lights.push(Light {
        node: scene.nodes.len() as u32 - 1,
        kind: LightKind::Point,
        intensity: Vec3::splat(intensity),
        range: f32::INFINITY,
    });
}

/// The square from (−h, y, −h) to (h, y, h), its front up.
pub(crate) fn floor(half: f32, y: f32, material: u32) -> Geometry {
    let positions = [[-1.0, 1.0], [1.0, 1.0], [1.0, -1.0], [-1.0, -1.0]]
        .map(|[x, z]| Vec3::new(x * half, y, z * half))
        .to_vec();
    mesh(positions, vec![[0, 1, 2], [0, 2, 3]], material)
}

pub(crate) fn mesh(positions: Vec<Vec3>, triangles: Vec<[u32; 3]>, material: u32) -> Geometry {
    let triangle_materials = TriangleMaterials::all(material, triangles.len());
    Geometry::Mesh(Mesh { positions, triangles, triangle_materials, ..Mesh::default() })
}

pub(crate) fn at(x: f32, y: f32, z: f32) -> Transform {
    Transform { translation: Vec3::new(x, y, z), ..Transform::IDENTITY }
}

pub(crate) fn unit(rng: &mut Rng) -> Vec3 {
    loop {
        let v = Vec3::from_array(std::array::from_fn(|_| 2.0 * rng.unit_f32() - 1.0));
        if (0.01..1.0).contains(&v.length_squared()) {
            return v.normalize();
        }
    }
}

/// A closed sphere of triangles that share their vertices, slightly uneven.
pub(crate) fn triangle_sphere(rings: u32, segments: u32, material: u32) -> Geometry {
    let mut rng = Rng::new(7);
    let mut positions = vec![Vec3::Y];
    for ring in 1..rings {
        for segment in 0..segments {
            let theta = std::f32::consts::PI * ring as f32 / rings as f32;
            let phi = std::f32::consts::TAU * segment as f32 / segments as f32;
            let radius = 1.0 + 0.01 * rng.unit_f32();
            let direction =
                Vec3::new(theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin());
            positions.push(radius * direction);
        }
    }
    positions.push(Vec3::NEG_Y);
    let south = positions.len() as u32 - 1;
    let vertex = |ring: u32, segment: u32| 1 + (ring - 1) * segments + segment % segments;
    let mut triangles = Vec::new();
    for s in 0..segments {
        triangles.push([0, vertex(1, s + 1), vertex(1, s)]);
        triangles.push([south, vertex(rings - 1, s), vertex(rings - 1, s + 1)]);
        for ring in 1..rings - 1 {
            let [a, b] = [vertex(ring, s), vertex(ring, s + 1)];
            let [c, d] = [vertex(ring + 1, s), vertex(ring + 1, s + 1)];
            triangles.push([a, b, c]);
            triangles.push([b, d, c]);
        }
    }
    mesh(positions, triangles, material)
}

/// Meshes, spheres, mirrors, mirrored and sheared instances, three kinds of light.
pub(crate) fn mixed() -> Arc<Scene> {
    let mut scene = empty();
    scene.ambient = Vec3::splat(0.1);
    scene.sky = [Vec3::new(0.2, 0.2, 0.2), Vec3::new(0.4, 0.6, 1.0)];
    let white = add_material(&mut scene, Vec3::splat(0.8), 0.0, 1.0);
    let red = add_material(&mut scene, Vec3::new(0.8, 0.1, 0.1), 0.0, 1.0);
    let mirror = add_material(&mut scene, Vec3::splat(0.9), 1.0, 0.0);
    let brushed = add_material(&mut scene, Vec3::new(0.9, 0.8, 0.3), 1.0, 0.3);
    add(&mut scene, floor(10.0, -1.5, white), Transform::IDENTITY);
    add(&mut scene, Geometry::Sphere { material: mirror }, at(-1.6, 0.0, -1.0));
    add(&mut scene, Geometry::Sphere { material: red }, at(1.5, -0.5, 0.5));
    let turned = Transform {
        translation: Vec3::new(0.5, 0.7, -1.0),
        rotation: Quat::from_axis_angle(Vec3::new(1.0, 2.0, 0.5).normalize(), 1.0),
        scale: Vec3::new(-0.6, 1.1, 0.8),
    };
    add(&mut scene, triangle_sphere(24, 48, brushed), turned);
    add(&mut scene, triangle_sphere(9, 12, red), at(3.0, 1.0, -3.0));
    add_point_light(&mut scene, Vec3::new(3.0, 5.0, 3.0), 60.0);
    add_point_light(&mut scene, Vec3::new(-4.0, 3.0, 2.0), 20.0);
    let mut spot = scene.lights[0];
    spot.kind = LightKind::Spot { cos_inner: 0.95, cos_outer: 0.8 };
    scene.lights.push(spot);
    let mut sun = scene.lights[1];
    sun.kind = LightKind::Directional;
    sun.intensity = Vec3::splat(0.5);
    scene.lights.push(sun);
    Arc::new(scene)
}
