//! What exists at time t: scenes as checked plain data, their animation, cameras and lights.

mod animation;
mod scene;
mod state;

pub use animation::{Animation, Channel, Interpolation, Target, Values};
pub use scene::{
    Camera, Filter, Geometry, Image, Instance, Light, LightKind, Material, Mesh, Node, Projection,
    Scene, Texture, TextureRef, Transform, Wrap,
};
pub use state::{State, View};
