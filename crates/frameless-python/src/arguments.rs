//! Arguments that are names, and numbers within limits.

use std::ops::RangeInclusive;

use frameless::{ReconstructionKind, SamplerKind};
use frameless_eval::sampler_from_name;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

/// A sampler by name, with its parameters in brackets.
pub(crate) fn sampler_kind(name: &str) -> PyResult<SamplerKind> {
    sampler_from_name(name).map_err(|wrong| PyValueError::new_err(format!("sampler: {wrong}")))
}

/// How samples are shown, by name.
pub(crate) fn reconstruction_kind(name: &str) -> PyResult<ReconstructionKind> {
    ReconstructionKind::from_name(name).ok_or_else(|| {
        PyValueError::new_err(format!(
            "reconstruction: wanted \"hold\", \"filter\" or \"reproject\", the last with +relight, +deep, +antialias; got {name:?}"
        ))
    })
}

/// A whole number that Python has given as one of any size.
pub(crate) fn whole<T: TryFrom<i128> + Into<i128> + Copy>(
    name: &str,
    value: i128,
    within: RangeInclusive<T>,
) -> PyResult<T> {
    let (least, most): (i128, i128) = ((*within.start()).into(), (*within.end()).into());
    let fits = (least..=most).contains(&value).then(|| T::try_from(value).ok()).flatten();
    fits.ok_or_else(|| {
        let message = format!("{name}: wanted a whole number from {least} to {most}, got {value}");
        PyValueError::new_err(message)
    })
}

/// A number above 0.
pub(crate) fn positive(name: &str, value: f64) -> PyResult<f64> {
    match value > 0.0 && value.is_finite() {
        true => Ok(value),
        false => {
            Err(PyValueError::new_err(format!("{name}: wanted a number above 0, got {value}")))
        }
    }
}

/// Neither NaN nor infinite.
pub(crate) fn finite(name: &str, value: f64) -> PyResult<f64> {
    match value.is_finite() {
        true => Ok(value),
        false => Err(PyValueError::new_err(format!("{name}: wanted a finite number, got {value}"))),
    }
}

/// 2^±64 reaches from the darkest to the brightest light there is.
pub(crate) fn stops(value: f64) -> PyResult<f32> {
    match (-64.0..=64.0).contains(&value) {
        true => Ok(value as f32),
        false => Err(PyValueError::new_err(format!(
            "exposure: wanted from -64 to 64 stops, got {value}"
        ))),
    }
}
