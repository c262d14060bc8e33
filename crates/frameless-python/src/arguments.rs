//! Arguments that are names, and numbers within limits.

use std::ops::RangeInclusive;

use frameless::{ReconstructionKind, SamplerKind};
use frameless_eval::sampler_from_name;
use pyo3::exceptions::{PyOverflowError, PyValueError};
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

/// A whole number of any size: what has more than 128 bits, which nothing takes, counts as the nearest that has not.
pub(crate) fn any_size(value: &Bound<'_, PyAny>) -> PyResult<i128> {
    match value.extract::<i128>() {
        Err(error) if error.is_instance_of::<PyOverflowError>(value.py()) => {
            Ok(if value.lt(0)? { i128::MIN } else { i128::MAX })
        }
        number => number,
    }
}

/// The same, or None.
pub(crate) fn any_size_or_none(value: &Bound<'_, PyAny>) -> PyResult<Option<i128>> {
    if value.is_none() { Ok(None) } else { any_size(value).map(Some) }
}

/// A whole number of [`any_size`], if it lies `within`.
pub(crate) fn whole<T: TryFrom<i128> + Into<i128> + Copy>(
    name: &str,
    value: i128,
    within: RangeInclusive<T>,
) -> PyResult<T> {
    let (least, most): (i128, i128) = ((*within.start()).into(), (*within.end()).into());
    let fits = (least..=most).contains(&value).then(|| T::try_from(value).ok()).flatten();
    fits.ok_or_else(|| {
        let came = match value {
            i128::MIN => "-2**127 or less".to_owned(),
            i128::MAX => "2**127 or more".to_owned(),
            value => value.to_string(),
        };
        let message = format!("{name}: wanted a whole number from {least} to {most}, got {came}");
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
