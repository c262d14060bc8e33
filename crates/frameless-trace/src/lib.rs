//! A pixel at time t → its colour, on the CPU.
//!
//! The way of one sample: [`World`] holds what never changes (bottom-level BVHs, textures); a [`Moment`] is the world at one
//! time (transforms, lights, the top-level BVH over the instances); [`World::trace`] sends one pixel's ray into a moment
//! and shades what it hits with the deterministic Whitted integrator. [`CpuTracer`] does so for whole batches beside the
//! loop, [`render`] for whole pictures, [`explain`] for one pixel in words.

mod build;
mod camera;
mod cpu;
mod direct;
mod explain;
mod images;
mod kernel;
mod lights;
mod moment;
mod order;
mod planes;
mod point;
mod ray;
mod render;
mod sphere;
mod texture;
mod top;
mod traverse;
mod wide;
mod world;

#[cfg(test)]
mod reference;
#[cfg(test)]
mod shading;
#[cfg(test)]
mod test_scenes;

pub use camera::{Camera, ViewSource};
pub use cpu::{CpuTracer, thread_pool};
pub use direct::Settings;
pub use explain::explain;
pub use moment::Moment;
pub use ray::Ray;
pub use render::render;
pub use world::World;
