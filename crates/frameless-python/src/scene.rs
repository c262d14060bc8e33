//! The built-in scenes and tracer, and glTF files, as a renderer like any other.

use std::path::PathBuf;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use frameless::{Batch, Pose, Request, Size, Surface, Time, Tracer};
use frameless_scene::{BUILTIN_NAMES, Limits, LoadError, State, builtin, load, load_environment};
use frameless_trace::{
    CpuTracer, Integrator, Ray, Settings, Still, ViewSource, World, render_still, thread_pool,
};
use glam::{Mat4, Vec3A};
use numpy::PyArray3;
use numpy::prelude::*;
use pyo3::exceptions::{PyOSError, PyTypeError, PyValueError};
use pyo3::prelude::*;

use crate::arguments::{any_size, whole};
use crate::array;
use crate::camera::Camera;
use crate::interrupt::interruptible;
use crate::size::PictureSize;

/// A scene that changes with time, and the renderer for it, on all cores: direct light, hard shadows, mirrors; whole pictures by random
/// paths, too.
///
/// Made by `Scene.builtin(name)` or `Scene.load(path)`. Any thread may use it.
#[pyclass(frozen, module = "frameless")]
pub(crate) struct Scene {
    world: Arc<World>,
    /// Made when first used.
    tracer: Arc<OnceLock<Mutex<CpuTracer>>>,
}

impl Scene {
    fn of(world: World) -> Scene {
        Scene { world: Arc::new(world), tracer: Arc::default() }
    }

    fn scene(&self) -> &Arc<frameless_scene::Scene> {
        self.world.scene()
    }

    fn checked_secs(time: f64) -> PyResult<f64> {
        match time.is_finite() {
            true => Ok(time),
            false => Err(PyValueError::new_err(format!("time: wanted finite seconds, got {time}"))),
        }
    }

    fn checked_camera(&self, camera: i128) -> PyResult<u32> {
        whole("camera", camera, 0..=self.scene().cameras.len() as u32 - 1)
    }

    /// A Camera, the number of one of the scene's, or None for the first.
    fn view(&self, camera: Option<Bound<'_, PyAny>>) -> PyResult<ViewSource> {
        let Some(camera) = camera else { return Ok(ViewSource::Camera(0)) };
        if let Ok(camera) = camera.extract::<Camera>() {
            return Ok(ViewSource::Free(*camera.view()));
        }
        match any_size(&camera) {
            Ok(number) => Ok(ViewSource::Camera(self.checked_camera(number)?)),
            Err(_) => {
                let came = camera.repr()?;
                let message = format!("camera: wanted a Camera or a number, got {came}");
                Err(PyTypeError::new_err(message))
            }
        }
    }

    /// What traces places at one time, with or without the interpreter.
    fn asked(&self, places: Vec<[f32; 2]>, secs: f64, camera: Camera, size: Size) -> Asked {
        let (world, tracer) = (Arc::clone(&self.world), Arc::clone(&self.tracer));
        Asked { world, tracer, places, secs, camera, size }
    }
}

/// Places in a picture that are to be traced at one time.
struct Asked {
    world: Arc<World>,
    tracer: Arc<OnceLock<Mutex<CpuTracer>>>,
    places: Vec<[f32; 2]>,
    secs: f64,
    camera: Camera,
    size: Size,
}

/// Colours, positions, normals and object numbers, one per place.
type Traced = (Vec<[f32; 3]>, Vec<[f32; 3]>, Vec<[f32; 3]>, Vec<i64>);

impl Asked {
    /// In the order of the places. `None` if the tracer has no answer, which it always has.
    fn trace(self) -> Option<Traced> {
        let Asked { world, tracer, places, secs, camera, size } = self;
        let view = *camera.view();
        let new = || CpuTracer::new(world.clone(), ViewSource::Free(view), Settings::default(), 0);
        let tracer = tracer.get_or_init(|| Mutex::new(new()));
        let mut pose = Pose::default();
        let answer = {
            let mut tracer = tracer.lock().unwrap_or_else(PoisonError::into_inner);
            tracer.set_view(ViewSource::Free(view));
            let requests = places.into_iter().map(|place| request(place, size)).collect();
            tracer.submit(Batch { id: 0, now: Time::ZERO, scene_secs: secs, size, requests });
            let answer = tracer.collect(true)?;
            tracer.pose(secs, size, &mut pose);
            answer
        };
        let state = world.scene().state_at(secs);
        let (optics, forward) = (camera.optics(size), -view.world_from_camera.matrix3.z_axis);
        let hits = answer.requests.iter().zip(&answer.surfaces).map(|(request, surface)| {
            in_world(surface, &pose, &optics.ray(request), forward, &state, world.scene())
        });
        let (position, normal) = hits.unzip();
        let object = answer.surfaces.iter().map(|surface| match surface.object {
            Surface::SKY => -1,
            object => i64::from(object),
        });
        Some((answer.rgb, position, normal, object.collect()))
    }
}

