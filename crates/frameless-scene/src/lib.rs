//! What exists at time t: scenes as checked plain data, their animation, cameras and lights.

mod animation;
mod bounds;
mod builtin;
mod check;
mod deform;
mod encoding;
mod environment;
mod gltf;
mod half;
mod material;
mod radiance;
mod runs;
mod scene;
mod state;
mod texture;
mod view;

pub use animation::{AfterEnd, Animation, Channel, Interpolation, Target, Value, Values};
pub use bounds::Bounds;
pub use builtin::{BUILTIN_DESCRIPTIONS, BUILTIN_NAMES, builtin};
pub use deform::{Deformed, FARTHEST_M};
pub use encoding::Encoding;
pub use environment::{Environment, Texels, load_environment};
pub use gltf::{
    AnimationChoice, Choice, Limits, LoadError, Pick, Place, Problem, load, load_bytes, load_chosen,
};
pub use material::{AlphaMode, Layers, Material, Volume};
pub use runs::TriangleMaterials;
pub use scene::{
    Camera, Contents, Deformation, Geometry, Influences, Instance, Light, LightKind, Mesh,
    MorphTarget, Node, Projection, Scene, Skin, Transform, UV_SETS,
};
pub use state::State;
pub use texture::{Filter, Image, Minify, Texture, TextureRef, Wrap, linear_from_srgb};
pub use view::{View, frame_bounds, look_at};
