//! What a picture takes, before it is begun: samples of views, one by one, whose rays count what they ask ([`Stack::boxes`]).
//!
//! What an average sample may take, [`Limits::overlap`] says. Where it would be more, what `direct` asks and follows after the first surface of a
//! sample ends sooner; then fewer lights are asked there, and the others are taken to be as hidden as those; and what takes that much for
//! a ray and another one to a light is refused.

use frameless::{Request, Size};
use frameless_scene::{Geometry, Limits, View, frame_bounds};

use crate::camera::Camera;
use crate::integrator::Settings;
use crate::moment::Moment;
use crate::numbers::{self, mixed};
use crate::traverse::Stack;
use crate::world::World;

/// What samples may take, in [boxes](Stack::boxes).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Efforts {
    /// At the first surface of `direct` one of so many lights is asked.
    pub(crate) stride: usize,
    /// Behind the first surface of `direct`.
    pub(crate) direct: u64,
    /// By the rays to lights of a path; then one light is asked for all.
    pub(crate) path: u64,
}

/// Public scenes take a thousand at most, woods of blended leaves and hair seldom three. What takes this much everywhere is a picture of seven
/// seconds on a core.
const MOST: u64 = 4_096;
/// However much the first surface takes, the others may so much: a ray or two.
const LEAST: u64 = 256;

impl Default for Efforts {
    /// Of scenes that nobody has made to be slow.
    fn default() -> Efforts {
        Efforts { stride: 1, direct: MOST, path: u64::MAX }
    }
}

/// What an average sample may take in all, for these limits: 2,000 boxes by default, which are three seconds of a core for a picture of
/// 512×384.
pub(crate) fn most_per_sample(limits: &Limits) -> u64 {
    limits.overlap.saturating_mul(2) / 3
}

/// What samples take that have been tried.
#[derive(Clone, Debug, Default)]
pub(crate) struct Forecast {
    samples: u64,
    /// Of their first rays, and of those from there to all lights.
    first: u64,
    lights: u64,
    /// Of each the rest.
    rest: Vec<u64>,
}

impl Forecast {
    /// Whether enough is known of what takes very long.
    fn is_enough(&self) -> bool {
        /// Samples that take all that one may, several times over.
        const ENOUGH: u64 = 2_000_000;
        self.first + self.lights > ENOUGH
    }

    /// Of the first ray of an average sample, and one to a light; there are so many of these.
    pub(crate) fn two_rays(&self, lights: usize) -> u64 {
        let of_one = self.lights / (lights as u64).max(1);
        (self.first + of_one) / self.samples.max(1)
    }

    /// So that first rays and those to the lights that are asked take no more than that on average, if possible. That a light is left out is
    /// seen: where all take a fifth more at most, none is.
    pub(crate) fn stride(&self, lights: usize, most: u64) -> usize {
        let all = most.saturating_add(most / 5).saturating_mul(self.samples);
        if self.first + self.lights <= all {
            return 1;
        }
        let left = most.saturating_mul(self.samples).saturating_sub(self.first);
        let asked = u128::from(left) * lights as u128 / u128::from(self.lights).max(1);
        // As many as fit.
        lights.div_ceil((asked as usize).clamp(1, lights.max(1))).max(1)
    }

    /// What each sample may take after its first surface, so that all take no more than that on average.
    pub(crate) fn direct(&self, stride: usize, most: u64) -> u64 {
        let first = self.first + self.lights / stride as u64;
        let mut left = most.saturating_mul(self.samples).saturating_sub(first);
        let mut rest = self.rest.clone();
        rest.sort_unstable();
        for (others, &rest) in (1..=rest.len() as u64).rev().zip(&rest) {
            if left / others < rest {
                return (left / others).clamp(LEAST, MOST);
            }
            left -= rest;
        }
        MOST
    }

    /// What the rays to lights of a path may take, so that it takes no more than that: at every surface that it meets by default there are
    /// a ray and one to a light.
    pub(crate) fn path(&self, lights: usize, most: u64) -> u64 {
        /// After the first.
        const SURFACES: u64 = 4;
        most.saturating_sub(SURFACES * self.two_rays(lights)).max(LEAST)
    }
}

impl World {
    /// Of all meshes, as a number that scenes have of their own.
    fn triangles(&self) -> u32 {
        let of = |geometry: &Geometry| match geometry {
            Geometry::Sphere { .. } => 1,
            Geometry::Mesh(mesh) => mesh.triangles.len() as u32,
        };
        self.scene().geometries.iter().map(of).fold(0, u32::wrapping_add)
    }

