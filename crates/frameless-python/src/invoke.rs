//! A function in Python answers a batch.

use pyo3::prelude::*;

use crate::batch::Batch;
use crate::camera::Camera;
use crate::columns;
use crate::hits::Arrays;

/// What came back: colours, or an object with `rgb`, `position`, `normal` and `object_id`, the last three None where they are not
/// known.
pub(crate) struct Returned<'py> {
    rgb: Bound<'py, PyAny>,
    surfaces: [Option<Bound<'py, PyAny>>; 3],
}

impl<'py> Returned<'py> {
    pub(crate) fn arrays(&self) -> Arrays<'_, 'py> {
        let [position, normal, object_id] = self.surfaces.clone();
        Arrays { rgb: &self.rgb, position, normal, object_id }
    }
}

/// Calls `render(x, y, time, camera)`; one with noise, which has a `seed`, with one per sample as well.
pub(crate) fn call<'py>(
    render: &Bound<'py, PyAny>,
    asked: &frameless::Batch,
    camera: Option<Camera>,
    seed: Option<u64>,
) -> PyResult<Returned<'py>> {
    let py = render.py();
    let (x, y, time) = (columns::x(py, asked), columns::y(py, asked), asked.scene_secs);
    let rgb = match seed {
        None => render.call1((x, y, time, camera))?,
        Some(seed) => render.call1((x, y, time, camera, columns::seed(py, asked, seed)))?,
    };
    if !rgb.hasattr("object_id")? {
        return Ok(Returned { rgb, surfaces: [None, None, None] });
    }
    let given = |name: &str| rgb.getattr(name).map(|value| (!value.is_none()).then_some(value));
    let surfaces = [given("position")?, given("normal")?, given("object_id")?];
    Ok(Returned { rgb: rgb.getattr("rgb")?, surfaces })
}

/// Calls it for a batch of a session, and keeps what it returns.
pub(crate) fn answer(render: &Bound<'_, PyAny>, batch: &Batch, is_noisy: bool) -> PyResult<usize> {
    let seed = is_noisy.then_some(batch.session_seed());
    let returned = call(render, batch.asked(), batch.camera_of_size(), seed)?;
    batch.take(render.py(), &returned.arrays(), None)
}
