//! A pixel at time t → its colour, on the CPU.
//!
//! The way of one sample: [`World`] holds what never changes (bottom-level BVHs, textures); a [`Moment`] is the world at one
//! time (transforms, lights, the top-level BVH over the instances); [`World::trace`] sends one pixel's ray into a moment
//! and shades what it hits with one of the two integrators, deterministic or by random paths. [`CpuTracer`] does so for whole batches beside the
//! loop, [`render`] for whole pictures, [`explain`] for one pixel in words.

mod asking;
mod bsdf;
mod build;
mod camera;
mod cast;
mod collapse;
mod cpu;
mod crew;
mod crowd;
mod deforming;
mod direct;
mod emitters;
mod explain;
mod first;
mod forecast;
mod fresnel;
mod holes;
mod images;
mod integrator;
mod kernel;
mod latest;
mod leaf;
mod lens;
mod lights;
mod many;
mod matter;
mod moment;
mod numbers;
mod order;
mod packet;
mod parts;
mod patch;
mod path;
mod planes;
mod point;
mod ray;
mod refit;
mod render;
mod sah;
mod shares;
mod sheen;
mod sheets;
mod sift;
mod sparing;
mod sphere;
mod standing;
mod stream;
mod surroundings;
mod tangent;
mod texture;
mod top;
mod traverse;
mod untied;
mod wide;
mod world;

#[cfg(test)]
mod bending;
#[cfg(test)]
mod light_transport;
#[cfg(test)]
mod reference;
#[cfg(test)]
mod shading;
#[cfg(test)]
mod surfaces;
#[cfg(test)]
mod test_scenes;

pub use camera::{Camera, ViewSource};
pub use cast::Caster;
pub use cpu::{CpuTracer, Viewpoint, thread_pool};
pub use crowd::Overlap;
pub use explain::explain;
pub use integrator::{Integrator, Settings};
pub use lens::Lens;
pub use many::{SHADED, WAVE};
pub use moment::Moment;
pub use ray::{Hit, Ray};
pub use render::{Still, render, render_still};
pub use world::World;