    /// Of what is seen from some of the scene's cameras, and of everything.
    pub(crate) fn forecasts(&self, moment: &Moment) -> Vec<Forecast> {
        /// A file may have thousands.
        const CAMERAS: usize = 4;
        let (scene, state) = (self.scene(), moment.state());
        let cameras = 0..scene.cameras.len().min(CAMERAS) as u32;
        let all = scene.bounds_at(state).map(|bounds| frame_bounds(bounds, 0.8, 4.0 / 3.0));
        let views = cameras.map(|camera| scene.view_at(state, camera)).chain(all);
        views.zip(0..).map(|(view, number)| self.forecast(moment, &view, number)).collect()
    }

    /// `number`: of the view.
    fn forecast(&self, moment: &Moment, view: &View, number: u32) -> Forecast {
        /// Of each cell of the picture.
        const SAMPLES: u32 = 2;
        let camera = Camera::new(view, CELLS);
        let of_scene = mixed(number ^ mixed(self.triangles()));
        let requests = (0..SAMPLES * CELLS.pixels() as u32).map(|k| tried(k, of_scene));
        let (mut forecast, mut stack) = (Forecast::default(), Stack::new());
        for request in requests {
            let seen = (camera.ray(&request), camera.cone());
            let [first, lights, rest] =
                self.effort_of(moment, seen, &Settings::default(), &mut stack);
            forecast.samples += 1;
            forecast.first += first;
            forecast.lights += lights;
            forecast.rest.push(rest);
            if forecast.is_enough() {
                break;
            }
        }
        forecast
    }
}

/// What is tried is a picture of so many pixels.
const CELLS: Size = Size { width: 16, height: 12 };

