//! Whole pictures.

use frameless::{Request, Size};
use rayon::ThreadPool;
use rayon::prelude::*;

use crate::camera::{Camera, ViewSource};
use crate::direct::{NoProbe, Settings};
use crate::traverse::Stack;
use crate::world::World;

/// The picture of an ideal renderer that takes no time: every pixel's centre at exactly `secs`. Row-major linear RGB.
pub fn render(
    world: &World,
    secs: f64,
    view: &ViewSource,
    size: Size,
    settings: &Settings,
    pool: &ThreadPool,
) -> Vec<[f32; 3]> {
    let moment = world.moment(secs);
    let camera = Camera::new(&view.at(world.scene(), moment.state()), size);
    let mut image = vec![[0.0; 3]; size.pixels()];
    pool.install(|| {
        let rows = image.par_chunks_mut(size.width as usize).zip(0..size.height);
        rows.for_each_init(Stack::new, |stack, (row, y)| {
            for (x, colour) in (0..).zip(row) {
                let ray = camera.ray(&Request::centre(size.index(x, y)));
                *colour = world.radiance(&moment, ray, settings, stack, &mut NoProbe).0;
            }
        });
    });
    image
}
