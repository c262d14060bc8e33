//! Whole pictures.

use frameless::{Request, Size};
use glam::Vec3;
use rayon::ThreadPool;
use rayon::prelude::*;

use crate::camera::{Camera, ViewSource};
use crate::integrator::Settings;
use crate::traverse::Stack;
use crate::world::World;

/// A picture of one moment, with as many samples per pixel as wanted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Still {
    /// Scene time in seconds.
    pub secs: f64,
    /// From where.
    pub view: ViewSource,
    /// In pixels.
    pub size: Size,
    /// How light is followed.
    pub settings: Settings,
    /// Per pixel, at least 1: so many of its sequence ([`Request::in_sequence`]), spread over the pixel.
    pub samples: u32,
    /// The number of the first of them, which is usually 0: a picture that others have gone before begins where they ended.
    pub first_sample: u32,
}

/// The picture of an ideal renderer that takes no time: every pixel's centre at exactly `secs`. Row-major linear RGB.
pub fn render(
    world: &World,
    secs: f64,
    view: &ViewSource,
    size: Size,
    settings: &Settings,
    pool: &ThreadPool,
) -> Vec<[f32; 3]> {
    let still = Still { secs, view: *view, size, settings: *settings, samples: 1, first_sample: 0 };
    render_still(world, &still, pool, || ())
}

/// The mean of every pixel's samples. Row-major linear RGB. `row_done` is told of every finished row, by any thread.
pub fn render_still(
    world: &World,
    still: &Still,
    pool: &ThreadPool,
    row_done: impl Fn() + Sync,
) -> Vec<[f32; 3]> {
    let (size, samples) = (still.size, still.samples.max(1));
    let moment = world.moment(still.secs);
    let camera = Camera::new(&still.view.at(world.scene(), moment.state()), size);
    let mut image = vec![[0.0; 3]; size.pixels()];
    pool.install(|| {
        let rows = image.par_chunks_mut(size.width as usize).zip(0..size.height);
        rows.for_each_init(Stack::new, |stack, (row, y)| {
            for (x, colour) in (0..).zip(row) {
                let numbers = (0..samples).map(|k| still.first_sample.wrapping_add(k));
                let requests = numbers.map(|n| Request::in_sequence(size.index(x, y), n));
                let mut sum = Vec3::ZERO;
                let add = |rgb: [f32; 3], _| sum += Vec3::from(rgb);
                world.samples((&moment, &camera), requests, &still.settings, stack, add);
                *colour = (sum / samples as f32).to_array();
            }
            row_done();
        });
    });
    image
}
