//! What the built-in scenes look like, by a ray caster that tries every shape: well exposed without tone mapping.
//!
//! `FRAMELESS_PICTURES=folder cargo test -p frameless-scene --test builtin_exposure` keeps the pictures.

use frameless_scene::{
    BUILTIN_NAMES, Geometry, Image, Material, Mesh, Projection, Scene, State, builtin,
};
use glam::{Affine3A, Vec2, Vec3};

const WIDTH: usize = 128;
const HEIGHT: usize = 96;
const SECS: [f64; 3] = [0.5, 1.3, 2.2];
/// Leaves a surface before its shadow and reflection rays start, in metres.
const SURFACE_GAP: f32 = 2e-3;

#[test]
fn pictures_are_neither_dark_nor_burnt_nor_flat() {
    for name in BUILTIN_NAMES {
        let scene = builtin(name).expect("named");
        for secs in SECS {
            let picture = render(&scene, secs);
            keep(name, secs, &picture);
            let channels = (3 * picture.len()) as f32;
            let sum = |f: &dyn Fn(f32) -> f32| {
                picture.iter().flat_map(|rgb| rgb.to_array()).map(f).sum::<f32>() / channels
            };
            let mean = sum(&|c| c);
            let deviation = sum(&|c| (c - mean).powi(2)).sqrt();
            let clipped = sum(&|c| f32::from(c >= 1.0));
            let black = sum(&|c| f32::from(c < 0.02));
            eprintln!("{name} {secs}: mean {mean:.3} ± {deviation:.3}, clipped {clipped:.4}");
            assert!((0.35..0.65).contains(&mean), "{name} at {secs} s: mean {mean}");
            assert!(deviation > 0.12, "{name} at {secs} s: deviation {deviation}");
            assert!(clipped < 0.02 && black < 0.02, "{name} at {secs} s: {clipped}, {black}");
        }
    }
}

fn keep(name: &str, secs: f64, picture: &[Vec3]) {
    let Ok(folder) = std::env::var("FRAMELESS_PICTURES") else { return };
    let bytes: Vec<u8> =
        picture.iter().flat_map(|c| c.to_array()).map(|c| (c * 255.0).round() as u8).collect();
    let path = format!("{folder}/{name}-{secs}.png");
    image::save_buffer(path, &bytes, WIDTH as u32, HEIGHT as u32, image::ColorType::Rgb8)
        .expect("the folder exists");
}

/// sRGB-encoded, row by row, two samples per side of a pixel.
fn render(scene: &Scene, secs: f64) -> Vec<Vec3> {
    let state = scene.state_at(secs);
    let caster = Caster::new(scene, &state);
    let view = scene.view_at(&state, 0);
    let Projection::Perspective { yfov_rad } = view.projection else { panic!("a perspective") };
    let scale = (0.5 * yfov_rad).tan() / (0.5 * HEIGHT as f32);
    let middle = 0.5 * Vec2::new(WIDTH as f32, HEIGHT as f32);
    let pixel = |i: usize| {
        let corner = Vec2::new((i % WIDTH) as f32, (i / WIDTH) as f32);
        let subs = [(0.25, 0.25), (0.75, 0.25), (0.25, 0.75), (0.75, 0.75)];
        let sum: Vec3 = subs
            .into_iter()
            .map(|(x, y)| {
                let p = (corner + Vec2::new(x, y) - middle) * scale;
                let direction =
                    view.world_from_camera.transform_vector3(Vec3::new(p.x, -p.y, -1.0));
                let eye = view.world_from_camera.translation.into();
                caster.radiance(eye, direction.normalize(), 2)
            })
            .sum();
        (sum / 4.0).clamp(Vec3::ZERO, Vec3::ONE).map(srgb_from_linear)
    };
    (0..WIDTH * HEIGHT).map(pixel).collect()
}

struct Hit {
    distance: f32,
    normal: Vec3,
    uv: Vec2,
    material: u32,
}

struct Caster<'a> {
    scene: &'a Scene,
    state: &'a State,
    local_from_world: Vec<Affine3A>,
}

impl<'a> Caster<'a> {
    fn new(scene: &'a Scene, state: &'a State) -> Self {
        let world_from_local =
            scene.instances.iter().map(|i| state.world_from_node[i.node as usize]);
        let local_from_world = world_from_local.map(|matrix| matrix.inverse()).collect();
        Caster { scene, state, local_from_world }
    }

