//! The loop for those who own theirs: batches go out, answers come back, pictures at any time.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use frameless::{BatchLength, Clock, Display, Engine, SamplerKind, Time};
use glam::{Affine3A, Mat4};
use numpy::{PyArray2, PyArray3};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use pyo3::{PyTraverseError, PyVisit};

use crate::arguments::{
    any_size, any_size_or_none, finite, positive, reconstruction_kind, stops, whole,
};
use crate::array;
use crate::batch::Batch;
use crate::batches::Batches;
use crate::camera::Camera;
use crate::invoke;
use crate::outside::{Outside, Placed};
use crate::own::Own;
use crate::planes;
use crate::raised::Raised;
use crate::sampler::Given;
use crate::shared::{Length, Shared, State};
use crate::size::{PictureSize, pair};

/// A picture that is never finished: a canvas, a clock, and a sampler that says which pixels are worth tracing now.
///
///     with frameless.Session((640, 480)) as session:
///         for batch in session:
///             batch.submit(render(batch.x, batch.y, batch.time))
///             show(session.image())
///
/// Parameters:
///
/// - `size`: (width, height) in pixels
/// - `sampler`: a name ("adaptive", "change", "permutation", "random"; see BuiltinSampler) or an object with methods of Sampler. What
///     such an object raises arrives where the session was asked for a batch, or told of an answer, whose samples are kept all the same
/// - `reconstruction`: "hold", "filter" or "reproject", the last with +relight, +deep, +antialias
/// - `camera`: the Camera through which the renderer looks; needed if answers carry positions
/// - `seed`: of all that is random
/// - `batch`: samples per batch; default: learned, so that a batch lasts `batch_ms`, or longer if calls are expensive
/// - `batch_ms`: milliseconds from choosing a batch to its answer that are aimed at. Feedback every 4 ms costs 8 to 15 % of the quality
///     that 1 ms would have; a call of Python costs some ten microseconds
/// - `budget`: samples per second at most; default: as many as the renderer can
/// - `simulated`: samples per second of a simulated clock, on which sample n is traced at n / rate however long it takes: the same
///     seed makes the same pictures. Default: the machine's clock
/// - `noisy`: whether colours have noise, as path tracing's; the renderer then makes its random numbers from Batch.seed
/// - `exposure`: stops (powers of two), from -64 to 64, by which radiance is multiplied before it is shown
///
/// Any thread may use a session; calls wait for each other, not for the interpreter. As a context manager it is closed at the end.
///
/// Raises ValueError for values that make no sense, TypeError for what is no sampler.
#[pyclass(frozen, module = "frameless")]
pub(crate) struct Session {
    shared: Arc<Shared>,
    /// The sampler, if it is an object of Python's.
    own_sampler: Mutex<Option<Own>>,
    raised: Raised,
    simulated: bool,
    seed: u64,
}

// Samples per second: a batch of a millisecond must fit into memory.
const FASTEST_SIMULATED: f64 = 1e10;

const LARGEST_BATCH: u32 = 1 << 24;

fn length(batch: Option<i128>, batch_ms: f64) -> PyResult<Length> {
    match batch {
        None => Ok(Length::Learned(BatchLength::new(1e-3 * positive("batch_ms", batch_ms)?))),
        Some(samples) => Ok(Length::Fixed(whole("batch", samples, 1..=LARGEST_BATCH)? as usize)),
    }
}

impl Session {
    /// The next batch that has samples, or `None` at the end. Looks for Ctrl-C while it waits.
    pub(crate) fn next_batch(&self, py: Python<'_>, end: Option<Time>) -> PyResult<Option<Batch>> {
        loop {
            if self.shared.is_closed() {
                return Ok(None);
            }
            let chosen = self.shared.with_long(py, move |state| {
                let is_over = end.is_some_and(|end| state.engine.now() >= end);
                if is_over {
                    return None;
                }
                state.refresh_if_due();
                let wanted = state.length.next_length();
                let asked = state.engine.choose(wanted);
                let outside = state.engine.tracer();
                Some((asked, outside.camera, Arc::clone(&outside.transforms)))
            })?;
            let Some((asked, camera, transforms)) = chosen else { return Ok(None) };
            if !asked.requests.is_empty() {
                let shared = Arc::clone(&self.shared);
                return Ok(Some(Batch::new(shared, asked, self.seed, camera, transforms)));
            }
            py.check_signals()?;
            if !self.simulated {
                // Nothing is due within the budget.
                py.detach(|| std::thread::sleep(Duration::from_micros(500)));
            }
        }
    }

