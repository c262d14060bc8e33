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

/// Side of the squares of pixels that are traced one after the other, so that neighbours are walked together: at one sample per pixel as many
/// as are traced at once, [`crate::WAVE`].
const BLOCK: u32 = 8;

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
    let numbers = (0..samples).map(|k| still.first_sample.wrapping_add(k));
    pool.install(|| {
        let bands = image.par_chunks_mut((BLOCK * size.width) as usize).enumerate();
        bands.for_each_init(Stack::new, |stack, (index, band)| {
            let (first_row, rows) = (index as u32 * BLOCK, band.len() as u32 / size.width);
            for left in (0..size.width).step_by(BLOCK as usize) {
                let pixels = block(left, size.width - left, rows);
                let request = |(x, y)| {
                    let pixel = size.index(x, first_row + y);
                    numbers.clone().map(move |number| Request::in_sequence(pixel, number))
                };
                let requests = pixels.clone().flat_map(request);
                let (mut sums, mut sum, mut left) = (pixels, Vec3::ZERO, samples);
                let add = |rgb: [f32; 3], _| {
                    sum += Vec3::from(rgb);
                    left -= 1;
                    if left == 0
                        && let Some((x, y)) = sums.next()
                    {
                        band[size.index(x, y) as usize] = (sum / samples as f32).to_array();
                        (sum, left) = (Vec3::ZERO, samples);
                    }
                };
                world.samples((&moment, &camera), requests, &still.settings, stack, add);
            }
            (0..rows).for_each(|_| row_done());
        });
    });
    image
}

/// Columns and rows of a block's pixels, along a Morton curve, as far as they are there.
fn block(left: u32, width: u32, height: u32) -> impl Iterator<Item = (u32, u32)> + Clone {
    let even = |k: u32| k & 1 | k >> 1 & 2 | k >> 2 & 4;
    let places = (0..BLOCK * BLOCK).map(move |k| (even(k), even(k >> 1)));
    let is_there = move |&(x, y): &(u32, u32)| x < width && y < height;
    places.filter(is_there).map(move |(x, y)| (left + x, y))
}
