//! How far one picture is from another.

use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::array;
use crate::interrupt::interruptible;

type Colours = Vec<[f32; 3]>;

/// Two pictures of one size, and their width.
fn pair(a: &Bound<'_, PyAny>, b: &Bound<'_, PyAny>) -> PyResult<(Colours, Colours, usize)> {
    let ((a_size, a), (b_size, b)) = (array::picture("a", a)?, array::picture("b", b)?);
    if a_size != b_size {
        return Err(PyValueError::new_err(format!(
            "b: wanted a picture of {}×{} like a, got {}×{}",
            a_size.width, a_size.height, b_size.width, b_size.height
        )));
    }
    Ok((a, b, a_size.width as usize))
}

/// Root mean squared difference of two pictures over all pixels and channels; 0 if they are equal.
///
/// - `a`, `b`: shape (height, width, 3), display-referred sRGB in [0, 1]
#[pyfunction]
pub(crate) fn rmse(a: &Bound<'_, PyAny>, b: &Bound<'_, PyAny>) -> PyResult<f64> {
    let py = a.py();
    let (a, b, _) = pair(a, b)?;
    Ok(py.detach(|| frameless_eval::rmse(&a, &b)))
}

/// Peak signal-to-noise ratio of two pictures in dB, -20 log10(RMSE); infinite if they are equal.
///
/// - `a`, `b`: shape (height, width, 3), display-referred sRGB in [0, 1]
#[pyfunction]
pub(crate) fn psnr(a: &Bound<'_, PyAny>, b: &Bound<'_, PyAny>) -> PyResult<f64> {
    Ok(frameless_eval::psnr_db(rmse(a, b)?).unwrap_or(f64::INFINITY))
}

/// Structural similarity of two pictures (Wang et al. 2004) over luma, in [-1, 1]; 1 if they are equal.
///
/// - `a`, `b`: shape (height, width, 3), display-referred sRGB in [0, 1], each side at least 11 pixels
#[pyfunction]
pub(crate) fn ssim(a: &Bound<'_, PyAny>, b: &Bound<'_, PyAny>) -> PyResult<f64> {
    let (a_colours, b_colours, width) = pair(a, b)?;
    let py = a.py();
    let similarity =
        interruptible(py, move |_| frameless_eval::ssim(&a_colours, &b_colours, width))?;
    similarity
        .ok_or_else(|| PyValueError::new_err("a: wanted at least 11 pixels in each direction"))
}

/// Mean FLIP difference of a picture `b` from a reference `a` (Andersson et al. 2020), in [0, 1]; 0 if they are equal.
///
/// - `a`, `b`: shape (height, width, 3), display-referred sRGB in [0, 1]
#[pyfunction]
pub(crate) fn flip(a: &Bound<'_, PyAny>, b: &Bound<'_, PyAny>) -> PyResult<f64> {
    let (a_colours, b_colours, width) = pair(a, b)?;
    interruptible(a.py(), move |_| frameless_eval::flip(&a_colours, &b_colours, width))
}
