//! Frameless rendering.
mod rng; mod sample; mod sampler; mod time; mod tracer; mod canvas;
pub use canvas::Canvas; pub use rng::Rng; pub use sample::*; pub use sampler::*; pub use time::Time; pub use tracer::*;
