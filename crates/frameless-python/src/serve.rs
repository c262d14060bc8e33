//! A renderer in Python on a web page.

use std::net::{IpAddr, Ipv4Addr, SocketAddr};
use std::sync::{Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use frameless::{Clock, ReconstructionKind, SamplerKind};
use frameless_session::{Helm, PictureSize as Shown, Session, Settings};
use frameless_web::{Options, Server, Show, Stopper};
use pyo3::exceptions::{PyOSError, PyRuntimeError, PyValueError};
use pyo3::prelude::*;

use crate::camera::Camera;
use crate::interrupt::LOOK_EVERY;
use crate::sampler::named;
use crate::shared::Raised;
use crate::size::PictureSize;
use crate::stage::{PythonStage, Render};

/// A page that shows a renderer while it works; made by `frameless.serve`. In a notebook, the last line of a cell shows it inline.
///
/// What the renderer raises stops the picture; `wait`, `stop` and `check` raise it as it is, and after that, or with `set_render`, the
/// picture goes on.
#[pyclass(frozen, weakref, module = "frameless")]
pub(crate) struct Served {
    url: String,
    size: (u32, u32),
    render: Render,
    raised: Raised,
    stopper: Stopper,
    /// Until it has been waited for.
    thread: Mutex<Option<JoinHandle<anyhow::Result<()>>>>,
}

/// What is told of where to listen.
pub(crate) struct Where {
    pub(crate) port: u16,
    pub(crate) allow_frame: Option<String>,
}

/// Everything else.
pub(crate) struct What {
    pub(crate) size: PictureSize,
    pub(crate) camera: Camera,
    pub(crate) sampler: SamplerKind,
    pub(crate) reconstruction: ReconstructionKind,
    pub(crate) batch_secs: f64,
    pub(crate) budget: Option<f64>,
    pub(crate) exposure: f32,
    pub(crate) noisy: bool,
}

impl Served {
    fn start(render: &Bound<'_, PyAny>, what: &What, at: Where) -> PyResult<Served> {
        let address = SocketAddr::new(IpAddr::V4(Ipv4Addr::LOCALHOST), at.port);
        let options = Options { address, allow_frame: at.allow_frame, ..Options::default() };
        let server = Server::bind(options).map_err(|e| PyOSError::new_err(format!("{e:#}")))?;
        let (render, raised) = (Render::new(render.clone().unbind()), Raised::default());
        let stage = PythonStage::new(render.clone(), what.camera, what.noisy, raised.clone());
        let settings = Settings {
            sampler: what.sampler,
            reconstruction: what.reconstruction,
            samples_per_sec: what.budget,
            exposure_stops: what.exposure,
            picture: Shown::Fixed(what.size.0),
            ..Settings::default()
        };
        let clock = Clock::real_for_calls(what.batch_secs);
        let session = Session::new(what.size.0, clock, settings, 1, stage);
        let helm = Helm::without_scene(what.camera.view(), what.camera.target_point());
        let show = Show { session, helm, scenes: None };
        let (url, stopper) = (server.url(), server.stopper());
        let thread = std::thread::Builder::new()
            .name("frameless page".to_owned())
            .spawn(move || server.run(show))?;
        let size = (what.size.0.width, what.size.0.height);
        Ok(Served { url, size, render, raised, stopper, thread: Mutex::new(Some(thread)) })
    }

    fn thread(&self) -> std::sync::MutexGuard<'_, Option<JoinHandle<anyhow::Result<()>>>> {
        self.thread.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn is_running(&self) -> bool {
        self.thread().as_ref().is_some_and(|thread| !thread.is_finished())
    }

    /// Waits for the server's end, without the interpreter. Ctrl-C ends the waiting. In the thread that calls the renderer, and so has to end first,
    /// there is nothing to wait for.
    fn join(&self, py: Python<'_>) -> PyResult<()> {
        if std::thread::current().name() == Some(frameless_session::LOOP_THREAD) {
            return Ok(());
        }
        while self.is_running() {
            py.detach(|| std::thread::sleep(LOOK_EVERY));
            py.check_signals()?;
        }
        let Some(thread) = self.thread().take() else { return Ok(()) };
        match py.detach(|| thread.join()) {
            Ok(Ok(())) => Ok(()),
            Ok(Err(error)) => Err(PyRuntimeError::new_err(format!("{error:#}"))),
            Err(_) => Err(PyRuntimeError::new_err("the server panicked; its message is above")),
        }
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
            return Err(PyValueError::new_err(
                "render: wanted a function render(x, y, time, camera)",
            ));
        }
        self.render.set(py, render);
        self.raised.take().ok();
        Ok(())
    }

    /// Wait until the page is stopped, the renderer raises something, which is raised here and stops the page, or so many seconds
    /// have passed. Ctrl-C stops it, too.
    #[pyo3(signature = (seconds=None))]
    fn wait(&self, py: Python<'_>, seconds: Option<f64>) -> PyResult<()> {
        let seconds = seconds.filter(|seconds| seconds.is_finite()).map(|seconds| seconds.max(0.0));
        let end = seconds.map(|seconds| Instant::now() + Duration::from_secs_f64(seconds.min(1e9)));
        while self.is_running() && end.is_none_or(|end| Instant::now() < end) {
            py.detach(|| std::thread::sleep(LOOK_EVERY));
            let trouble = py.check_signals().and_then(|()| self.raised.take());
            if trouble.is_err() {
                self.stopper.stop();
                self.join(py)?;
                return trouble;
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

    fn __repr__(&self) -> String {
        let state = if self.is_running() { "at" } else { "stopped; was at" };
        format!("<frameless.Served {state} {}>", self.url)
    }
}

/// See `frameless.serve`.
#[pyfunction]
#[pyo3(signature = (
    render, size, camera, sampler, reconstruction, batch_ms, budget, exposure, noisy, port, allow_frame
))]
#[expect(clippy::too_many_arguments, reason = "Python's are named")]
pub(crate) fn start_serving(
    render: &Bound<'_, PyAny>,
    size: PictureSize,
    camera: Camera,
    sampler: &str,
    reconstruction: &str,
    batch_ms: f64,
    budget: Option<f64>,
    exposure: f32,
    noisy: bool,
    port: u16,
    allow_frame: String,
) -> PyResult<Served> {
    if !render.is_callable() {
        return Err(PyValueError::new_err("render: wanted a function render(x, y, time, camera)"));
    }
    let positive = |name: &str, value: f64| match value > 0.0 && value.is_finite() {
        true => Ok(value),
        false => {
            Err(PyValueError::new_err(format!("{name}: wanted a number above 0, got {value}")))
        }
    };
    if !exposure.is_finite() {
        return Err(PyValueError::new_err(format!(
            "exposure: wanted finite stops, got {exposure}"
        )));
    }
    let (sampler, reconstruction) = named(sampler, reconstruction)?;
    let batch_secs = 1e-3 * positive("batch_ms", batch_ms)?;
    let budget = budget.map(|budget| positive("budget", budget)).transpose()?;
    let what = What { size, camera, sampler, reconstruction, batch_secs, budget, exposure, noisy };
    Served::start(render, &what, Where { port, allow_frame: Some(allow_frame) })
}
