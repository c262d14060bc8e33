//! The render loop in a thread of its own, as a window, a web page or another program drives it.
//!
//! [`Session`] owns the engine: it takes [`Command`]s and makes a [`Picture`] when one is wanted. [`RenderThread`] runs it, so
//! that neither the loop nor who looks at it ever waits for the other. [`Helm`] is what the user's hands hold: which scene, and
//! from where it is looked at. [`Loading`] reads another scene meanwhile.
//!
//! Nothing that can be set clears the picture: not the size, not the sampler, not another scene.

mod camera;
mod command;
pub mod heatmap;
mod helm;
mod load;
mod overlay;
mod pace;
mod rate;
mod render_thread;
mod session;
mod settings;
mod shown;
pub mod snapshot;
mod stage;
#[cfg(test)]
mod test_stage;

pub use camera::FreeCamera;
pub use command::{Command, Picture, Report, Status, ViewChoice};
pub use helm::{Helm, Looking};
pub use load::{Loading, Opener, Outcome};
pub use overlay::{Colours, Drawn, Legend};
pub use pace::Pace;
pub use render_thread::{Ended, LOOP_THREAD, RenderThread};
pub use session::{OwnSampler, Session, Stage, Steering};
pub use settings::{Overlay, PictureSize, Settings};
pub use shown::Ages;
