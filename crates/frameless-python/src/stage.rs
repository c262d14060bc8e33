//! A function in Python as the renderer of a loop that runs in a thread of its own.

use std::collections::VecDeque;
use std::time::Duration;

use frameless::{Answer, Batch, Pose, Size, Tracer};
use frameless_session::{Stage, ViewChoice};
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;

use crate::calls::Calls;
use crate::camera::Camera;
use crate::invoke;
use crate::outside::Outside;
use crate::own::Own;
use crate::raised::{Raised, Source};

/// Calls the function for every batch, with the interpreter held. What it raises is kept in `raised`; it is not called again until
/// somebody has taken that.
pub(crate) struct PythonStage {
    render: Own,
    raised: Raised,
    calls: Calls,
    outside: Outside,
    /// The renderer's own camera, to come back to.
    own_camera: Camera,
    answers: VecDeque<Answer>,
}

/// Of a page's random numbers.
const SEED: u64 = 1;
/// How often a loop whose renderer has failed looks whether somebody has mended it.
const REST: Duration = Duration::from_millis(20);

impl PythonStage {
    /// `render` may be replaced by another while the loop runs.
    pub(crate) fn new(
        render: Own,
        camera: Camera,
        is_noisy: bool,
        raised: Raised,
        calls: Calls,
    ) -> PythonStage {
        let outside = Outside::new(Some(camera), is_noisy);
        PythonStage { render, raised, calls, outside, own_camera: camera, answers: VecDeque::new() }
    }

    fn answer(&mut self, py: Python<'_>, batch: &Batch) -> PyResult<Answer> {
        let camera = self.outside.camera.unwrap_or(self.own_camera);
        let render = self.render.get(py);
        let render = render.ok_or_else(|| PyRuntimeError::new_err("the renderer is gone"))?;
        let shown = Some(camera.of_size(batch.size));
        let returned = {
            let _calling = self.calls.begin(py)?;
            invoke::call(&render, batch, shown, self.outside.is_noisy.then_some(SEED))?
        };
        let at = |i: usize| {
            let [x, y] = batch.requests[i].position_px(batch.size);
            format!("sample {i} (x = {x}, y = {y})")
        };
        let (rgb, hits) = returned.arrays().checked(batch.requests.len(), &at)?;
        let surfaces = hits.map(|hits| hits.surfaces(&batch.requests, batch.size, &camera, &[]));
        let surfaces = surfaces.unwrap_or_default();
        self.outside.note(&surfaces);
        Ok(Answer::to(batch.clone(), rgb, surfaces))
    }
}

impl Tracer for PythonStage {
    fn submit(&mut self, batch: Batch) {
        if self.raised.is_set() {
            std::thread::sleep(REST);
            return;
        }
        // No interpreter: the program is ending.
        match Python::try_attach(|py| self.answer(py, &batch)) {
            Some(Ok(answer)) => self.answers.push_back(answer),
            Some(Err(error)) => self.raised.set(Source::Renderer, error),
            None => {
                let gone = PyRuntimeError::new_err("the interpreter is gone");
                self.raised.set(Source::Renderer, gone);
            }
        }
    }

    fn collect(&mut self, _wait: bool) -> Option<Answer> {
        self.answers.pop_front()
    }

    fn is_noisy(&self) -> bool {
        self.outside.is_noisy
    }

    fn pose(&mut self, scene_secs: f64, size: Size, pose: &mut Pose) -> bool {
        self.outside.pose(scene_secs, size, pose)
    }
}

impl Stage for PythonStage {
    /// It has but its own.
    type World = ();

    fn set_view(&mut self, view: ViewChoice) {
        self.outside.camera = Some(match view {
            ViewChoice::Camera(_) => self.own_camera,
            ViewChoice::Free(view) => Camera::from_view(view, self.own_camera.distance()),
        });
    }

    fn set_world(&mut self, (): ()) {}

    fn trouble(&mut self) -> Option<String> {
        Python::try_attach(|py| self.raised.describe(py)).flatten()
    }
}
