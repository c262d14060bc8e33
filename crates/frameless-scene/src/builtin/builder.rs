//! Puts a scene together piece by piece.

use glam::{Quat, Vec2, Vec3, Vec4};

use crate::{
    Camera, Channel, Filter, Geometry, Image, Instance, Light, LightKind, Material, Mesh, Minify,
    Node, Projection, Scene, Texture, TextureRef, Transform, Wrap,
};

/// A scene under construction. Everything that is added answers with its index.
pub(super) struct Builder {
    scene: Scene,
}

impl Builder {
    pub(super) fn new(name: &str, duration_secs: f64) -> Builder {
        let mut scene = Scene { name: name.into(), ..Scene::default() };
        scene.animation.duration_secs = duration_secs;
        Builder { scene }
    }

    /// After which the scene begins again.
    pub(super) fn duration_secs(&self) -> f64 {
        self.scene.animation.duration_secs
    }

    pub(super) fn finish(self) -> Scene {
        self.scene
    }

    pub(super) fn backdrop(&mut self, ambient: Vec3, sky: [Vec3; 2]) {
        self.scene.ambient = ambient;
        self.scene.sky = sky;
    }

    /// A matte material that shows `image`.
    pub(super) fn matte(&mut self, image: Image) -> u32 {
        let texture = push(
            &mut self.scene.textures,
            Texture {
                image: push(&mut self.scene.images, image),
                wrap: [Wrap::Repeat; 2],
                filter: Filter::Linear,
                // Samples are points: what is measured on these scenes should not depend on how large a pixel is.
                minify: Minify::default(),
            },
        );
        let base_color_texture = Some(TextureRef::plain(texture));
        push(&mut self.scene.materials, Material { base_color_texture, ..Material::default() })
    }

    /// A perfect mirror that reflects the part `reflectance` of the light.
    pub(super) fn mirror(&mut self, reflectance: Vec3) -> u32 {
        let base_color = reflectance.extend(1.0);
        let mirror = Material { base_color, metallic: 1.0, roughness: 0.0, ..Material::default() };
        push(&mut self.scene.materials, mirror)
    }

    /// Another material of the same texture, tinted.
    pub(super) fn tinted(&mut self, material: u32, tint: Vec3) -> u32 {
        let original = self.scene.materials[material as usize].clone();
        let base_color = Vec4::from((tint, 1.0));
        push(&mut self.scene.materials, Material { base_color, ..original })
    }

    pub(super) fn node(&mut self, name: &str, parent: Option<u32>, rest: Transform) -> u32 {
        push(&mut self.scene.nodes, Node { name: name.into(), parent, rest })
    }

    /// A sphere; answers with its node.
    pub(super) fn sphere(&mut self, name: &str, material: u32, centre: Vec3, radius: f32) -> u32 {
        let scale = Vec3::splat(radius);
        let rest = Transform { translation: centre, scale, ..Transform::IDENTITY };
        self.instance(name, rest, Geometry::Sphere { material })
    }

    /// A box turned by `yaw_rad` around y; answers with its node. The texture is repeated every
    /// `texture_size` metres.
    pub(super) fn block(
        &mut self,
        name: &str,
        material: u32,
        (centre, half, yaw_rad): (Vec3, Vec3, f32),
        texture_size: f32,
    ) -> u32 {
        let rotation = Quat::from_rotation_y(yaw_rad);
        let rest = Transform { translation: centre, rotation, scale: Vec3::ONE };
        let mut mesh = Mesh::default();
        for axis in [Vec3::X, Vec3::Y, Vec3::Z] {
            for outward in [axis, -axis] {
                let up = if axis == Vec3::Y { Vec3::Z } else { Vec3::Y };
                let right = up.cross(outward);
                let face = (outward * half, right * half, up * half);
                add_rectangle(&mut mesh, material, face, texture_size);
            }
        }
        self.instance(name, rest, Geometry::Mesh(mesh))
    }

    pub(super) fn mesh(&mut self, name: &str, mesh: Mesh) -> u32 {
        self.instance(name, Transform::IDENTITY, Geometry::Mesh(mesh))
    }

    /// A light that shines into all directions; answers with its node.
    pub(super) fn point_light(&mut self, position: Vec3, intensity: Vec3) -> u32 {
        let rest = Transform { translation: position, ..Transform::IDENTITY };
        let node = self.node("light", None, rest);
        let kind = LightKind::Point;
        self.scene.lights.push(Light { node, kind, intensity, range: f32::INFINITY });
        node
    }

    pub(super) fn camera(&mut self, node: u32, yfov_rad: f32) {
        let projection = Projection::Perspective { yfov_rad };
        self.scene.cameras.push(Camera { name: "camera".into(), node, projection });
    }

    pub(super) fn animate(&mut self, channel: Channel) {
        self.scene.animation.channels.push(channel);
    }

    fn instance(&mut self, name: &str, rest: Transform, geometry: Geometry) -> u32 {
        let node = self.node(name, None, rest);
        let geometry = push(&mut self.scene.geometries, geometry);
        self.scene.instances.push(Instance { node, geometry });
        node
    }
}

/// A rectangle from `centre` by `right` and `up` to its borders (half its sides, at right angles), seen
/// from the side of `right × up`. The texture is repeated every `texture_size` metres.
pub(super) fn add_rectangle(
    mesh: &mut Mesh,
    material: u32,
    (centre, right, up): (Vec3, Vec3, Vec3),
    texture_size: f32,
) {
    let first = mesh.positions.len() as u32;
    for (x, y) in [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)] {
        mesh.positions.push(centre + right * x + up * y);
        mesh.normals.push(right.cross(up).normalize());
        let metres = Vec2::new(x * right.length(), -y * up.length());
        mesh.uvs[0].push(metres / texture_size);
    }
    mesh.triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
    mesh.triangle_materials.resize(mesh.triangles.len(), material);
}

fn push<T>(list: &mut Vec<T>, item: T) -> u32 {
    list.push(item);
    (list.len() - 1) as u32
}
