//! The CPU renderer as the window's renderer.

use std::sync::Arc;

use frameless_trace::{CpuTracer, ViewSource, World};

use crate::command::ViewChoice;
use crate::session::{Stage, Steering};

impl Stage for CpuTracer {
    type World = Arc<World>;

    fn set_view(&mut self, view: ViewChoice) {
        self.set_view(match view {
            ViewChoice::Camera(camera) => ViewSource::Camera(camera),
            ViewChoice::Free(view) => ViewSource::Free(view),
        });
    }

    fn steering(&self) -> Option<Steering> {
        let viewpoint = self.viewpoint();
        Some(Box::new(move |view| viewpoint.set(ViewSource::Free(view))))
    }

    fn set_world(&mut self, world: Arc<World>) {
        self.set_world(world);
    }
}
