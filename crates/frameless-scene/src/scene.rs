//! The scene as plain, checked data: arrays that refer to each other by index.
//!
//! A [`Scene`] comes from a glTF file or from the built-in suite; once it exists every index is in bounds, every number
//! finite, every node after its parent. What moves is told by [`Animation`]; [`Scene::state_at`] evaluates it.

use std::ops::Range;

use glam::{Affine3A, Quat, Vec2, Vec3, Vec4};

use crate::animation::Animation;
use crate::environment::Environment;
use crate::material::Material;
use crate::runs::TriangleMaterials;
use crate::texture::{Image, Texture};

/// Sets of texture coordinates that a mesh may have.
pub const UV_SETS: usize = 4;

/// Everything that can be seen, at all times.
#[derive(Clone, Debug, Default)]
pub struct Scene {
    /// File name without folder, or the built-in scene's name.
    pub name: String,
    /// Shapes, each in coordinates of its own.
    pub geometries: Vec<Geometry>,
    /// How surfaces reflect light.
    pub materials: Vec<Material>,
    /// Images with the way they are looked up.
    pub textures: Vec<Texture>,
    /// Decoded pictures.
    pub images: Vec<Image>,
    /// The transform hierarchy; parents come before their children.
    pub nodes: Vec<Node>,
    /// Which geometry stands at which node. An instance's index is the object number of its samples.
    pub instances: Vec<Instance>,
    /// Bones that bend meshes.
    pub skins: Vec<Skin>,
    /// Which instances deform, and by what; in the order of the instances, each at most once.
    pub deformations: Vec<Deformation>,
    /// How much of each morph target is added while nothing moves it; see [`Deformation::weights`]. Finite.
    pub morph_weights: Vec<f32>,
    /// Views that the file offers; never empty after loading.
    pub cameras: Vec<Camera>,
    /// Light sources; may be empty only if `ambient` is not black, or there is an environment.
    pub lights: Vec<Light>,
    /// Whether the lights and `ambient` stand in for those that the file does not have.
    pub has_added_light: bool,
    /// Radiance that reaches every surface from everywhere, linear RGB.
    pub ambient: Vec3,
    /// Radiance of the sky straight down (x, y, z of `sky[0]`) and straight up (`sky[1]`), linear RGB; in
    /// between: mixed by the direction's y. An environment takes its place.
    pub sky: [Vec3; 2],
    /// A picture of all that is far away, which lights the scene.
    pub environment: Option<Environment>,
    /// What moves.
    pub animation: Animation,
    /// What was ignored or replaced while loading, each said once.
    pub warnings: Vec<String>,
    /// What was added because the file had none ("no camera: framed the scene"), for the HUD and the log.
    pub notes: Vec<String>,
    /// What else the file offers.
    pub contents: Contents,
}

impl Scene {
    /// What a material gives off on average over its texture, linear RGB; nothing if it is shown unlit.
    pub fn mean_radiance(&self, material: &Material) -> Vec3 {
        if material.emissive == Vec3::ZERO || material.unlit {
            return Vec3::ZERO;
        }
        let mean = material.emissive_texture.map_or(Vec4::ONE, |reference| {
            let texture = self.textures[reference.texture as usize];
            self.images[texture.image as usize].mean_light()
        });
        material.emissive * mean.truncate()
    }
}

/// The scenes and animations of the file, for whoever wants to choose others. Empty for built-in scenes.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Contents {
    /// Names of the file's scenes; may be empty.
    pub scenes: Vec<String>,
    /// Index of the scene that is shown, if the file has any.
    pub shown_scene: Option<usize>,
    /// Names of the file's animations; may be empty.
    pub animations: Vec<String>,
    /// Indices of the animations that are played.
    pub played: Vec<usize>,
    /// Per node of the scene: its number in the file. None of those that were added.
    pub nodes: Vec<u32>,
}

/// A shape.
#[derive(Clone, Debug)]
#[expect(
    clippy::large_enum_variant,
    reason = "nearly all are meshes, and a box would be one more look at memory per sample"
)]
pub enum Geometry {
    /// Triangles.
    Mesh(Mesh),
    /// The sphere of radius 1 around the origin. Texture coordinates: u around the y axis from +x towards
    /// +z, v from the north pole (+y, v = 0) to the south pole (v = 1).
    Sphere {
        /// Index into [`Scene::materials`].
        material: u32,
    },
}

/// Triangles with their attributes. Attribute arrays are as long as `positions`, or empty.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    /// Finite.
    pub positions: Vec<Vec3>,
    /// Unit length; empty: flat shading.
    pub normals: Vec<Vec3>,
    /// Texture coordinates, set by set.
    pub uvs: [Vec<Vec2>; UV_SETS],
    /// Linear RGBA that multiplies the base colour.
    pub colors: Vec<Vec4>,
    /// Three per triangle, or none: where a normal map's x axis points at each corner (a unit vector, or zero where nobody knows),
    /// and in w the sign of its y axis, bitangent = w · normal × tangent.
    pub tangents: Vec<Vec4>,
    /// Three vertices each, counter-clockwise seen from the front; in bounds.
    pub triangles: Vec<[u32; 3]>,
    /// Index into [`Scene::materials`], per triangle.
    pub triangle_materials: TriangleMaterials,
    /// Shapes that weights blend in, see [`Deformation::weights`].
    pub targets: Vec<MorphTarget>,
    /// Which joints move each vertex, four per set; empty: the mesh cannot be skinned.
    pub influences: Vec<Influences>,
}

