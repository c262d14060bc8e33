//! From where a scene is looked at, as Python sees it.

use frameless::Size;
use frameless_scene::{Projection, View, look_at};
use glam::{Affine3A, Mat4, Vec3};
use numpy::PyArray2;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::array;
use crate::size::{PictureSize, pair};

/// Eye and target may be any three finite numbers in a sequence.
type Triple = [f32; 3];

/// Origins and directions.
type Rays<'py> = (Bound<'py, PyArray2<f32>>, Bound<'py, PyArray2<f32>>);

/// All that a camera is: columns of its matrix, half angle or half height, distance, upwards and size.
type Restored = ([f32; 12], Option<f32>, Option<f32>, (f32, Triple, Option<(u32, u32)>));

/// A pinhole camera that looks at `target` from `eye`; immutable.
///
/// Parameters:
///
/// - `eye`, `target`: three numbers each, in the scene's unit of length (world coordinates)
/// - `up`: direction that is upwards in the picture as far as it can be; default (0, 1, 0)
/// - `fov`: angle between the top and the bottom of the picture in degrees, above 0 and below 180; default 45
///
/// A camera that a renderer is given also knows the size of the picture, so that `rays` needs none.
///
/// Raises ValueError if a number is not finite, or eye and target are the same point.
#[pyclass(frozen, module = "frameless", from_py_object)]
#[derive(Clone, Copy, PartialEq)]
pub(crate) struct Camera {
    view: View,
    /// Remembered, since the view alone does not tell.
    distance: f32,
    up: Vec3,
    size: Option<Size>,
}

impl Camera {
    /// A view that something else has chosen; the target is so far ahead.
    pub(crate) fn from_view(view: View, distance: f32) -> Camera {
        Camera { view, distance, up: view.world_from_camera.matrix3.y_axis.into(), size: None }
    }

    pub(crate) fn of_size(self, size: Size) -> Camera {
        Camera { size: Some(size), ..self }
    }

    pub(crate) fn view(&self) -> &View {
        &self.view
    }

    /// Prepared for a picture.
    pub(crate) fn optics(&self, size: Size) -> frameless_trace::Camera {
        frameless_trace::Camera::new(&self.view, size)
    }

    /// From the eye to the target.
    pub(crate) fn distance(&self) -> f32 {
        self.distance
    }

    /// What it looks at.
    pub(crate) fn target_point(&self) -> Vec3 {
        Vec3::from(self.view.world_from_camera.translation) + self.distance * self.ahead()
    }

    fn ahead(&self) -> Vec3 {
        (-self.view.world_from_camera.matrix3.z_axis).into()
    }
}

#[pymethods]
impl Camera {
    #[new]
    #[pyo3(signature = (eye, target, up=None, fov=45.0))]
    fn new(
        eye: &Bound<'_, PyAny>,
        target: &Bound<'_, PyAny>,
        up: Option<Bound<'_, PyAny>>,
        fov: f32,
    ) -> PyResult<Camera> {
        let (eye, target) = (array::triple("eye", eye)?, array::triple("target", target)?);
        let up = up.map(|up| array::triple("up", &up)).transpose()?.unwrap_or([0.0, 1.0, 0.0]);
        if !(fov > 0.0 && fov < 180.0) {
            let message = format!("fov: wanted degrees above 0 and below 180, got {fov}");
            return Err(PyValueError::new_err(message));
        }
        let (eye, target, up) = (Vec3::from(eye), Vec3::from(target), Vec3::from(up));
        let distance = eye.distance(target);
        if !(distance > 0.0 && distance.is_finite()) {
            let message =
                format!("eye and target: wanted two different points, got {eye} and {target}");
            return Err(PyValueError::new_err(message));
        }
        let projection = Projection::Perspective { yfov_rad: fov.to_radians() };
        let view = View { world_from_camera: look_at(eye, target, up), projection };
        Ok(Camera { view, distance, up, size: None })
    }

    /// Where it stands: (x, y, z) in world coordinates.
    #[getter]
    fn eye(&self) -> (f32, f32, f32) {
        Vec3::from(self.view.world_from_camera.translation).into()
    }

    /// What it looks at: (x, y, z) in world coordinates.
    #[getter]
    fn target(&self) -> (f32, f32, f32) {
        self.target_point().into()
    }

    /// What is upwards, as given.
    #[getter]
    fn up(&self) -> (f32, f32, f32) {
        self.up.into()
    }

