//! A function in Python as the renderer of a loop that runs in a thread of its own.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use frameless::{Answer, Batch, Pose, Size, Tracer};
use frameless_session::{Stage, ViewChoice};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::camera::Camera;
use crate::invoke;
use crate::outside::Outside;
use crate::shared::Raised;

/// The function, which may be replaced by another while the loop runs.
#[derive(Clone)]
pub(crate) struct Render(Arc<Mutex<Py<PyAny>>>);

impl Render {
    pub(crate) fn new(render: Py<PyAny>) -> Render {
        Render(Arc::new(Mutex::new(render)))
    }

    pub(crate) fn set(&self, py: Python<'_>, render: Py<PyAny>) {
        let old = std::mem::replace(&mut *self.lock(), render);
        // What it does when it goes may ask for the lock.
        old.drop_ref(py);
    }

    fn get(&self, py: Python<'_>) -> Py<PyAny> {
        self.lock().clone_ref(py)
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, Py<PyAny>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Calls the function for every batch, with the interpreter held. What it raises is kept in `raised`; it is not called again until
/// somebody has taken that.
pub(crate) struct PythonStage {
    render: Render,
    raised: Raised,
    outside: Outside,
    /// The renderer's own camera, to come back to.
    own_camera: Camera,
    answers: VecDeque<Answer>,
}

/// How often a loop whose renderer has failed looks whether somebody has mended it.
const REST: Duration = Duration::from_millis(20);

impl PythonStage {
    pub(crate) fn new(
        render: Render,
        camera: Camera,
        is_noisy: bool,
        raised: Raised,
    ) -> PythonStage {
        let outside = Outside::new(Some(camera), is_noisy);
        PythonStage { render, raised, outside, own_camera: camera, answers: VecDeque::new() }
    }

    fn answer(&mut self, py: Python<'_>, batch: &Batch) -> PyResult<Answer> {
        let camera = self.outside.camera.unwrap_or(self.own_camera);
        let render = self.render.get(py);
        let shown = Some(camera.of_size(batch.size));
        let returned = invoke::call(render.bind(py), batch, shown, self.outside.is_noisy)?;
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
            Some(Err(error)) => self.raised.set(error),
            None => self.raised.set(PyValueError::new_err("the interpreter is gone")),
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
}
