//! Arrays that come in, checked; arrays that go out, without a copy.

use frameless::Size;
use numpy::prelude::*;
use numpy::{
    Element, PyArray1, PyArray2, PyArray3, PyArrayDescrMethods, PyReadonlyArray1, PyReadonlyArray2,
    PyUntypedArray, dtype,
};
use pyo3::exceptions::{PyException, PyTypeError, PyValueError};
use pyo3::prelude::*;

/// Says of which sample a bad value is: sample number → words.
pub(crate) type Where<'a> = &'a dyn Fn(usize) -> String;

/// Anything that is an array: numpy's, or one that speaks DLPack (torch, jax, …) and lies in the machine's own memory.
fn array<'py>(name: &str, value: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyUntypedArray>> {
    if let Ok(array) = value.cast::<PyUntypedArray>() {
        return if is_regular(array)? { Ok(array.clone()) } else { contiguous(array) };
    }
    let kind = value.get_type().name()?;
    if !value.hasattr("__dlpack__")? {
        return Err(PyTypeError::new_err(format!(
            "{name}: wanted a numpy array (or one with __dlpack__), got {kind}"
        )));
    }
    let numpy = value.py().import("numpy")?;
    let array = numpy.call_method1("from_dlpack", (value,)).map_err(|cause| {
        if !cause.is_instance_of::<PyException>(value.py()) {
            // Ctrl-C, or the end of the program.
            return cause;
        }
        let error = PyValueError::new_err(format!(
            "{name}: this {kind} cannot be read as an array in the machine's memory: {cause}; \
             detach it and move it to the CPU first"
        ));
        error.set_cause(value.py(), Some(cause));
        error
    })?;
    Ok(array.cast_into::<PyUntypedArray>()?)
}

/// Whether elements lie at multiples of their size from each other, and where the processor wants them. The field of a packed
/// structured array may not, and is then no array to Rust.
fn is_regular(array: &Bound<'_, PyUntypedArray>) -> PyResult<bool> {
    let bytes = array.dtype().itemsize().max(1) as isize;
    let is_aligned: bool = array.getattr("flags")?.getattr("aligned")?.extract()?;
    Ok(is_aligned && array.strides().iter().all(|stride| stride % bytes == 0))
}

/// The same numbers in memory of their own.
fn contiguous<'py>(array: &Bound<'py, PyUntypedArray>) -> PyResult<Bound<'py, PyUntypedArray>> {
    Ok(array.call_method1("copy", ("C",))?.cast_into()?)
}

fn wrong_shape(name: &str, wanted: &[usize], array: &Bound<'_, PyUntypedArray>) -> PyErr {
    let (wanted, came) = (tuple(wanted), tuple(array.shape()));
    PyValueError::new_err(format!("{name}: wanted shape {wanted}, got {came}"))
}

fn tuple(shape: &[usize]) -> String {
    match shape {
        [n] => format!("({n},)"),
        _ => format!("({})", shape.iter().map(usize::to_string).collect::<Vec<_>>().join(", ")),
    }
}

fn wrong_dtype(name: &str, wanted: &str, array: &Bound<'_, PyUntypedArray>) -> PyErr {
    PyValueError::new_err(format!("{name}: wanted dtype {wanted}, got {}", array.dtype()))
}

fn is<T: Element>(array: &Bound<'_, PyUntypedArray>) -> bool {
    array.dtype().is_equiv_to(&dtype::<T>(array.py()))
}

/// `n` triples of finite floats: shape (n, 3), float32 or float64, in any memory order.
pub(crate) fn triples(
    name: &str,
    value: &Bound<'_, PyAny>,
    n: usize,
    at: Where<'_>,
) -> PyResult<Vec<[f32; 3]>> {
    finite(name, any_triples(name, value, n)?, at)
}

/// The same, but where `is_idle`, any number will do, and becomes 0.
pub(crate) fn triples_except(
    name: &str,
    value: &Bound<'_, PyAny>,
    n: usize,
    at: Where<'_>,
    is_idle: &dyn Fn(usize) -> bool,
) -> PyResult<Vec<[f32; 3]>> {
    let mut triples = any_triples(name, value, n)?;
    triples.iter_mut().enumerate().filter(|(i, _)| is_idle(*i)).for_each(|(_, t)| *t = [0.0; 3]);
    finite(name, triples, at)
}

