//! One sample, by whichever integrator is chosen.

use frameless::{Request, Size, Surface};
use frameless_scene::View;

use crate::camera::Camera;
use crate::direct::Probe;
use crate::holes::Chance;
use crate::kernel::Isa;
#[cfg(target_arch = "x86_64")]
use crate::kernel::avx2;
use crate::lens::{self, Lens};
use crate::many::{SHADED, WAVE};
use crate::moment::Moment;
use crate::numbers::Numbers;
use crate::order::Order;
use crate::ray::Ray;
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

    /// Many samples, in the order of the requests: what [`World::trace`] says of each. No surfaces if nobody asks for them.
    pub fn trace_all(
        &self,
        moment: &Moment,
        view: &View,
        size: Size,
        requests: &[Request],
        settings: &Settings,
    ) -> (Vec<[f32; 3]>, Vec<Surface>) {
        let mut order = Order::default();
        order.by_tile(requests, size);
        let mut rgb = vec![[0.0; 3]; requests.len()];
        let count = if settings.surfaces { requests.len() } else { 0 };
        let mut surfaces = vec![Surface::default(); count];
        let mut places = order.requests().iter().map(|&index| index as usize);
        let put = |colour, surface| {
            let place = places.next().expect("as many answers as requests");
            rgb[place] = colour;
            if let Some(to) = surfaces.get_mut(place) {
                *to = surface;
            }
        };
        let sorted = order.requests().iter().map(|&index| requests[index as usize]);
        let seen = (moment, &Camera::new(view, size));
        self.samples(seen, sorted, settings, &mut Stack::new(), put);
        (rgb, surfaces)
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
    pub(crate) fn sample_with(
        &self,
        moment: &Moment,
        camera: &Camera,
        request: &Request,
        settings: &Settings,
        stack: &mut Stack,
        probe: &mut impl Probe,
    ) -> ([f32; 3], Surface) {
        let ray = first_ray(camera, request, settings);
        let met = self.nearest(moment, &ray, || first_chance(request, settings), stack);
        let seen = (ray, met, camera.cone());
        match settings.integrator {
            Integrator::Direct => self.radiance(moment, seen, settings, stack, probe),
            Integrator::Path => {
                let (rgb, surface) =
                    self.path_radiance(moment, seen, request, settings, stack, probe);
                (rgb, in_own_pixel(surface, moment, camera, request, settings))
            }
        }
    }
}

/// Of the pixel, through the lens if there is one.
#[inline(always)]
fn first_ray(camera: &Camera, request: &Request, settings: &Settings) -> Ray {
    let ray = camera.ray(request);
    match (settings.integrator, settings.lens) {
        (Integrator::Path, Some(lens)) => lens.ray(camera, &ray, Numbers::of(request).lens()),
        _ => ray,
    }
}

/// How what it meets first and blends decides whether it is there.
#[inline(always)]
fn first_chance(request: &Request, settings: &Settings) -> Chance {
    match settings.integrator {
        Integrator::Direct => Chance::Never,
        Integrator::Path => Numbers::of(request).chance(0),
    }
}

/// However a lens has blurred it.
#[inline(always)]
fn in_own_pixel(
    surface: Surface,
    moment: &Moment,
    camera: &Camera,
    request: &Request,
    settings: &Settings,
) -> Surface {
    match settings.lens {
        None => surface,
        Some(_) => lens::in_own_pixel(surface, moment, camera, &camera.ray(request)),
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
    /// In waves, of whose first rays and of those from what they hit to lights many are under way at once.
    #[inline(always)]
    fn trace(self) {
        let Samples { world, moment, camera, mut requests, settings, stack, mut take } = self;
        let cone = camera.cone();
        loop {
            let (mut asked, mut rays) = ([Request::default(); WAVE], [Ray::NONE; WAVE]);
            let mut count = 0;
            for ((to, ray), request) in asked.iter_mut().zip(&mut rays).zip(&mut requests) {
                (*to, *ray) = (request, first_ray(camera, &request, settings));
                count += 1;
            }
            let (asked, rays) = (&asked[..count], &rays[..count]);
            if rays.is_empty() {
                return;
            }
            let mut met = [None; WAVE];
            let met = &mut met[..count];
            let chance = |index: usize| first_chance(&asked[index], settings);
            world.nearest_of(moment, rays, chance, met, stack);
            match settings.integrator {
                Integrator::Direct => {
                    for (rays, met) in rays.chunks(SHADED).zip(met.chunks(SHADED)) {
                        world.radiances(moment, (rays, met, cone), settings, stack, &mut take);
                    }
                }
                Integrator::Path => {
                    let put = |request: &Request, rgb, surface| {
                        take(rgb, in_own_pixel(surface, moment, camera, request, settings));
                    };
                    world.path_radiances(moment, (rays, met, cone), asked, settings, stack, put);
                }
            }
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