/// What a morph weight of 1 adds to the mesh. Arrays are as long as [`Mesh::positions`], or empty. Finite.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MorphTarget {
    /// Added to the positions.
    pub positions: Vec<Vec3>,
    /// Added to the normals; empty if the mesh has none.
    pub normals: Vec<Vec3>,
    /// Added to the colours; empty if the mesh has none.
    pub colors: Vec<Vec4>,
}

/// Four joints per vertex and how much each of them counts. Both arrays are as long as [`Mesh::positions`].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Influences {
    /// Indices into [`Skin::joints`] of every skin that the mesh is used with.
    pub joints: Vec<[u16; 4]>,
    /// At least 0; over all sets of a mesh, a vertex's sum to 1.
    pub weights: Vec<[f32; 4]>,
}

/// A place in the transform hierarchy.
#[derive(Clone, Debug)]
pub struct Node {
    /// As in the file; may be empty.
    pub name: String,
    /// Index into [`Scene::nodes`], smaller than this node's own.
    pub parent: Option<u32>,
    /// Where the node stands in its parent while nothing moves it.
    pub rest: Transform,
}

/// Scale, then rotate, then translate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Transform {
    /// In metres.
    pub translation: Vec3,
    /// Unit quaternion.
    pub rotation: Quat,
    /// Per axis; may be negative.
    pub scale: Vec3,
}

impl Transform {
    /// No change.
    pub const IDENTITY: Transform =
        Transform { translation: Vec3::ZERO, rotation: Quat::IDENTITY, scale: Vec3::ONE };

    /// As a matrix: parent from local.
    pub fn affine(&self) -> Affine3A {
        Affine3A::from_scale_rotation_translation(self.scale, self.rotation, self.translation)
    }
}

/// A geometry at a node.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Instance {
    /// Index into [`Scene::nodes`].
    pub node: u32,
    /// Index into [`Scene::geometries`].
    pub geometry: u32,
}

/// Joints that carry the vertices of meshes (glTF 2.0 §3.7.3).
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Skin {
    /// As in the file; may be empty.
    pub name: String,
    /// Indices into [`Scene::nodes`].
    pub joints: Vec<u32>,
    /// Joint from mesh, while the mesh is as it was modelled; as many as `joints`. Finite.
    pub inverse_bind: Vec<Affine3A>,
}

/// How an instance of a mesh deforms: morph targets first, then the skin.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Deformation {
    /// Index into [`Scene::instances`]; its geometry is a mesh.
    pub instance: u32,
    /// Index into [`Scene::skins`]. The vertices of a skinned mesh go straight to the world: its node's transform is not used.
    pub skin: Option<u32>,
    /// Where in [`Scene::morph_weights`] the weights of the mesh's targets stand, one per target.
    pub weights: Range<u32>,
}

/// A camera at a node, looking along −z with +y up.
#[derive(Clone, Debug, PartialEq)]
pub struct Camera {
    /// As in the file; may be empty.
    pub name: String,
    /// Index into [`Scene::nodes`].
    pub node: u32,
    /// How directions become pixels.
    pub projection: Projection,
}

/// How directions become pixels. The picture's aspect ratio is that of the canvas, not of the file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Projection {
    /// Angle between the top and the bottom of the picture, in radians.
    Perspective {
        /// In (0, π).
        yfov_rad: f32,
    },
    /// Half the height of the visible box, in metres.
    Orthographic {
        /// Positive.
        ymag: f32,
    },
}

/// A punctual light (KHR_lights_punctual) at a node; spot and directional lights shine along −z.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Light {
    /// Index into [`Scene::nodes`].
    pub node: u32,
    /// Shape of the emission.
    pub kind: LightKind,
    /// Linear RGB: radiant intensity in W/sr (point, spot) or irradiance in W/m² (directional), up to the
    /// photometric constant that exposure absorbs. A matte white surface facing a point light of
    /// intensity I at distance r has radiance I / (π r²).
    pub intensity: Vec3,
    /// Beyond this distance in metres there is no light; infinite if the file does not say.
    pub range: f32,
}

/// Shape of a light's emission.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LightKind {
    /// Into all directions.
    Point,
    /// Parallel light from infinitely far away.
    Directional,
    /// Into a cone.
    Spot {
        /// Cosine of the angle at which the light begins to fall off.
        cos_inner: f32,
        /// Cosine of the angle at which it is gone; smaller than `cos_inner`.
        cos_outer: f32,
    },
}