/// The place of a sample that is tried: somewhere in its cell, since small cards at places that are known would hide all from the trial.
fn tried(k: u32, of_scene: u32) -> Request {
    /// From one sample to the next, so that the first are everywhere; prime to the number of cells.
    const STEP: u32 = 77;
    let pixel = k * STEP % CELLS.pixels() as u32;
    let x = mixed(of_scene ^ mixed(k));
    let offset = [x, mixed(x)].map(|number| numbers::unit(number) - 0.5);
    Request { pixel, offset, ..Request::default() }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use frameless::Rng;
    use frameless_scene::{AlphaMode, Layers, Material, Scene, Transform};
    use glam::{Vec3, Vec4};

    use super::*;
    use crate::direct::NoProbe;
    use crate::integrator::Integrator;
    use crate::kernel::Isa;
    use crate::reference::random_soup;
    use crate::test_scenes as scenes;

    const LIGHTS: usize = 7;

    /// Needles in a box of half a mirror and half glass, and a veil, under some lights.
    fn maze() -> Arc<Scene> {
        let mut scene = scenes::empty();
        let matte = scenes::add_material(&mut scene, Vec3::splat(0.8), 0.0, 1.0);
        let layers = Layers { transmission: 0.6, clearcoat: 1.0, ..Layers::default() };
        let glass = Material {
            metallic: 0.4,
            roughness: 0.05,
            double_sided: true,
            layers: Some(Box::new(layers)),
            ..Material::default()
        };
        let veil = Material {
            base_color: Vec4::new(0.9, 0.8, 0.7, 0.4),
            alpha_mode: AlphaMode::Blend,
            double_sided: true,
            ..Material::default()
        };
        scene.materials.extend([glass, veil]);
        let mut needles = random_soup(&mut Rng::new(5), 800, 0.9);
        for corners in &needles.triangles.clone() {
            let [a, b, c] = corners.map(|vertex| needles.positions[vertex as usize]);
            needles.positions[corners[1] as usize] = a + 0.004 * (b - a);
            needles.positions[corners[2] as usize] = c;
        }
        scenes::add(&mut scene, Geometry::Mesh(needles), Transform::IDENTITY);
        for k in 0..3 {
            let pane = scenes::floor(2.0, -1.1 + 0.7 * k as f32, matte + 1);
            let turned = glam::Quat::from_rotation_x(1.2);
            scenes::add(&mut scene, pane, Transform { rotation: turned, ..Transform::IDENTITY });
        }
        scenes::add(&mut scene, scenes::floor(0.8, 0.1, matte + 2), scenes::at(0.1, 0.2, 0.0));
        let mut rng = Rng::new(9);
        for _ in 0..LIGHTS {
            scenes::add_point_light(&mut scene, 3.0 * scenes::unit(&mut rng), 5.0);
        }
        Arc::new(scene)
    }

    fn requests(samples: u32) -> Vec<Request> {
        let all = (0..samples).flat_map(|sample| (0..32 * 24).map(move |pixel| (pixel, sample)));
        all.map(|(pixel, sample_index)| Request { pixel, sample_index, ..Request::default() })
            .collect()
    }

    const SIZE: Size = Size { width: 32, height: 24 };

    fn traced(world: &World, integrator: Integrator, samples: u32) -> Vec<[f32; 3]> {
        let (moment, settings) =
            (world.moment(0.0), Settings { integrator, ..Settings::default() });
        let view = world.scene().view_at(moment.state(), 0);
        world.trace_all(&moment, &view, SIZE, &requests(samples), &settings).0
    }

    /// Whatever a sample may take, it is the same alone and among others, and by whichever instructions.
    #[test]
    fn samples_end_in_the_same_place_alone_and_together() {
        let scene = maze();
        let mut pictures: Vec<Vec<[f32; 3]>> = Vec::new();
        for efforts in [
            Efforts::default(),
            Efforts { stride: 3, direct: 400, path: 150 },
            Efforts { stride: LIGHTS, direct: LEAST, path: 0 },
        ] {
            for integrator in Integrator::ALL {
                let mut known = None;
                for isa in Isa::all() {
                    let mut world = World::with_isa(Arc::clone(&scene), isa);
                    world.efforts = efforts;
                    let together = traced(&world, integrator, 1);
                    let known = known.get_or_insert_with(|| together.clone());
                    assert_eq!(*known, together, "{isa:?}, {integrator:?}, {efforts:?}");
                    let (moment, settings) =
                        (world.moment(0.0), Settings { integrator, ..Settings::default() });
                    let camera = Camera::new(&world.scene().view_at(moment.state(), 0), SIZE);
                    for (request, together) in requests(1).iter().zip(together) {
                        let (stack, probe) = (&mut Stack::new(), &mut NoProbe);
                        let (alone, _) =
                            world.sample_with(&moment, &camera, request, &settings, stack, probe);
                        assert_eq!(alone, together, "{isa:?}, {integrator:?}, {efforts:?}");
                    }
                }
                pictures.extend(known);
            }
        }
        assert!(pictures[0] != pictures[2] && pictures[2] != pictures[4], "nothing was left out");
        assert!(pictures[1] != pictures[3] && pictures[3] != pictures[5], "nothing was left out");
    }

    #[test]
    fn a_sample_takes_what_it_may_and_what_it_has_begun() {
        let mut world = World::new(maze());
        let moment = world.moment(0.0);
        let camera = Camera::new(&world.scene().view_at(moment.state(), 0), SIZE);
        let (mut stack, settings) = (Stack::new(), Settings::default());
        let mut rest = |world: &World| -> Vec<u64> {
            let all = requests(1);
            let rays = all.iter().map(|request| (camera.ray(request), camera.cone()));
            rays.map(|seen| world.effort_of(&moment, seen, &settings, &mut stack)[2]).collect()
        };
        let usual = rest(&world);
        let most = usual.iter().max().copied().unwrap_or(0);
        assert!(most > 3_000, "{most}");
        for may in [LEAST, 1_000] {
            world.efforts.direct = may;
            for (usual, took) in usual.iter().zip(rest(&world)) {
                // The last ray, its surface, and a ray from there.
                assert!(took <= *usual && took < may + 1_000, "{took} of {usual}, {may}");
            }
        }
    }

    /// However many ways there were to follow.
    #[test]
    fn a_sample_that_has_taken_all_ends_at_the_next_surface() {
        let mut world = World::new(maze());
        let moment = world.moment(0.0);
        let camera = Camera::new(&world.scene().view_at(moment.state(), 0), SIZE);
        let rays = |world: &World| -> usize {
            let rays = requests(1).into_iter().map(|request| {
                let (stack, settings) = (&mut Stack::new(), Settings::default());
                let mut lines = Vec::<String>::new();
                world.sample_with(&moment, &camera, &request, &settings, stack, &mut lines);
                lines.iter().filter(|line| line.starts_with("ray ")).count()
            });
            rays.max().unwrap_or(0)
        };
        assert!(rays(&world) > 8);
        world.efforts.direct = 0;
        // That of the way which is under way.
        assert_eq!(rays(&world), 2);
    }

    /// What a path leaves out it makes up for.
    #[test]
    fn paths_that_ask_one_light_for_all_are_right_in_the_mean() {
        let mut world = World::new(maze());
        let mean = |world: &World, samples: u32| {
            let pixels = traced(world, Integrator::Path, samples);
            pixels.iter().map(|rgb| f64::from(rgb[1])).sum::<f64>() / pixels.len() as f64
        };
        let all = mean(&world, 16);
        world.efforts.path = 0;
        let one = mean(&world, 64);
        // Seven lights at random: 0.4 % for 49,152 samples.
        assert!((one / all - 1.0).abs() < 0.02, "{one}, {all}");
    }

    /// Before half of the lights, and of those that are asked, something stands.
    #[test]
    fn lights_that_are_not_asked_are_as_hidden_as_the_others() {
        let mut scene = scenes::empty();
        let white = scenes::add_material(&mut scene, Vec3::ONE, 0.0, 1.0);
        scenes::add(&mut scene, scenes::floor(9.0, -1.0, white), Transform::IDENTITY);
        scenes::add(&mut scene, scenes::floor(9.0, 20.0, white), scenes::at(12.0, 0.0, 0.0));
        for k in 0..12 {
            let x = if k % 4 < 2 { 1e3 } else { -1e3 };
            scenes::add_point_light(&mut scene, Vec3::new(x, 1e3, 0.0), 1e6);
        }
        let mut world = World::new(Arc::new(scene));
        let all = traced(&world, Integrator::Direct, 1);
        for stride in [2, 6] {
            world.efforts.stride = stride;
            for (all, some) in all.iter().zip(traced(&world, Integrator::Direct, 1)) {
                assert!((all[0] - some[0]).abs() <= 1e-3 * all[0], "{stride}: {all:?}, {some:?}");
            }
        }
        assert!(all.iter().any(|rgb| rgb[0] > 0.0), "the floor is seen");
    }

    #[test]
    fn samples_are_tried_all_over_their_cells() {
        let all = CELLS.pixels() as u32;
        let is_near = |request: &Request| request.offset.iter().all(|x| x.abs() < 0.1);
        for of_scene in 0..20 {
            let tried: Vec<Request> = (0..all).map(|k| tried(k, of_scene)).collect();
            // Of 192 a 25th: 8, and three times the deviation of 2.7.
            let near = tried.iter().filter(|request| is_near(request)).count();
            assert!(near < 17, "{near} at the centres");
            assert!(tried.iter().all(|request| request.offset.iter().all(|x| x.abs() <= 0.5)));
            let mut cells: Vec<u32> = tried.iter().map(|request| request.pixel).collect();
            cells.sort_unstable();
            assert!(cells.into_iter().eq(0..all), "each cell");
            let other = super::tried(0, of_scene + 1);
            assert_ne!(tried[0].offset, other.offset, "of another scene");
        }
    }

    fn forecast(first: u64, lights: u64, rest: &[u64]) -> Forecast {
        Forecast { samples: rest.len() as u64, first, lights, rest: rest.to_vec() }
    }

    #[test]
    fn efforts_make_the_average_sample_what_it_may_be() {
        let cheap = forecast(400, 400, &[10, 0, 900, 30]);
        assert_eq!((cheap.stride(4, 2_000), cheap.direct(1, 2_000)), (1, MOST));
        assert_eq!(cheap.two_rays(4), (400 + 100) / 4);
        // 8,000 in all, 800 of them first: 7,200 for the rest, of which 10 and 30 take less than their share.
        let dear = forecast(400, 400, &[10, 9_000, 30, 9_000]);
        assert_eq!(dear.direct(1, 2_000), (7_200 - 40) / 2);
        // 7,600 are left for lights that take 80,000: 7 of 80 fit.
        let lit = forecast(400, 80_000, &[0; 4]);
        assert_eq!(lit.stride(80, 2_000), 80usize.div_ceil(7));
        assert_eq!((lit.stride(80, 0), lit.direct(80, 0)), (80, MOST));
        // A light is seen, and a fifth more hardly felt.
        assert_eq!(forecast(400, 9_000, &[0; 4]).stride(80, 2_000), 1);
        // However little is left.
        assert_eq!(forecast(400, 400, &[5_000; 4]).direct(1, 0), LEAST);
        assert_eq!((lit.path(80, 1_500), lit.path(80, 9_000)), (LEAST, 9_000 - 4 * 350));
    }

    #[test]
    fn nothing_is_left_out_of_what_is_seen_of_an_empty_scene() {
        let world = World::open("a", Arc::new(scenes::empty()), &Limits::default());
        let world = world.expect("there is nothing to refuse");
        let Efforts { stride, direct, .. } = world.efforts;
        assert_eq!((stride, direct), (1, MOST));
    }
}
