//! A picture of all that is far away: what lights the scene, and what is seen behind it.
//!
//! Latitude and longitude, as Radiance files usually are: the top row looks straight up, the middle column along +x before it is
//! turned, columns run from there towards +z.

use std::io::BufReader;
use std::path::Path;
use std::sync::Arc;

use glam::Vec3;

use crate::gltf::{Limits, LoadError, Place};
use crate::radiance::{linear_from_rgbe, read_picture};
use crate::{Scene, gltf};

/// Radiance by direction.
#[derive(Clone, Debug, PartialEq)]
pub struct Environment {
    /// File name without folder.
    pub name: String,
    /// Texels per row; at least 1.
    pub width: u32,
    /// Rows; at least 1.
    pub height: u32,
    /// `width · height` texels from the top left.
    pub texels: Arc<Texels>,
    /// By how much it is turned about +y, in radians: positive turns what is along +z towards +x.
    pub rotation_rad: f32,
    /// Multiplies the texels; finite and at least 0.
    pub strength: f32,
}

/// Radiance: linear RGB, finite and at least 0.
#[derive(Clone, Debug, PartialEq)]
pub enum Texels {
    /// As it is.
    Linear(Vec<[f32; 3]>),
    /// As Radiance's files have it, a third as large: three mantissas, and an exponent of two that they share.
    Rgbe(Vec<[u8; 4]>),
}

impl Texels {
    /// How many there are.
    pub fn count(&self) -> usize {
        match self {
            Texels::Linear(texels) => texels.len(),
            Texels::Rgbe(texels) => texels.len(),
        }
    }

    /// One of them.
    ///
    /// # Panics
    /// If there are not so many.
    #[inline]
    pub fn at(&self, index: usize) -> [f32; 3] {
        match self {
            Texels::Linear(texels) => texels[index],
            Texels::Rgbe(texels) => linear_from_rgbe(texels[index]),
        }
    }
}

/// Reads a Radiance picture (`.hdr`), which is neither turned nor strengthened.
///
/// # Errors
/// If the file cannot be read, is no such picture, or is larger than `limits` allow.
pub fn load_environment(path: &Path, limits: &Limits) -> Result<Environment, LoadError> {
    let name = path.file_name().map(|name| name.to_string_lossy().into_owned());
    let (file, bytes) = gltf::open_plain(path, limits)?;
    let picture = read_picture(BufReader::new(file), bytes, limits);
    let (width, height, texels) = picture.map_err(|(offset, problem)| LoadError {
        file: path.display().to_string(),
        place: Place::Byte(offset),
        problem,
    })?;
    Ok(Environment {
        name: name.unwrap_or_default(),
        width,
        height,
        texels: Arc::new(Texels::Rgbe(texels)),
        rotation_rad: 0.0,
        strength: 1.0,
    })
}

impl Scene {
    /// Lets `environment` light the scene: beside its own lights, but instead of those that stood in for them.
    pub fn light_by(&mut self, environment: Environment) {
        if self.has_added_light {
            self.lights.clear();
            self.ambient = Vec3::ZERO;
            self.has_added_light = false;
            self.notes.retain(|note| !note.starts_with(gltf::NO_LIGHT));
        }
        self.notes.push(format!("lit by the environment {}", environment.name));
        self.environment = Some(environment);
    }
}

impl Environment {
    /// Whether its texels and factors are as promised.
    pub(crate) fn is_sane(&self) -> bool {
        let texels = self.width as usize * self.height as usize;
        let sane = |c: &f32| c.is_finite() && *c >= 0.0;
        let all_sane = match &*self.texels {
            Texels::Linear(texels) => texels.as_flattened().iter().all(sane),
            // Whatever the bytes are.
            Texels::Rgbe(_) => true,
        };
        texels > 0
            && self.texels.count() == texels
            && all_sane
            && self.rotation_rad.is_finite()
            && sane(&self.strength)
    }
}