/// Places that take longer than one would wait for Ctrl-C.
const MANY_PLACES: usize = 1 << 16;

/// The request whose ray goes through a place; beside the picture the border pixel's, with a larger offset.
fn request([x, y]: [f32; 2], size: Size) -> Request {
    let column = (x.max(0.0) as u32).min(size.width - 1);
    let row = (y.max(0.0) as u32).min(size.height - 1);
    let offset = [x - column as f32 - 0.5, y - row as f32 - 0.5];
    Request { pixel: size.index(column, row), offset, sample_index: 0 }
}

fn integrator_named(name: &str) -> PyResult<Integrator> {
    Integrator::from_name(name).ok_or_else(|| {
        let known = Integrator::ALL.map(Integrator::name).join("\" or \"");
        PyValueError::new_err(format!("integrator: wanted \"{known}\", got {name:?}"))
    })
}

/// A hit in the world's coordinates: position and normal; of the sky, the direction. What is seen in a plane mirror is where its
/// image is, behind the mirror.
fn in_world(
    surface: &Surface,
    pose: &Pose,
    ray: &Ray,
    forward: Vec3A,
    state: &State,
    scene: &frameless_scene::Scene,
) -> ([f32; 3], [f32; 3]) {
    let depth = pose.project(surface).map_or(f32::INFINITY, |there| there.depth);
    if !depth.is_finite() {
        return (ray.direction.to_array(), [0.0; 3]);
    }
    let position = ray.origin + ray.direction * (depth / ray.direction.dot(forward));
    let normal = scene.instances.get(surface.object as usize).map_or(Vec3A::ZERO, |instance| {
        let linear = state.world_from_node[instance.node as usize].matrix3;
        (linear.inverse().transpose() * Vec3A::from(surface.normal)).normalize_or_zero()
    });
    (position.to_array(), normal.to_array())
}

#[pymethods]
impl Scene {
    /// A scene that comes with the package; Scene.names() lists them.
    #[staticmethod]
    fn builtin(name: &str) -> PyResult<Scene> {
        let world = builtin(name).map(|scene| World::new(Arc::new(scene)));
        world.map(Scene::of).ok_or_else(|| {
            let known = BUILTIN_NAMES.join(", ");
            PyValueError::new_err(format!("name: wanted one of {known}; got {name:?}"))
        })
    }

    /// A glTF 2.0 file (.gltf or .glb), lit by a Radiance picture (.hdr) of all that is far away, if one is given: latitude and longitude,
    /// +x in its middle column. Raises OSError if a file cannot be read, ValueError if it is not what it should be.
    #[staticmethod]
    #[pyo3(signature = (path, environment=None))]
    fn load(py: Python<'_>, path: PathBuf, environment: Option<PathBuf>) -> PyResult<Scene> {
        for path in std::iter::once(&path).chain(&environment) {
            if let Err(error) = std::fs::metadata(path) {
                return Err(PyOSError::new_err(format!("{}: {error}", path.display())));
            }
        }
        let shown = path.display().to_string();
        let loaded = interruptible(py, move |_| {
            let limits = Limits::default();
            let mut scene = load(&path, &limits)?;
            if let Some(path) = environment {
                scene.light_by(load_environment(&path, &limits)?);
            }
            let world = World::open(&shown, Arc::new(scene), &limits)?;
            Ok::<Scene, LoadError>(Scene::of(world))
        })?;
        loaded.map_err(|error| PyValueError::new_err(error.to_string()))
    }

