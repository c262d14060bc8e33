//! A renderer in Python on a web page.

use std::net::{IpAddr, Ipv4Addr, SocketAddr};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use frameless::{Clock, Sampler, SamplerKind, ToneMap};
use frameless_session::{Helm, PictureSize as Shown, Session, Settings};
use frameless_web::{MOST_PIXELS, Options, Server, Show, Stopper};
use pyo3::exceptions::{PyOSError, PyRuntimeError, PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::{PyTraverseError, PyVisit};

use crate::arguments::{any_size, positive, reconstruction_kind, stops, whole};
use crate::calls::Calls;
use crate::camera::Camera;
use crate::interrupt::LOOK_EVERY;
use crate::own::Own;
use crate::raised::Raised;
use crate::sampler::Given;
use crate::size::PictureSize;
use crate::stage::PythonStage;

/// A page that shows a renderer while it works; made by `frameless.serve`. In a notebook, the last line of a cell shows it inline.
///
/// What the renderer raises stops the picture, and is said on the page; `wait`, `stop` and `check` raise it as it is, and after that, or
/// with `set_render`, the picture goes on. If nobody waits for it, it is written to stderr, too.
#[pyclass(frozen, weakref, module = "frameless")]
pub(crate) struct Served {
    url: String,
    size: (u32, u32),
    render: Own,
    sampler: Option<Own>,
    raised: Raised,
    calls: Calls,
    stopper: Stopper,
    /// Ctrl-C has ended the waiting for its end: nobody waits for long again.
    given_up: AtomicBool,
    /// Where its threads are.
    process: u32,
    /// Until it has been waited for.
    thread: Mutex<Option<JoinHandle<anyhow::Result<()>>>>,
}

/// How long a call of the renderer may take to its end after Ctrl-C before it is left behind.
const PATIENCE: Duration = Duration::from_millis(150);

impl Served {
    fn thread(&self) -> std::sync::MutexGuard<'_, Option<JoinHandle<anyhow::Result<()>>>> {
        self.thread.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn is_running(&self) -> bool {
        let is_here = self.process == std::process::id();
        is_here && self.thread().as_ref().is_some_and(|thread| !thread.is_finished())
    }

    /// Waits for the server's end, without the interpreter. Ctrl-C ends the call of the renderer that is under way, or the waiting if it does not
    /// end. In the thread that calls the renderer, and so has to end first, there is nothing to wait for.
    fn join(&self, py: Python<'_>) -> PyResult<()> {
        if self.calls.is_caller() || self.process != std::process::id() {
            // A process that was forked off has no copy of the threads.
            return Ok(());
        }
        let _waiting = self.calls.wait();
        let given_up = self.given_up.load(Ordering::SeqCst);
        let mut end = given_up.then(|| Instant::now() + PATIENCE);
        let mut signal = Ok(());
        while self.is_running() && end.is_none_or(|end| Instant::now() < end) {
            py.detach(|| std::thread::sleep(LOOK_EVERY));
            if let Err(interrupt) = py.check_signals() {
                signal = Err(interrupt);
                self.calls.interrupt(py);
                end = Some(Instant::now() + PATIENCE);
                self.given_up.store(true, Ordering::SeqCst);
            }
        }
        signal?;
        if self.is_running() {
            return Ok(());
        }
        let Some(thread) = self.thread().take() else { return Ok(()) };
        match py.detach(|| thread.join()) {
            Ok(Ok(())) => Ok(()),
            Ok(Err(error)) => Err(PyRuntimeError::new_err(format!("{error:#}"))),
            Err(_) => Err(PyRuntimeError::new_err("the server panicked; its message is above")),
        }
    }

    /// Stops after Ctrl-C, for which nobody waits long.
    fn give_up(&self, py: Python<'_>) {
        self.given_up.store(true, Ordering::SeqCst);
        self.calls.interrupt(py);
        self.stopper.stop();
        // What else it has to say is not what ends the program.
        self.join(py).ok();
    }
}

#[pymethods]
impl Served {
    /// The one address to open in a browser on this machine. It holds the secret that lets one in.
    #[getter]
    fn url(&self) -> &str {
        &self.url
    }

    /// (width, height) of the picture in pixels.
    #[getter]
    fn size(&self) -> (u32, u32) {
        self.size
    }

    /// Whether the page is still served.
    #[getter]
    fn running(&self) -> bool {
        self.is_running()
    }

    /// Whether the renderer has raised something that nobody has been told of yet.
    #[getter]
    fn failed(&self) -> bool {
        self.raised.is_set()
    }

    /// Raises what the renderer has raised, if anything; the picture goes on.
    fn check(&self) -> PyResult<()> {
        self.raised.take()
    }

    /// Let another function render from now on; the picture stays until it is traced anew. Forgets what the old one raised.
    fn set_render(&self, py: Python<'_>, render: Py<PyAny>) -> PyResult<()> {
        if !render.bind(py).is_callable() {
            return Err(no_function());
        }
        self.render.set(py, render);
        self.raised.take().ok();
        Ok(())
    }

    /// Wait until the page is stopped, the renderer raises something, which is raised here and stops the page, or so many seconds
    /// have passed. Ctrl-C stops it, too.
    #[pyo3(signature = (seconds=None))]
    fn wait(&self, py: Python<'_>, seconds: Option<f64>) -> PyResult<()> {
        let _waiting = self.calls.wait();
        let seconds = seconds.filter(|seconds| seconds.is_finite()).map(|seconds| seconds.max(0.0));
        let end = seconds.map(|seconds| Instant::now() + Duration::from_secs_f64(seconds.min(1e9)));
        while self.is_running() && end.is_none_or(|end| Instant::now() < end) {
            py.detach(|| std::thread::sleep(LOOK_EVERY));
            if let Err(interrupt) = py.check_signals() {
                self.give_up(py);
                return Err(interrupt);
            }
            let raised = self.raised.take();
            if raised.is_err() {
                self.stopper.stop();
                self.join(py)?;
                return raised;
            }
        }
        Ok(())
    }

    /// Serve no longer. Raises what the renderer has raised that nobody has been told of.
    fn stop(&self, py: Python<'_>) -> PyResult<()> {
        self.stopper.stop();
        self.join(py)?;
        self.raised.take()
    }

    /// The page inline in a notebook.
    fn _repr_html_(&self) -> String {
        // Room for the page's own controls beside or below the picture.
        let height = self.size.1.max(360) + 180;
        // As Jupyter's own address: in a page of another host, this one's cookie would be a stranger's.
        let url = self.url.replace("127.0.0.1", "localhost");
        format!(
            "<iframe src=\"{url}\" width=\"100%\" height=\"{height}\" style=\"border:0\"></iframe>"
        )
    }

    fn __traverse__(&self, visit: PyVisit<'_>) -> Result<(), PyTraverseError> {
        // While it runs, another thread has hold of them.
        let is_over = self.thread.try_lock().is_ok_and(|thread| thread.is_none());
        let held = [Some(&self.render), self.sampler.as_ref()].into_iter().flatten();
        held.filter(|_| is_over).try_for_each(|own| own.visit(&visit))
    }

    fn __clear__(&self) {
        self.render.clear();
        self.sampler.as_ref().inspect(|own| own.clear());
    }

    fn __repr__(&self) -> String {
        let state = if self.is_running() { "at" } else { "stopped; was at" };
        format!("<frameless.Served {state} {}>", self.url)
    }
}

fn no_function() -> PyErr {
    PyTypeError::new_err("render: wanted a function render(x, y, time, camera)")
}

/// An error of the server with the names of Python's arguments.
fn in_python(wrong: &anyhow::Error) -> String {
    let text = format!("{wrong:#}").replace("--allow-frame ", "allow_frame: ");
    text.replace("--port 0", "port=0").replace("--port", "port=")
}

/// See `frameless.serve`.
#[pyfunction]
#[pyo3(signature = (
    render, size, camera, sampler, reconstruction, batch_ms, budget, exposure, noisy, port, allow_frame
))]
#[expect(clippy::too_many_arguments, reason = "Python's are named")]
pub(crate) fn start_serving(
    py: Python<'_>,
    render: &Bound<'_, PyAny>,
    size: PictureSize,
    camera: Camera,
    sampler: &Bound<'_, PyAny>,
    reconstruction: &str,
    batch_ms: f64,
    budget: Option<f64>,
    exposure: f64,
    noisy: bool,
    #[pyo3(from_py_with = any_size)] port: i128,
    allow_frame: Option<String>,
) -> PyResult<Served> {
    if !render.is_callable() {
        return Err(no_function());
    }
    if size.0.pixels() > MOST_PIXELS {
        return Err(PyValueError::new_err(format!(
            "size: wanted at most {MOST_PIXELS} pixels on a page, got {}×{}",
            size.0.width, size.0.height
        )));
    }
    let calls = Calls::default();
    let raised = Raised::on_page(calls.clone());
    let given = Given::of(sampler, &raised)?;
    let settings = Settings {
        sampler: match &given {
            Given::Builtin(kind, None) => *kind,
            Given::Builtin(_, Some(_)) | Given::Python(..) => SamplerKind::default(),
        },
        reconstruction: reconstruction_kind(reconstruction)?,
        samples_per_sec: budget.map(|budget| positive("budget", budget)).transpose()?,
        exposure_stops: stops(exposure)?,
        // A function's colours are shown as it returns them.
        tone_map: ToneMap::None,
        picture: Shown::Fixed(size.0),
        ..Settings::default()
    };
    let clock = Clock::real_for_calls(1e-3 * positive("batch_ms", batch_ms)?);
    let port = whole("port", port, 0..=u16::MAX)?;
    let address = SocketAddr::new(IpAddr::V4(Ipv4Addr::LOCALHOST), port);
    let options = Options { address, allow_frame, ..Options::default() };
    options.check().map_err(|wrong| PyValueError::new_err(in_python(&wrong)))?;
    let server = Server::bind(options).map_err(|wrong| PyOSError::new_err(in_python(&wrong)))?;
    let render = Own::new(render.clone().unbind());
    let stage = PythonStage::new(render.clone(), camera, noisy, raised.clone(), calls.clone());
    let session = py.detach(|| Session::new(size.0, clock, settings, 1, stage));
    let (session, sampler) = match given {
        Given::Builtin(_, None) => (session, None),
        Given::Builtin(kind, Some(seed)) => {
            (session.with_own_sampler(Box::new(move || kind.build(seed))), None)
        }
        Given::Python(sampler, own) => {
            let make = move || -> Box<dyn Sampler> { Box::new(sampler.another()) };
            (session.with_own_sampler(Box::new(make)), Some(own))
        }
    };
    let helm = Helm::without_scene(camera.view(), camera.target_point());
    let show = Show { session, helm, scenes: None };
    let (url, stopper) = (server.url(), server.stopper());
    let thread = std::thread::Builder::new()
        .name("frameless page".to_owned())
        .spawn(move || server.run(show))?;
    Ok(Served {
        url,
        size: (size.0.width, size.0.height),
        render,
        sampler,
        raised,
        calls,
        stopper,
        given_up: AtomicBool::new(false),
        process: std::process::id(),
        thread: Mutex::new(Some(thread)),
    })
}
