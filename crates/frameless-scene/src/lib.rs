//! What exists at time t: scenes as checked plain data, their animation, cameras and lights.

mod animation;
mod bounds;
mod builtin;
mod check;
mod deform;
mod gltf;
mod scene;
mod state;
mod view;

pub use animation::{AfterEnd, Animation, Channel, Interpolation, Target, Value, Values};
pub use bounds::Bounds;
pub use builtin::{BUILTIN_DESCRIPTIONS, BUILTIN_NAMES, builtin};
pub use deform::Deformed;
pub use gltf::{
    AnimationChoice, Choice, Limits, LoadError, Pick, Place, Problem, load, load_bytes, load_chosen,
};
pub use scene::{
    Camera, Contents, Deformation, Filter, Geometry, Image, Influences, Instance, Light, LightKind,
    Material, Mesh, MorphTarget, Node, Projection, Scene, Skin, Texture, TextureRef, Transform,
    Wrap,
};
pub use state::State;
pub use view::{View, frame_bounds, look_at};
