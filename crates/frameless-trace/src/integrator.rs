//! One sample, by whichever integrator is chosen.

use frameless::{Request, Size, Surface};
use frameless_scene::View;

use crate::camera::Camera;
use crate::direct::NoProbe;
use crate::lens::{self, Lens};
use crate::moment::Moment;
use crate::path::numbers_on_lens;
use crate::traverse::Stack;
use crate::world::World;

/// How light is followed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Integrator {
    /// Lights seen directly and in mirrors; deterministic (Whitted 1980). Rough surfaces are matte.
    #[default]
    Direct,
    /// Light that has bounced any number of times, by random paths; noisy (Kajiya 1986).
    Path,
}

impl Integrator {
    /// All of them.
    pub const ALL: [Integrator; 2] = [Integrator::Direct, Integrator::Path];

    /// As on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Integrator::Direct => "direct",
            Integrator::Path => "path",
        }
    }

    /// By its name.
    pub fn from_name(name: &str) -> Option<Integrator> {
        Integrator::ALL.into_iter().find(|integrator| integrator.name() == name)
    }

    /// Whether samples of the same ray with other random numbers differ.
    pub fn is_noisy(self) -> bool {
        self == Integrator::Path
    }
}

/// How samples are traced.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// How light is followed. Default: [`Integrator::Direct`].
    pub integrator: Integrator,
    /// After how many surfaces a path ends: of `direct`, mirrors one after the other, and the last surface is matte; of `path`, all.
    /// Default 4.
    pub max_depth: u32,
    /// Of `path`: what is not in focus is blurred. Default none: everything is sharp.
    pub lens: Option<Lens>,
    /// Whether answers carry a [`Surface`] per sample; their `lit` then also tells of lights that are off. Default true.
    pub surfaces: bool,
}

impl Default for Settings {
    fn default() -> Settings {
        Settings { integrator: Integrator::default(), max_depth: 4, lens: None, surfaces: true }
    }
}

impl World {
    /// One sample: its linear RGB radiance, finite and at least 0, and the surface that it belongs to.
    pub fn trace(
        &self,
        moment: &Moment,
        view: &View,
        size: Size,
        request: &Request,
        settings: &Settings,
    ) -> ([f32; 3], Surface) {
        self.sample(moment, &Camera::new(view, size), request, settings, &mut Stack::new())
    }

    #[inline]
    pub(crate) fn sample(
        &self,
        moment: &Moment,
        camera: &Camera,
        request: &Request,
        settings: &Settings,
        stack: &mut Stack,
    ) -> ([f32; 3], Surface) {
        let (ray, cone) = (camera.ray(request), camera.cone());
        match settings.integrator {
            Integrator::Direct => self.radiance(moment, (ray, cone), settings, stack, &mut NoProbe),
            Integrator::Path => match settings.lens {
                None => self.path_radiance(moment, (ray, cone), request, settings, stack),
                Some(lens) => {
                    let through = lens.ray(camera, &ray, numbers_on_lens(request));
                    let (rgb, surface) =
                        self.path_radiance(moment, (through, cone), request, settings, stack);
                    (rgb, lens::in_own_pixel(surface, moment, camera, &ray))
                }
            },
        }
    }
}