    fn own_sampler(&self) -> MutexGuard<'_, Option<Own>> {
        self.own_sampler.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn end(&self, py: Python<'_>, seconds: Option<f64>) -> PyResult<Option<Time>> {
        let Some(seconds) = seconds else { return Ok(None) };
        let seconds = finite("seconds", seconds)?;
        let now = self.shared.with(py, |state| state.engine.now())?;
        Ok(Some(Time::from_secs(now.secs() + seconds)))
    }
}

#[pymethods]
impl Session {
    #[new]
    #[pyo3(signature = (
        size, *, sampler=None, reconstruction="reproject+antialias", camera=None, seed=1, batch=None,
        batch_ms=4.0, budget=None, simulated=None, noisy=false, exposure=0.0
    ))]
    #[expect(clippy::too_many_arguments, reason = "Python's are named")]
    fn new(
        py: Python<'_>,
        size: PictureSize,
        sampler: Option<Bound<'_, PyAny>>,
        reconstruction: &str,
        camera: Option<Camera>,
        #[pyo3(from_py_with = any_size)] seed: i128,
        #[pyo3(from_py_with = any_size_or_none)] batch: Option<i128>,
        batch_ms: f64,
        budget: Option<f64>,
        simulated: Option<f64>,
        noisy: bool,
        exposure: f64,
    ) -> PyResult<Session> {
        let seed = whole("seed", seed, 0..=u64::MAX)?;
        let reconstruction = reconstruction_kind(reconstruction)?;
        let raised = Raised::default();
        let (sampler, own_sampler) = match sampler {
            None => (SamplerKind::default().build(seed), None),
            Some(sampler) => Given::of(&sampler, &raised)?.build(seed),
        };
        let clock = match simulated {
            None => Clock::real(),
            Some(_) if batch.is_some() || budget.is_some() => {
                return Err(PyValueError::new_err(
                    "simulated: a simulated clock has its own batches and its own rate; leave out batch and budget",
                ));
            }
            Some(rate) if rate > FASTEST_SIMULATED => {
                let message =
                    format!("simulated: wanted at most {FASTEST_SIMULATED:e}, got {rate}");
                return Err(PyValueError::new_err(message));
            }
            Some(rate) => Clock::simulated(positive("simulated", rate)?),
        };
        let stops = stops(exposure)?;
        let budget = budget.map(|budget| positive("budget", budget)).transpose()?;
        let length = length(batch, batch_ms)?;
        let mut state = py.detach(move || {
            let mut engine = Engine::new(size.0, clock, sampler, Outside::new(camera, noisy));
            engine.set_reconstruction(reconstruction.build());
            engine.set_display(Display::new(stops));
            engine.set_budget(budget);
            State::new(engine, length)
        });
        state.budget = budget;
        let shared = Arc::new(Shared::new(state, raised.clone()));
        let own_sampler = Mutex::new(own_sampler);
        Ok(Session { shared, own_sampler, raised, simulated: simulated.is_some(), seed })
    }

    /// (width, height) in pixels.
    #[getter]
    fn size(&self, py: Python<'_>) -> PyResult<(u32, u32)> {
        self.shared.with(py, |state| pair(state.engine.canvas().size()))
    }

    /// Seconds on the session's clock since it began.
    #[getter]
    fn now(&self, py: Python<'_>) -> PyResult<f64> {
        self.shared.with(py, |state| state.engine.now().secs())
    }

    /// The moment of the scene that is shown, in seconds of the scene's own time; may be set, to jump there.
    #[getter]
    fn time(&self, py: Python<'_>) -> PyResult<f64> {
        self.shared.with(py, |state| state.engine.timeline().scene_secs(state.engine.now()))
    }

    #[setter]
    fn set_time(&self, py: Python<'_>, seconds: f64) -> PyResult<()> {
        let seconds = finite("time", seconds)?;
        self.shared.with(py, |state| {
            let now = state.engine.now();
            state.engine.timeline_mut().seek(now, seconds);
        })
    }

    /// Seconds of the scene per second of the clock; 0 stands still, negative runs backwards. May be set.
    #[getter]
    fn speed(&self, py: Python<'_>) -> PyResult<f64> {
        self.shared.with(py, |state| state.engine.timeline().speed())
    }

    #[setter]
    fn set_speed(&self, py: Python<'_>, speed: f64) -> PyResult<()> {
        let speed = finite("speed", speed)?;
        self.shared.with(py, |state| {
            let now = state.engine.now();
            state.engine.timeline_mut().set_speed(now, speed);
        })
    }

    /// The Camera through which the renderer looks, or None. Set it to move: samples with positions go along at once.
    #[getter]
    fn camera(&self, py: Python<'_>) -> PyResult<Option<Camera>> {
        self.shared.with(py, |state| state.engine.tracer().camera)
    }

    #[setter]
    fn set_camera(&self, py: Python<'_>, camera: Option<Camera>) -> PyResult<()> {
        self.shared.with(py, |state| state.engine.tracer_mut().camera = camera)
    }

    /// Samples per second at most, or None; may be set. A simulated clock has its own rate and ignores it.
    #[getter]
    fn budget(&self, py: Python<'_>) -> PyResult<Option<f64>> {
        self.shared.with(py, |state| state.budget)
    }

    #[setter]
    fn set_budget(&self, py: Python<'_>, budget: Option<f64>) -> PyResult<()> {
        let budget = budget.map(|budget| positive("budget", budget)).transpose()?;
        self.shared.with(py, |state| {
            state.budget = budget;
            state.engine.set_budget(budget);
        })
    }

    /// Stops (powers of two) by which radiance is multiplied before it is shown; may be set, and restarts nothing.
    #[getter]
    fn exposure(&self, py: Python<'_>) -> PyResult<f32> {
        self.shared.with(py, |state| state.engine.display().exposure_stops())
    }

    #[setter]
    fn set_exposure(&self, py: Python<'_>, exposure: f64) -> PyResult<()> {
        let stops = stops(exposure)?;
        self.shared.with(py, |state| state.engine.set_display(Display::new(stops)))
    }

    /// What the loop has done: {"batches": chosen, "kept": samples in the picture, "dropped": samples that came too late}.
    #[getter]
    fn counters<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let counters = self.shared.with(py, |state| state.engine.counters())?;
        let words = PyDict::new(py);
        words.set_item("batches", counters.batches)?;
        words.set_item("kept", counters.kept)?;
        words.set_item("dropped", counters.dropped)?;
        Ok(words)
    }

    /// Where objects are now, by object_id: world from object, shape (n, 4, 4). Objects beyond n stand where they were made.
    ///
    /// Samples of an object that was moved move along, in the next picture already. Positions in answers are the world's at the
    /// time of their batch.
    ///
    /// Raises ValueError for a wrong shape, values that are not finite, or a matrix that flattens its object.
    fn place(&self, py: Python<'_>, world_from_object: &Bound<'_, PyAny>) -> PyResult<()> {
        let matrices = array::matrices("world_from_object", world_from_object)?;
        let placed = |(i, rows): (usize, &[[f32; 4]; 4])| {
            if rows[3] != [0.0, 0.0, 0.0, 1.0] {
                let message = format!(
                    "world_from_object: wanted last rows of (0, 0, 0, 1), got {:?} for object {i}; transposed?",
                    rows[3]
                );
                return Err(PyValueError::new_err(message));
            }
            let matrix = Affine3A::from_mat4(Mat4::from_cols_array_2d(rows).transpose());
            Placed::new(matrix).ok_or_else(|| {
                PyValueError::new_err(format!(
                    "world_from_object: wanted matrices that have an inverse, got one for object {i} that has none"
                ))
            })
        };
        let transforms = matrices.iter().enumerate().map(placed).collect::<PyResult<Vec<_>>>()?;
        let transforms = Arc::new(transforms);
        self.shared.with(py, |state| state.engine.tracer_mut().transforms = transforms)
    }

    /// Go on in another size, (width, height) in pixels, with the same picture. Answers to batches of the old size are dropped.
    fn resize(&self, py: Python<'_>, size: PictureSize) -> PyResult<()> {
        self.shared.with(py, |state| state.engine.resize(size.0))
    }

    /// Let another sampler choose from now on, by name or as an object; the picture stays.
    fn set_sampler(&self, py: Python<'_>, sampler: &Bound<'_, PyAny>) -> PyResult<()> {
        let (sampler, own) = Given::of(sampler, &self.raised)?.build(self.seed);
        // The one before goes without any lock held: what it does then may ask for this session.
        let before = self.shared.with(py, |state| state.engine.replace_sampler(sampler))?;
        let own_before = std::mem::replace(&mut *self.own_sampler(), own);
        drop((before, own_before));
        Ok(())
    }

    /// Make pictures in another way from now on; what the canvas holds stays.
    fn set_reconstruction(&self, py: Python<'_>, name: &str) -> PyResult<()> {
        let reconstruction = reconstruction_kind(name)?;
        self.shared.with(py, |state| state.engine.set_reconstruction(reconstruction.build()))
    }

    /// The picture now: display-referred sRGB in [0, 1], float32, shape (height, width, 3).
    ///
    /// The array is the caller's own, made without a copy. `out`: an array of that shape to write into instead; it is returned.
    #[pyo3(signature = (out=None))]
    fn image<'py>(
        &self,
        py: Python<'py>,
        out: Option<Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyArray3<f32>>> {
        planes::image(py, &self.shared, None, out)
    }

    /// Newest sample of each pixel's centre: linear RGB radiance, float32, shape (height, width, 3). What is added to it while the picture
    /// rests is in `image` only.
    fn rgb<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray3<f32>>> {
        planes::rgb(py, &self.shared)
    }

    /// Seconds since each pixel was last found to show what it shows, infinite where nothing is known: float32, shape (height, width).
    fn age<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f32>>> {
        planes::age(py, &self.shared, None)
    }

    /// How far each pixel's last sample was from what the picture showed there: squared sRGB difference summed over channels, in
    /// [0, 3]; NaN where there is none. float32, shape (height, width).
    fn change<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f32>>> {
        planes::change(py, &self.shared)
    }

    /// Whether anything is known of what each pixel shows: bool, shape (height, width).
    fn known<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<bool>>> {
        planes::known(py, &self.shared)
    }

    /// Probability that the next draw is each pixel, float32, shape (height, width), sum 1; None if the sampler does not know.
    fn probability<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyArray2<f32>>>> {
        let known = self.shared.with(py, |state| {
            let (now, canvas) = (state.engine.now(), state.engine.canvas());
            (canvas.size(), state.engine.sampler().inspect(now, canvas).probability)
        })?;
        planes::known_to_sampler(py, known)
    }

    /// Probability that the next draw falls into each pixel's tile; otherwise as `probability`.
    fn tile_probability<'py>(
        &self,
        py: Python<'py>,
    ) -> PyResult<Option<Bound<'py, PyArray2<f32>>>> {
        let known = self.shared.with(py, |state| {
            let (now, canvas) = (state.engine.now(), state.engine.canvas());
            (canvas.size(), state.engine.sampler().inspect(now, canvas).tile_probability)
        })?;
        planes::known_to_sampler(py, known)
    }

    /// Batches for so many seconds of the session's clock, or until it is closed.
    #[pyo3(signature = (seconds=None))]
    fn batches(slf: Bound<'_, Session>, seconds: Option<f64>) -> PyResult<Batches> {
        let end = slf.get().end(slf.py(), seconds)?;
        Ok(Batches::new(slf.unbind(), end))
    }

    /// Let `render(x, y, time, camera)` answer batches for so many seconds of the session's clock, or until it is closed.
    ///
    /// Parameters:
    ///
    /// - `render`: returns linear RGB of shape (n, 3), or Samples with positions. x, y: float32 arrays of shape (n,), pixels from the
    ///     top-left corner; time: seconds of the scene; camera: the session's Camera or None. A session of a noisy renderer calls
    ///     render(x, y, time, camera, seed) with Batch.seed
    /// - `seconds`: how long; default: until `close` is called, by render or another thread
    ///
    /// Returns the number of samples kept. What render raises arrives as it is, and the session may be used on.
    #[pyo3(signature = (render, seconds=None))]
    fn run(
        &self,
        py: Python<'_>,
        render: &Bound<'_, PyAny>,
        seconds: Option<f64>,
    ) -> PyResult<usize> {
        let end = self.end(py, seconds)?;
        let mut kept = 0;
        while let Some(batch) = self.next_batch(py, end)? {
            let is_noisy = self.shared.with(py, |state| state.engine.tracer().is_noisy)?;
            kept += invoke::answer(render, &batch, is_noisy)?;
            py.check_signals()?;
        }
        Ok(kept)
    }

    /// Whether `close` has been called.
    #[getter]
    fn closed(&self) -> bool {
        self.shared.is_closed()
    }

    /// No more batches: loops over the session end. Pictures can still be asked for, and late answers given.
    fn close(&self) {
        self.shared.close();
    }

    fn __traverse__(&self, visit: PyVisit<'_>) -> Result<(), PyTraverseError> {
        match self.own_sampler.try_lock().as_deref() {
            Ok(Some(own)) => own.visit(&visit),
            Ok(None) | Err(_) => Ok(()),
        }
    }

    fn __clear__(&self) {
        let own = self.own_sampler().take();
        own.inspect(Own::clear);
    }

    fn __iter__(slf: Bound<'_, Session>) -> Batches {
        Batches::new(slf.unbind(), None)
    }

    fn __enter__(slf: Bound<'_, Session>) -> Bound<'_, Session> {
        slf
    }

    #[pyo3(signature = (*_exception))]
    fn __exit__(&self, _exception: &Bound<'_, pyo3::types::PyTuple>) {
        self.close();
    }
}
