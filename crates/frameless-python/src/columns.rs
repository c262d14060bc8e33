//! Requests as arrays, one entry per sample.

use frameless::{Batch, Request};
use numpy::PyArray1;
use pyo3::prelude::*;

use crate::array;

fn column<'py, T: numpy::Element>(
    py: Python<'py>,
    batch: &Batch,
    value: impl Fn(&Request) -> T,
) -> Bound<'py, PyArray1<T>> {
    array::column(py, batch.requests.iter().map(value).collect())
}

/// Columns in pixels from the picture's left border.
pub(crate) fn x<'py>(py: Python<'py>, batch: &Batch) -> Bound<'py, PyArray1<f32>> {
    column(py, batch, |request| request.position_px(batch.size)[0])
}

/// Rows in pixels from the picture's upper border.
pub(crate) fn y<'py>(py: Python<'py>, batch: &Batch) -> Bound<'py, PyArray1<f32>> {
    column(py, batch, |request| request.position_px(batch.size)[1])
}

/// Row-major pixel numbers.
pub(crate) fn pixel<'py>(py: Python<'py>, batch: &Batch) -> Bound<'py, PyArray1<u32>> {
    column(py, batch, |request| request.pixel)
}

/// Numbers of samples in their pixels' sequences.
pub(crate) fn sample_index<'py>(py: Python<'py>, batch: &Batch) -> Bound<'py, PyArray1<u32>> {
    column(py, batch, |request| request.sample_index)
}

/// Random numbers that are the same for the same request and seed.
pub(crate) fn seed<'py>(
    py: Python<'py>,
    batch: &Batch,
    session_seed: u64,
) -> Bound<'py, PyArray1<u32>> {
    let [low, high] = [session_seed as u32, (session_seed >> 32) as u32];
    let key = pcg(low.wrapping_add(pcg(high)));
    column(py, batch, |request| {
        pcg(request.sample_index.wrapping_add(pcg(request.pixel.wrapping_add(key))))
    })
}

/// A permutation of 32-bit numbers that looks random: PCG-RXS-M-XS (O'Neill 2014), as Jarzynski and Olano 2020 recommend it.
fn pcg(input: u32) -> u32 {
    let state = input.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
    let word = ((state >> ((state >> 28) + 4)) ^ state).wrapping_mul(277_803_737);
    (word >> 22) ^ word
}
