//! One sample, by whichever integrator is chosen.

use frameless::{Request, Size, Surface};
use frameless_scene::View;

use crate::camera::Camera;
use crate::direct::{NoProbe, Probe};
use crate::kernel::Isa;
#[cfg(target_arch = "x86_64")]
use crate::kernel::avx2;
use crate::lens::{self, Lens};
use crate::moment::Moment;
use crate::numbers::Numbers;
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
        let (camera, mut answer) = (Camera::new(view, size), ([0.0; 3], Surface::default()));
        let (seen, requests) = ((moment, &camera), std::iter::once(*request));
        let take = |rgb, surface| answer = (rgb, surface);
        self.samples(seen, requests, settings, &mut Stack::new(), take);
        answer
    }

    /// Hands the answers to `take`, in the order of the requests. The whole of it has the instructions of the walk: they are also what
    /// textures and random numbers are glad of.
    #[inline]
    pub(crate) fn samples(
        &self,
        (moment, camera): (&Moment, &Camera),
        requests: impl Iterator<Item = Request>,
        settings: &Settings,
        stack: &mut Stack,
        take: impl FnMut([f32; 3], Surface),
    ) {
        let samples = Samples { world: self, moment, camera, requests, settings, stack, take };
        match self.isa {
            Isa::Portable => samples.trace(),
            #[cfg(target_arch = "x86_64")]
            Isa::Avx2(proof) => avx2::with(proof, samples),
        }
    }

    /// One sample, with `probe` told of all that happens.
    #[inline(always)]
    pub(crate) fn sample_with(
        &self,
        moment: &Moment,
        camera: &Camera,
        request: &Request,
        settings: &Settings,
        stack: &mut Stack,
        probe: &mut impl Probe,
    ) -> ([f32; 3], Surface) {
        let (ray, cone) = (camera.ray(request), camera.cone());
        match (settings.integrator, settings.lens) {
            (Integrator::Direct, _) => self.radiance(moment, (ray, cone), settings, stack, probe),
            (Integrator::Path, lens) => {
                let through = match lens {
                    None => ray,
                    Some(lens) => lens.ray(camera, &ray, Numbers::of(request).lens()),
                };
                let (rgb, surface) =
                    self.path_radiance(moment, (through, cone), request, settings, stack, probe);
                match lens {
                    None => (rgb, surface),
                    Some(_) => (rgb, lens::in_own_pixel(surface, moment, camera, &ray)),
                }
            }
        }
    }
}

struct Samples<'a, R, T> {
    world: &'a World,
    moment: &'a Moment,
    camera: &'a Camera,
    requests: R,
    settings: &'a Settings,
    stack: &'a mut Stack,
    take: T,
}

impl<R: Iterator<Item = Request>, T: FnMut([f32; 3], Surface)> Samples<'_, R, T> {
    #[inline(always)]
    fn trace(self) {
        let Samples { world, moment, camera, requests, settings, stack, mut take } = self;
        for request in requests {
            let (rgb, surface) =
                world.sample_with(moment, camera, &request, settings, stack, &mut NoProbe);
            take(rgb, surface);
        }
    }
}

#[cfg(target_arch = "x86_64")]
impl<R: Iterator<Item = Request>, T: FnMut([f32; 3], Surface)> avx2::Task for Samples<'_, R, T> {
    type Output = ();
    #[inline(always)]
    fn run(self) {
        self.trace();
    }
}
