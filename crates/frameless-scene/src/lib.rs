//! What exists at time t: scenes as checked plain data, their animation, cameras and lights.

mod animation;
mod bounds;
mod builtin;
mod check;
mod gltf;
mod scene;
mod state;
mod view;

pub use animation::{AfterEnd, Animation, Channel, Interpolation, Target, Value, Values};
pub use bounds::Bounds;
pub use builtin::{BUILTIN_DESCRIPTIONS, BUILTIN_NAMES, builtin};
pub use gltf::{Limits, LoadError, Place, Problem, load, load_bytes, load_scene};
pub use scene::{
    Camera, Filter, Geometry, Image, Instance, Light, LightKind, Material, Mesh, Node, Projection,
    Scene, Texture, TextureRef, Transform, Wrap,
};
pub use state::State;
pub use view::{View, frame_bounds, look_at};
