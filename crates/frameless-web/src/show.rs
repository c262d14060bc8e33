//! What is served.

use std::sync::Arc;

use frameless_scene::Scene;
use frameless_session::{Helm, Opener, Session, Stage};

/// A session, and the camera on it.
pub struct Show<S: Stage> {
    /// The loop, not yet running.
    pub session: Session<S>,
    /// From where it is looked at first.
    pub helm: Helm,
    /// How other scenes are opened; none: the renderer has but its own.
    pub scenes: Option<Scenes<S::World>>,
}

/// How other scenes are opened.
pub struct Scenes<W> {
    /// What uploads may ask for, and the light that they get.
    pub opener: Opener,
    /// A scene made ready for the renderer, unless that is refused; called in a thread of its own.
    pub prepare: Prepare<W>,
}

/// Makes a scene ready for a renderer.
pub type Prepare<W> = Arc<dyn Fn(&Arc<Scene>) -> anyhow::Result<W> + Send + Sync>;
