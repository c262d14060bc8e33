//! Sizes of pictures as arguments: `(width, height)`.

use frameless::Size;
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;

/// More pixels than any screen has; their samples would take 8 GB.
const MOST_PIXELS: u64 = 1 << 26;

/// A checked `(width, height)`.
#[derive(Clone, Copy)]
pub(crate) struct PictureSize(pub(crate) Size);

impl<'a, 'py> FromPyObject<'a, 'py> for PictureSize {
    type Error = PyErr;

    fn extract(object: Borrowed<'a, 'py, PyAny>) -> PyResult<PictureSize> {
        let Ok([width, height]) = object.extract::<[i64; 2]>() else {
            let came = object.repr()?;
            return Err(PyTypeError::new_err(format!(
                "size: wanted (width, height) in pixels, two whole numbers, got {came}"
            )));
        };
        let pixels = width.checked_mul(height).and_then(|pixels| u64::try_from(pixels).ok());
        let fits = pixels.is_some_and(|pixels| pixels <= MOST_PIXELS);
        match (u32::try_from(width), u32::try_from(height)) {
            (Ok(width @ 1..), Ok(height @ 1..)) if fits => {
                Ok(PictureSize(Size::new(width, height)))
            }
            _ => Err(PyValueError::new_err(format!(
                "size: wanted a width and a height of at least 1 and at most {MOST_PIXELS} pixels, \
                 got ({width}, {height})"
            ))),
        }
    }
}

/// As Python's `(width, height)`.
pub(crate) fn pair(size: Size) -> (u32, u32) {
    (size.width, size.height)
}
