//! What a renderer in Python answers, checked: colours, and what was hit if it can tell.

use frameless::{Request, Size, Surface};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::array::{self, Where};
use crate::camera::Camera;
use crate::outside::{Placed, surface};

/// Every object up to the largest number is placed at every refresh: 0.1 s for so many.
const MOST_OBJECTS: i64 = 1 << 20;

/// Arrays as they came.
pub(crate) struct Arrays<'a, 'py> {
    pub(crate) rgb: &'a Bound<'py, PyAny>,
    pub(crate) position: Option<Bound<'py, PyAny>>,
    pub(crate) normal: Option<Bound<'py, PyAny>>,
    pub(crate) object_id: Option<Bound<'py, PyAny>>,
}

/// What was hit, in the world's coordinates; one entry per sample.
pub(crate) struct Hits {
    object: Vec<u32>,
    position: Vec<[f32; 3]>,
    normal: Option<Vec<[f32; 3]>>,
}

impl Arrays<'_, '_> {
    /// Linear RGB of `n` samples, and what they hit.
    pub(crate) fn checked(
        &self,
        n: usize,
        at: Where<'_>,
    ) -> PyResult<(Vec<[f32; 3]>, Option<Hits>)> {
        let rgb = array::triples("rgb", self.rgb, n, at)?;
        let Some(position) = &self.position else {
            let alone =
                [("normal", self.normal.is_some()), ("object_id", self.object_id.is_some())];
            if let Some((name, _)) = alone.into_iter().find(|(_, came)| *came) {
                let message = format!("{name}: wanted position with it, got none");
                return Err(PyValueError::new_err(message));
            }
            return Ok((rgb, None));
        };
        let object = match &self.object_id {
            Some(ids) => objects(ids, n, at)?,
            None => vec![0; n],
        };
        let is_sky = |i: usize| object[i] == Surface::SKY;
        let position = array::triples_except("position", position, n, at, &is_sky)?;
        let normal = self.normal.as_ref();
        let normal = normal.map(|normal| array::triples_except("normal", normal, n, at, &is_sky));
        Ok((rgb, Some(Hits { object, position, normal: normal.transpose()? })))
    }
}

fn objects(ids: &Bound<'_, PyAny>, n: usize, at: Where<'_>) -> PyResult<Vec<u32>> {
    let object = |(i, id): (usize, i64)| match id {
        -1 => Ok(Surface::SKY),
        0..MOST_OBJECTS => Ok(id as u32),
        _ => Err(PyValueError::new_err(format!(
            "object_id: wanted -1 (nothing hit) or a number from 0 to {}, got {id} at {}",
            MOST_OBJECTS - 1,
            at(i)
        ))),
    };
    array::integers("object_id", ids, Some(n))?.into_iter().enumerate().map(object).collect()
}

impl Hits {
    /// As surfaces that move with their objects. Where nothing was hit, the ray's direction says what part of the sky it is.
    pub(crate) fn surfaces(
        &self,
        requests: &[Request],
        size: Size,
        camera: &Camera,
        transforms: &[Placed],
    ) -> Vec<Surface> {
        let optics = camera.optics(size);
        let of_sample = |(i, request): (usize, &Request)| match self.object[i] {
            Surface::SKY => {
                let position = optics.ray(request).direction.to_array();
                Surface { object: Surface::SKY, position, ..Surface::default() }
            }
            object => {
                let normal = self.normal.as_ref().map_or([0.0; 3], |normal| normal[i]);
                surface(object, self.position[i], normal, transforms)
            }
        };
        requests.iter().enumerate().map(of_sample).collect()
    }
}
