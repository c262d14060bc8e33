//! What is known of every pixel, as arrays. All are the caller's own: nothing changes them later.

use std::sync::Arc;

use frameless::{Size, Time};
use numpy::prelude::*;
use numpy::{PyArray2, PyArray3};
use pyo3::prelude::*;

use crate::array;
use crate::shared::Shared;

/// The picture at `now`, or at the engine's own time.
pub(crate) fn image<'py>(
    py: Python<'py>,
    shared: &Arc<Shared>,
    now: Option<Time>,
    out: Option<Bound<'py, PyAny>>,
) -> PyResult<Bound<'py, PyArray3<f32>>> {
    let checked = |size: Size| out.as_ref().map(|out| array::target("out", out, size)).transpose();
    // Before the work, and again after it: somebody may have changed the size meanwhile.
    checked(shared.with(py, |state| state.engine.canvas().size())?)?;
    let (size, picture) = shared.with_long(py, move |state| {
        let now = now.unwrap_or_else(|| state.engine.now());
        (state.engine.canvas().size(), state.picture(now))
    })?;
    let Some(out) = checked(size)? else { return array::colours(py, size, picture) };
    let mut target = out.try_readwrite()?;
    let flat = picture.into_flattened();
    let in_order = target.is_c_contiguous();
    match target.as_slice_mut() {
        Ok(slice) if in_order => slice.copy_from_slice(&flat),
        _ => target.as_array_mut().iter_mut().zip(flat).for_each(|(out, new)| *out = new),
    }
    Ok(out)
}

/// Seconds since what each pixel shows was traced; infinite where nothing is known.
pub(crate) fn age<'py>(
    py: Python<'py>,
    shared: &Shared,
    now: Option<Time>,
) -> PyResult<Bound<'py, PyArray2<f32>>> {
    let (size, age) = shared.with(py, |state| {
        let now = now.unwrap_or_else(|| state.engine.now());
        let canvas = state.engine.canvas();
        let traced = canvas.time().zip(canvas.known());
        let age = traced.map(|(time, known)| match known {
            true => now.secs_since(time) as f32,
            false => f32::INFINITY,
        });
        (canvas.size(), age.collect())
    })?;
    array::plane(py, size, age)
}

/// Change d of each pixel's last sample; NaN where there is none.
pub(crate) fn change<'py>(py: Python<'py>, shared: &Shared) -> PyResult<Bound<'py, PyArray2<f32>>> {
    let (size, changes) = shared.with(py, |state| {
        state.forget_changes_of_other_sizes();
        (state.engine.canvas().size(), state.changes.clone())
    })?;
    array::plane(py, size, changes)
}

/// Whether anything is known of each pixel.
pub(crate) fn known<'py>(py: Python<'py>, shared: &Shared) -> PyResult<Bound<'py, PyArray2<bool>>> {
    let (size, known) = shared.with(py, |state| {
        let canvas = state.engine.canvas();
        (canvas.size(), canvas.known().collect())
    })?;
    array::plane(py, size, known)
}

/// Newest sample of each pixel, linear.
pub(crate) fn rgb<'py>(py: Python<'py>, shared: &Shared) -> PyResult<Bound<'py, PyArray3<f32>>> {
    let (size, rgb) = shared.with(py, |state| {
        let canvas = state.engine.canvas();
        (canvas.size(), canvas.rgb().to_vec())
    })?;
    array::colours(py, size, rgb)
}

/// Something that a sampler may know per pixel; None if it does not.
pub(crate) fn known_to_sampler<'py>(
    py: Python<'py>,
    (size, values): (Size, Vec<f32>),
) -> PyResult<Option<Bound<'py, PyArray2<f32>>>> {
    match values.is_empty() {
        true => Ok(None),
        false => array::plane(py, size, values).map(Some),
    }
}