    /// The scenes that come with the package.
    #[staticmethod]
    fn names() -> Vec<&'static str> {
        BUILTIN_NAMES.to_vec()
    }

    /// File name, or the name of the built-in scene.
    #[getter]
    fn name(&self) -> &str {
        &self.scene().name
    }

    /// Seconds until the animation repeats or ends; 0 if nothing moves.
    #[getter]
    fn duration(&self) -> f64 {
        self.scene().animation.duration_secs
    }

    /// How many cameras there are; at least 1.
    #[getter]
    fn cameras(&self) -> usize {
        self.scene().cameras.len()
    }

    /// How many objects there are; their numbers are those in Samples.object_id.
    #[getter]
    fn objects(&self) -> usize {
        self.scene().instances.len()
    }

    /// What was ignored or replaced while loading.
    #[getter]
    fn warnings(&self) -> Vec<String> {
        self.scene().warnings.clone()
    }

    /// One of the scene's cameras as it is at a time (seconds).
    #[pyo3(signature = (index=0, time=0.0))]
    fn camera(&self, #[pyo3(from_py_with = any_size)] index: i128, time: f64) -> PyResult<Camera> {
        let (index, secs) = (self.checked_camera(index)?, Scene::checked_secs(time)?);
        let view = self.scene().view_at(&self.scene().state_at(secs), index);
        Ok(Camera::from_view(view, 1.0))
    }

    /// Where every object is at a time (seconds): world from object, float32, shape (objects, 4, 4). For Session.place.
    fn transforms<'py>(&self, py: Python<'py>, time: f64) -> PyResult<Bound<'py, PyArray3<f32>>> {
        let state = self.scene().state_at(Scene::checked_secs(time)?);
        let rows = self.scene().instances.iter().flat_map(|instance| {
            Mat4::from(state.world_from_node[instance.node as usize]).transpose().to_cols_array()
        });
        array::column(py, rows.collect()).reshape([self.scene().instances.len(), 4, 4])
    }

    /// The whole picture at one moment: linear RGB radiance, float32, shape (height, width, 3).
    ///
    /// Parameters:
    ///
    /// - `size`: (width, height) in pixels
    /// - `time`: seconds of the scene
    /// - `camera`: a Camera, or the number of one of the scene's; default 0
    /// - `integrator`: "direct" (lights and mirrors, without noise) or "path" (light that has bounced any number of times, noisy)
    /// - `samples`: per pixel; 1: at its centre, more: spread over it, always the same ones
    /// - `first_sample`: which of the sequence of samples comes first, so that pictures can be added up
    /// - `max_depth`: after how many surfaces besides the first a way of light ends, up to 1000
    #[pyo3(signature = (size, time=0.0, camera=None, integrator="direct", samples=1, max_depth=4, first_sample=0))]
    #[allow(clippy::too_many_arguments, reason = "they are keywords in Python")]
    fn render<'py>(
        &self,
        py: Python<'py>,
        size: PictureSize,
        time: f64,
        camera: Option<Bound<'py, PyAny>>,
        integrator: &str,
        #[pyo3(from_py_with = any_size)] samples: i128,
        #[pyo3(from_py_with = any_size)] max_depth: i128,
        #[pyo3(from_py_with = any_size)] first_sample: i128,
    ) -> PyResult<Bound<'py, PyArray3<f32>>> {
        let integrator = integrator_named(integrator)?;
        let max_depth = whole("max_depth", max_depth, 0..=1000)?;
        let settings = Settings { integrator, max_depth, lens: None, surfaces: false };
        let samples = whole("samples", samples, 1..=1 << 20)?;
        let first_sample = whole("first_sample", first_sample, 0..=u32::MAX)?;
        let (secs, view) = (Scene::checked_secs(time)?, self.view(camera)?);
        let (world, size) = (self.world.clone(), size.0);
        let still = Still { secs, view, size, settings, samples, first_sample };
        let picture =
            interruptible(py, move |_| render_still(&world, &still, &thread_pool(0), || ()))?;
        array::colours(py, size, picture)
    }

    /// Traces places in the picture: a scene is a function `render(x, y, time, camera)` like any other.
    ///
    /// Parameters:
    ///
    /// - `x`, `y`: float arrays of shape (n,), pixels from the picture's top-left corner
    /// - `time`: seconds of the scene
    /// - `camera`: one that knows the size of its picture, as batches' do; see Camera.with_size
    ///
    /// Returns Samples: linear RGB, with positions and normals in world coordinates and object numbers (-1: the sky).
    fn __call__<'py>(
        &self,
        x: &Bound<'py, PyAny>,
        y: &Bound<'py, PyAny>,
        time: f64,
        camera: Option<Camera>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let (py, secs) = (x.py(), Scene::checked_secs(time)?);
        let places = array::places(x, y)?;
        let sized = camera.and_then(|camera| Some((camera, camera.size()?)));
        let Some((camera, (width, height))) = sized else {
            let message = "camera: wanted one that knows its picture's size, as the batches have of a session with a camera: \
                           Session(size, camera=scene.camera()), or camera.with_size(size)";
            return Err(PyValueError::new_err(message));
        };
        let is_long = places.len() >= MANY_PLACES;
        let asked = self.asked(places, secs, camera, Size::new(width, height));
        let traced = match is_long {
            true => interruptible(py, move |_| asked.trace())?,
            false => py.detach(|| asked.trace()),
        };
        let (rgb, position, normal, object) =
            traced.ok_or_else(|| PyValueError::new_err("the tracer gave no answer"))?;
        let samples = py.import("frameless.samples")?.getattr("Samples")?;
        samples.call1((
            array::rows(py, rgb)?,
            array::rows(py, position)?,
            array::rows(py, normal)?,
            array::column(py, object),
        ))
    }

    fn __repr__(&self) -> String {
        format!("<frameless.Scene {}: {} objects>", self.scene().name, self.objects())
    }
}
