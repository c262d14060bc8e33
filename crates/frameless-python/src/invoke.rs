//! A function in Python answers a batch.

use pyo3::prelude::*;

use crate::batch::Batch;
use crate::hits::Arrays;

/// Calls `render(x, y, time, camera)`, for a noisy renderer with a seed per sample, and keeps what it returns: colours, or an object
/// with `rgb`, `position`, `normal` and `object_id`, the last three None where they are not known.
pub(crate) fn answer(
    py: Python<'_>,
    render: &Bound<'_, PyAny>,
    batch: &Bound<'_, Batch>,
    is_noisy: bool,
) -> PyResult<usize> {
    let asked = batch.get();
    let ((x, y), time, camera) = (asked.positions(py), asked.scene_secs(), asked.camera_of_size());
    let answer = match is_noisy {
        false => render.call1((x, y, time, camera))?,
        true => render.call1((x, y, time, camera, batch.getattr("seed")?))?,
    };
    if !answer.hasattr("object_id")? {
        let arrays = Arrays { rgb: &answer, position: None, normal: None, object_id: None };
        return asked.take(py, &arrays, None);
    }
    let given = |name: &str| answer.getattr(name).map(|value| (!value.is_none()).then_some(value));
    let (position, normal, object_id) = (given("position")?, given("normal")?, given("object_id")?);
    asked.take(py, &Arrays { rgb: &answer.getattr("rgb")?, position, normal, object_id }, None)
}