fn any_triples(name: &str, value: &Bound<'_, PyAny>, n: usize) -> PyResult<Vec<[f32; 3]>> {
    let array = array(name, value)?;
    if array.shape() != [n, 3] {
        return Err(wrong_shape(name, &[n, 3], &array));
    }
    let triples = if is::<f32>(&array) {
        copied(&array.extract::<PyReadonlyArray2<'_, f32>>()?, |x| x)
    } else if is::<f64>(&array) {
        copied(&array.extract::<PyReadonlyArray2<'_, f64>>()?, |x| x as f32)
    } else {
        return Err(wrong_dtype(name, "float32 or float64", &array));
    };
    Ok(triples)
}

fn copied<T: Element + Copy>(
    array: &PyReadonlyArray2<'_, T>,
    convert: impl Fn(T) -> f32,
) -> Vec<[f32; 3]> {
    match array.as_slice() {
        // As a slice there are also arrays whose columns come first.
        Ok(slice) if array.is_c_contiguous() => {
            slice.as_chunks().0.iter().map(|&[r, g, b]| [r, g, b].map(&convert)).collect()
        }
        _ => {
            let rows = array.as_array();
            let rows = rows.rows().into_iter();
            rows.map(|row| [row[0], row[1], row[2]].map(&convert)).collect()
        }
    }
}

fn finite(name: &str, triples: Vec<[f32; 3]>, at: Where<'_>) -> PyResult<Vec<[f32; 3]>> {
    // One loop without branches for what is nearly always so: 0 · x is 0 unless x is NaN or infinite.
    let check: f32 =
        triples.as_flattened().chunks(64).map(|c| c.iter().map(|x| 0.0 * x).sum::<f32>()).sum();
    if check == 0.0 {
        return Ok(triples);
    }
    let is_bad = |triple: &[f32; 3]| !triple.iter().all(|x| x.is_finite());
    let bad = triples.iter().position(is_bad).unwrap_or_default();
    let came = triples[bad];
    Err(PyValueError::new_err(format!(
        "{name}: wanted finite numbers that fit float32, got {came:?} at {}",
        at(bad)
    )))
}

/// A picture: shape (height, width, 3), finite.
pub(crate) fn picture(name: &str, value: &Bound<'_, PyAny>) -> PyResult<(Size, Vec<[f32; 3]>)> {
    let array = array(name, value)?;
    let &[height, width, 3] = array.shape() else {
        let came = tuple(array.shape());
        return Err(PyValueError::new_err(format!(
            "{name}: wanted shape (height, width, 3), got {came}"
        )));
    };
    if width == 0 || height == 0 || width.saturating_mul(height) > 1 << 26 {
        return Err(PyValueError::new_err(format!(
            "{name}: wanted a picture of at least 1 and at most 2**26 pixels, got {width}×{height}"
        )));
    }
    let size = Size::new(width as u32, height as u32);
    let flat = array.call_method1("reshape", (width * height, 3))?;
    let triples = triples(name, &flat, width * height, &|i| {
        let (x, y) = size.xy(i as u32);
        format!("row {y}, column {x}")
    })?;
    Ok((size, triples))
}

/// Floats, finite: shape (n,), float32 or float64.
pub(crate) fn floats(name: &str, value: &Bound<'_, PyAny>) -> PyResult<Vec<f32>> {
    let floats = any_floats(name, value)?;
    match floats.iter().position(|x| !x.is_finite()) {
        None => Ok(floats),
        Some(bad) => Err(PyValueError::new_err(format!(
            "{name}: wanted finite numbers that fit float32, got {} at index {bad}",
            floats[bad]
        ))),
    }
}

/// Places in a picture: as many x as y.
pub(crate) fn places(x: &Bound<'_, PyAny>, y: &Bound<'_, PyAny>) -> PyResult<Vec<[f32; 2]>> {
    let (x, y) = (floats("x", x)?, floats("y", y)?);
    if x.len() != y.len() {
        let message = format!("y: wanted shape ({},) like x, got ({},)", x.len(), y.len());
        return Err(PyValueError::new_err(message));
    }
    Ok(x.into_iter().zip(y).map(|(x, y)| [x, y]).collect())
}

/// Three finite numbers in a sequence or an array.
pub(crate) fn triple(name: &str, value: &Bound<'_, PyAny>) -> PyResult<[f32; 3]> {
    let wrong = || -> PyResult<PyErr> {
        let message = format!("{name}: wanted three finite numbers, got {}", value.repr()?);
        Ok(PyValueError::new_err(message))
    };
    match value.extract::<[f32; 3]>() {
        Ok(triple) if triple.iter().all(|x| x.is_finite()) => Ok(triple),
        _ => Err(wrong()?),
    }
}

fn any_floats(name: &str, value: &Bound<'_, PyAny>) -> PyResult<Vec<f32>> {
    let array = array(name, value)?;
    if array.shape().len() != 1 {
        let came = tuple(array.shape());
        return Err(PyValueError::new_err(format!("{name}: wanted shape (n,), got {came}")));
    }
    let floats: Vec<f32> = if is::<f32>(&array) {
        array.extract::<PyReadonlyArray1<'_, f32>>()?.as_array().iter().copied().collect()
    } else if is::<f64>(&array) {
        array.extract::<PyReadonlyArray1<'_, f64>>()?.as_array().iter().map(|&x| x as f32).collect()
    } else {
        return Err(wrong_dtype(name, "float32 or float64", &array));
    };
    Ok(floats)
}

/// Whole numbers of any integer type: shape (n,), or `n` of them if that is known.
pub(crate) fn integers(
    name: &str,
    value: &Bound<'_, PyAny>,
    n: Option<usize>,
) -> PyResult<Vec<i64>> {
    let array = array(name, value)?;
    match (array.shape(), n) {
        (&[came], Some(n)) if came == n => {}
        (&[_], None) => {}
        (_, Some(n)) => return Err(wrong_shape(name, &[n], &array)),
        (came, None) => {
            let came = tuple(came);
            return Err(PyValueError::new_err(format!("{name}: wanted shape (n,), got {came}")));
        }
    }
    if !matches!(array.dtype().kind(), b'i' | b'u') {
        return Err(wrong_dtype(name, "an integer type", &array));
    }
    if is::<u64>(&array) {
        let unsigned = array.extract::<PyReadonlyArray1<'_, u64>>()?;
        let narrow = |(i, &n): (usize, &u64)| {
            i64::try_from(n).map_err(|_| {
                let message = format!("{name}: wanted numbers below 2**63, got {n} at index {i}");
                PyValueError::new_err(message)
            })
        };
        return unsigned.as_array().iter().enumerate().map(narrow).collect();
    }
    let wide = array.call_method1("astype", ("int64",))?;
    let wide = wide.extract::<PyReadonlyArray1<'_, i64>>()?;
    Ok(wide.as_array().iter().copied().collect())
}

/// Row-major pixel numbers of a picture: shape (n,).
pub(crate) fn pixels(name: &str, value: &Bound<'_, PyAny>, size: Size) -> PyResult<Vec<u32>> {
    let most = size.pixels() as i64;
    let within = |(i, pixel): (usize, i64)| match (0..most).contains(&pixel) {
        true => Ok(pixel as u32),
        false => Err(PyValueError::new_err(format!(
            "{name}: wanted numbers from 0 to {}, got {pixel} at index {i}",
            most - 1
        ))),
    };
    integers(name, value, None)?.into_iter().enumerate().map(within).collect()
}

/// One probability per pixel: shape (height, width), at least 0, sum 1.
pub(crate) fn probabilities(
    name: &str,
    value: &Bound<'_, PyAny>,
    size: Size,
) -> PyResult<Vec<f32>> {
    let array = array(name, value)?;
    let wanted = [size.height as usize, size.width as usize];
    if array.shape() != wanted {
        return Err(wrong_shape(name, &wanted, &array));
    }
    let values = floats(name, &array.call_method1("reshape", (size.pixels(),))?)?;
    let sum: f64 = values.iter().map(|&value| f64::from(value)).sum();
    if values.iter().any(|&value| value < 0.0) || (sum - 1.0).abs() > 1e-3 {
        return Err(PyValueError::new_err(format!(
            "{name}: wanted numbers of at least 0 whose sum is 1, got a sum of {sum} and a least of {}",
            values.iter().copied().fold(f32::INFINITY, f32::min)
        )));
    }
    Ok(values)
}

/// An array to write a picture into: float32 of shape (height, width, 3), in any regular memory order.
pub(crate) fn target<'py>(
    name: &str,
    value: &Bound<'py, PyAny>,
    size: Size,
) -> PyResult<Bound<'py, PyArray3<f32>>> {
    let Ok(array) = value.cast::<PyUntypedArray>() else {
        let came = value.get_type().name()?;
        return Err(PyTypeError::new_err(format!("{name}: wanted a numpy array, got {came}")));
    };
    let wanted = [size.height as usize, size.width as usize, 3];
    if array.shape() != wanted {
        return Err(wrong_shape(name, &wanted, array));
    }
    if !is::<f32>(array) {
        return Err(wrong_dtype(name, "float32", array));
    }
    if !is_regular(array)? {
        return Err(PyValueError::new_err(format!(
            "{name}: wanted an array whose elements lie at multiples of their size, got a field of a packed structured one"
        )));
    }
    let may_be_written: bool = array.getattr("flags")?.getattr("writeable")?.extract()?;
    if !may_be_written {
        let message = format!("{name}: wanted an array that may be written, got a read-only one");
        return Err(PyValueError::new_err(message));
    }
    Ok(array.clone().cast_into()?)
}