    fn radiance(&self, origin: Vec3, direction: Vec3, bounces: u32) -> Vec3 {
        let Some(hit) = self.nearest(origin, direction) else {
            return self.scene.sky[0].lerp(self.scene.sky[1], 0.5 + 0.5 * direction.y);
        };
        let material = &self.scene.materials[hit.material as usize];
        let albedo = self.albedo(material, hit.uv);
        let point = origin + direction * hit.distance + hit.normal * SURFACE_GAP;
        if material.metallic == 1.0 && material.roughness == 0.0 {
            if bounces == 0 {
                return Vec3::ZERO;
            }
            return albedo * self.radiance(point, direction.reflect(hit.normal), bounces - 1);
        }
        let mut light = self.scene.ambient;
        for (i, lamp) in self.scene.lights.iter().enumerate() {
            let to_lamp =
                Vec3::from(self.state.world_from_node[lamp.node as usize].translation) - point;
            let distance = to_lamp.length();
            let cosine = hit.normal.dot(to_lamp / distance);
            let shadow = self.nearest(point, to_lamp / distance);
            if cosine > 0.0 && shadow.is_none_or(|blocker| blocker.distance > distance) {
                let falloff = cosine / (std::f32::consts::PI * distance * distance);
                light += self.state.light_intensity[i] * falloff;
            }
        }
        albedo * light
    }

    fn nearest(&self, origin: Vec3, direction: Vec3) -> Option<Hit> {
        let mut nearest: Option<Hit> = None;
        for (instance, local_from_world) in self.scene.instances.iter().zip(&self.local_from_world)
        {
            let from = local_from_world.transform_point3(origin);
            let along = local_from_world.transform_vector3(direction);
            let hit = match &self.scene.geometries[instance.geometry as usize] {
                Geometry::Sphere { material } => sphere(*material, from, along),
                Geometry::Mesh(mesh) => triangles(mesh, from, along),
            };
            if let Some(mut hit) = hit
                && nearest.as_ref().is_none_or(|best| hit.distance < best.distance)
            {
                let world_from_local = local_from_world.matrix3.transpose();
                hit.normal = (world_from_local * hit.normal).normalize();
                nearest = Some(hit);
            }
        }
        nearest
    }

    fn albedo(&self, material: &Material, uv: Vec2) -> Vec3 {
        let Some(texture) = material.base_color_texture else {
            return material.base_color.truncate();
        };
        let texture = &self.scene.textures[texture.texture as usize];
        let image = &self.scene.images[texture.image as usize];
        material.base_color.truncate() * texel(image, uv)
    }
}

fn sphere(material: u32, from: Vec3, along: Vec3) -> Option<Hit> {
    let (a, b, c) = (along.dot(along), from.dot(along), from.dot(from) - 1.0);
    let discriminant = b * b - a * c;
    let distance = (-b - discriminant.max(0.0).sqrt()) / a;
    if discriminant <= 0.0 || distance <= 0.0 {
        return None;
    }
    let p = from + along * distance;
    let u = p.z.atan2(p.x) / std::f32::consts::TAU;
    let v = p.y.clamp(-1.0, 1.0).acos() / std::f32::consts::PI;
    Some(Hit { distance, normal: p, uv: Vec2::new(u, v), material })
}

/// Möller and Trumbore 1997, front faces only.
fn triangles(mesh: &Mesh, from: Vec3, along: Vec3) -> Option<Hit> {
    let mut nearest: Option<Hit> = None;
    for (triangle, material) in mesh.triangles.iter().zip(mesh.triangle_materials.iter()) {
        let [a, b, c] = triangle.map(|v| mesh.positions[v as usize]);
        let (ab, ac, to) = (b - a, c - a, from - a);
        let p = along.cross(ac);
        let determinant = ab.dot(p);
        if determinant <= 0.0 {
            continue;
        }
        let u = to.dot(p) / determinant;
        let q = to.cross(ab);
        let v = along.dot(q) / determinant;
        let distance = ac.dot(q) / determinant;
        if u < 0.0 || v < 0.0 || u + v > 1.0 || distance <= 0.0 {
            continue;
        }
        if nearest.as_ref().is_none_or(|best| distance < best.distance) {
            let [ta, tb, tc] = triangle.map(|v| mesh.uvs[0][v as usize]);
            let uv = ta + (tb - ta) * u + (tc - ta) * v;
            let normal = mesh.normals[triangle[0] as usize];
            nearest = Some(Hit { distance, normal, uv, material });
        }
    }
    nearest
}

fn texel(image: &Image, uv: Vec2) -> Vec3 {
    let column = (uv.x.rem_euclid(1.0) * image.width as f32) as u32 % image.width;
    let row = (uv.y.rem_euclid(1.0) * image.height as f32) as u32 % image.height;
    let [r, g, b, _] = image.rgba[(row * image.width + column) as usize];
    Vec3::new(f32::from(r), f32::from(g), f32::from(b)).map(|c| linear_from_srgb(c / 255.0))
}

fn linear_from_srgb(c: f32) -> f32 {
    if c <= 0.04045 { c / 12.92 } else { ((c + 0.055) / 1.055).powf(2.4) }
}

fn srgb_from_linear(c: f32) -> f32 {
    if c <= 0.0031308 { 12.92 * c } else { 1.055 * c.powf(1.0 / 2.4) - 0.055 }
}
