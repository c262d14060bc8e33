//! The Python package's compiled half, `frameless._frameless`: what the package shows of it is in `python/frameless`.
//!
//! Nothing here holds the interpreter while the engine works, and nothing is handed to Python that Rust still writes: arrays that
//! go out own their memory, arrays that come in are copied once, while they are checked.

mod arguments;
mod array;
mod batch;
mod batches;
mod bench;
mod builtin;
mod calls;
mod camera;
mod canvas;
mod columns;
mod compare;
mod handed_on;
mod hits;
mod interrupt;
mod invoke;
mod metrics;
mod mirror;
mod observed;
mod outside;
mod own;
mod planes;
mod raised;
mod sampler;
mod scene;
mod serve;
mod session;
mod shared;
mod size;
mod stage;

use pyo3::prelude::*;

/// The compiled half of the package frameless.
#[pymodule(gil_used = false)]
fn _frameless(module: &Bound<'_, PyModule>) -> PyResult<()> {
    // numpy's own functions are looked up here and not in the middle of something: Ctrl-C during the look-up would be a panic.
    numpy::PyArray1::<f32>::zeros(module.py(), [0], false);
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add_class::<camera::Camera>()?;
    module.add_class::<session::Session>()?;
    module.add_class::<batches::Batches>()?;
    module.add_class::<batch::Batch>()?;
    module.add_class::<canvas::PyCanvas>()?;
    module.add_class::<mirror::CanvasView>()?;
    module.add_class::<observed::Observed>()?;
    module.add_class::<builtin::BuiltinSampler>()?;
    module.add_class::<scene::Scene>()?;
    module.add_class::<serve::Served>()?;
    module.add_function(wrap_pyfunction!(serve::start_serving, module)?)?;
    module.add_function(wrap_pyfunction!(bench::loop_without_python, module)?)?;
    module.add_function(wrap_pyfunction!(compare::run_experiment, module)?)?;
    module.add_function(wrap_pyfunction!(metrics::rmse, module)?)?;
    module.add_function(wrap_pyfunction!(metrics::psnr, module)?)?;
    module.add_function(wrap_pyfunction!(metrics::ssim, module)?)?;
    module.add_function(wrap_pyfunction!(metrics::flip, module)?)
}