/// Which samples of `n`: numbers from 0, or a mask of `n` truth values.
pub(crate) fn indices(name: &str, value: &Bound<'_, PyAny>, n: usize) -> PyResult<Vec<usize>> {
    let array = array(name, value)?;
    if array.dtype().kind() == b'b' {
        if array.shape() != [n] {
            return Err(wrong_shape(name, &[n], &array));
        }
        let mask = array.extract::<PyReadonlyArray1<'_, bool>>()?;
        let chosen =
            mask.as_array().iter().enumerate().filter(|(_, is)| **is).map(|(i, _)| i).collect();
        return Ok(chosen);
    }
    let wanted = || format!("{name}: wanted numbers from 0 to {}", n as i64 - 1);
    let within = |(at, index): (usize, i64)| match usize::try_from(index) {
        Ok(index) if index < n => Ok(index),
        _ => Err(PyValueError::new_err(format!("{}, got {index} at index {at}", wanted()))),
    };
    integers(name, value, None)?.into_iter().enumerate().map(within).collect()
}

/// `n` 4×4 matrices: shape (n, 4, 4), finite.
pub(crate) fn matrices(name: &str, value: &Bound<'_, PyAny>) -> PyResult<Vec<[[f32; 4]; 4]>> {
    let array = array(name, value)?;
    let &[n, 4, 4] = array.shape() else {
        let came = tuple(array.shape());
        return Err(PyValueError::new_err(format!("{name}: wanted shape (n, 4, 4), got {came}")));
    };
    let flat = any_floats(name, &array.call_method1("reshape", (16 * n,))?)?;
    if let Some(bad) = flat.iter().position(|x| !x.is_finite()) {
        return Err(PyValueError::new_err(format!(
            "{name}: wanted finite numbers that fit float32, got {} in the matrix of object {}",
            flat[bad],
            bad / 16
        )));
    }
    let rows = flat.as_chunks::<4>().0;
    Ok(rows.as_chunks::<4>().0.to_vec())
}

/// Shape (n,), in the memory of `values`.
pub(crate) fn column<T: Element>(py: Python<'_>, values: Vec<T>) -> Bound<'_, PyArray1<T>> {
    PyArray1::from_vec(py, values)
}

/// Shape (n, 3), in the memory of `values`.
pub(crate) fn rows(py: Python<'_>, values: Vec<[f32; 3]>) -> PyResult<Bound<'_, PyArray2<f32>>> {
    let n = values.len();
    PyArray1::from_vec(py, values.into_flattened()).reshape([n, 3])
}

/// Shape (height, width), in the memory of `values`.
pub(crate) fn plane<T: Element>(
    py: Python<'_>,
    size: Size,
    values: Vec<T>,
) -> PyResult<Bound<'_, PyArray2<T>>> {
    PyArray1::from_vec(py, values).reshape([size.height as usize, size.width as usize])
}

/// Shape (height, width, 3), in the memory of `values`.
pub(crate) fn colours(
    py: Python<'_>,
    size: Size,
    values: Vec<[f32; 3]>,
) -> PyResult<Bound<'_, PyArray3<f32>>> {
    let (height, width) = (size.height as usize, size.width as usize);
    PyArray1::from_vec(py, values.into_flattened()).reshape([height, width, 3])
}