    /// Vertical angle of view in degrees; of a parallel projection 0.
    #[getter]
    fn fov(&self) -> f32 {
        match self.view.projection {
            Projection::Perspective { yfov_rad } => yfov_rad.to_degrees(),
            Projection::Orthographic { .. } => 0.0,
        }
    }

    /// The same camera for a picture of so many pixels, (width, height).
    fn with_size(&self, size: PictureSize) -> Camera {
        self.of_size(size.0)
    }

    /// (width, height) of the picture in pixels, or None if the camera belongs to none.
    #[getter]
    pub(crate) fn size(&self) -> Option<(u32, u32)> {
        self.size.map(pair)
    }

    /// World from camera: a float32 matrix of shape (4, 4); columns are right, up, backward and eye.
    fn matrix<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f32>>> {
        use numpy::prelude::*;
        let columns = Mat4::from(self.view.world_from_camera).transpose().to_cols_array();
        array::column(py, columns.to_vec()).reshape([4, 4])
    }

    /// Rays through places in the picture.
    ///
    /// Parameters:
    ///
    /// - `x`, `y`: float arrays of shape (n,), pixels from the picture's top-left corner: the centre of the first pixel is (0.5, 0.5)
    /// - `size`: (width, height) of the picture; may be left out if the camera knows it
    ///
    /// Returns:
    ///
    /// - (`origin`, `direction`): two float32 arrays of shape (n, 3) in world coordinates; directions have length 1
    ///
    /// Raises ValueError if the arrays are wrong or the size is not known.
    #[pyo3(signature = (x, y, size=None))]
    fn rays<'py>(
        &self,
        x: &Bound<'py, PyAny>,
        y: &Bound<'py, PyAny>,
        size: Option<PictureSize>,
    ) -> PyResult<Rays<'py>> {
        let py = x.py();
        let size = size.map(|size| size.0).or(self.size).ok_or_else(|| {
            PyValueError::new_err(
                "size: wanted (width, height), since this camera belongs to no picture",
            )
        })?;
        let places = array::places(x, y)?;
        let optics = self.optics(size);
        let (origins, directions) = py.detach(|| {
            let rays = places.iter().map(|&place| optics.ray_at(place));
            let rays = rays.map(|ray| (ray.origin.to_array(), ray.direction.to_array()));
            rays.unzip::<_, _, Vec<_>, Vec<_>>()
        });
        Ok((array::rows(py, origins)?, array::rows(py, directions)?))
    }

    /// What pickle and copy need to make the same again.
    fn __reduce__<'py>(slf: &Bound<'py, Camera>) -> PyResult<(Bound<'py, PyAny>, (Restored,))> {
        let camera = slf.get();
        let (fov_rad, height) = match camera.view.projection {
            Projection::Perspective { yfov_rad } => (Some(yfov_rad), None),
            Projection::Orthographic { ymag } => (None, Some(ymag)),
        };
        let matrix = camera.view.world_from_camera.to_cols_array();
        let rest = (camera.distance, camera.up.to_array(), camera.size());
        Ok((slf.get_type().getattr("_restored")?, ((matrix, fov_rad, height, rest),)))
    }

    #[staticmethod]
    fn _restored(state: Restored) -> PyResult<Camera> {
        let (matrix, fov_rad, height, (distance, up, size)) = state;
        let projection = match (fov_rad, height) {
            (Some(yfov_rad), None) => Projection::Perspective { yfov_rad },
            (None, Some(ymag)) => Projection::Orthographic { ymag },
            _ => return Err(PyValueError::new_err("this is no camera's state")),
        };
        let view = View { world_from_camera: Affine3A::from_cols_array(&matrix), projection };
        let size = size.map(|(width, height)| Size::new(width, height));
        Ok(Camera { view, distance, up: up.into(), size })
    }

    fn __repr__(&self) -> String {
        let (eye, target, up, fov) = (self.eye(), self.target(), self.up(), self.fov());
        let up = if up == (0.0, 1.0, 0.0) { String::new() } else { format!(", up={up:?}") };
        let size = self.size().map_or(String::new(), |size| format!(".with_size({size:?})"));
        format!("Camera(eye={eye:?}, target={target:?}{up}, fov={fov}){size}")
    }

    fn __eq__(&self, other: &Camera) -> bool {
        self == other
    }
}

/// World from object for an object that stands where it was made.
pub(crate) const IN_PLACE: Affine3A = Affine3A::IDENTITY;
