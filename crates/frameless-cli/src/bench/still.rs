//! Whole pictures: samples per second without a loop, for comparisons with renderers that make pictures.

use std::sync::Arc;

use frameless::Clock;
use frameless_scene::Limits;
use frameless_trace::{Settings, Still, ViewSource, World, render_still, thread_pool};

use super::table::Row;
use crate::args::BenchArgs;
use crate::failure::Failure;
use crate::input;

/// Rows `still.samples_per_sec` and `still.mean_radiance`, of all pixels and channels, which tells whether others render the same.
pub(super) fn measure(args: &BenchArgs) -> Result<Vec<Row>, Failure> {
    let world =
        World::new(Arc::new(input::scene(args.scene(), &args.choice(), &Limits::default())?));
    let settings = Settings { surfaces: false, ..args.light.settings()? };
    let (size, samples, view) = (args.size, args.samples, ViewSource::Camera(0));
    let still = Still { secs: 0.0, view, size, settings, samples, first_sample: 0 };
    let (pool, clock) = (thread_pool(args.threads), Clock::real());
    let (mut rates, mut means) = (Vec::new(), Vec::new());
    for _ in 0..args.rounds {
        let begin = clock.now();
        let picture = render_still(&world, &still, &pool, || ());
        let secs = clock.now().secs_since(begin);
        let count = size.pixels() as f64;
        rates.push(count * f64::from(samples) / secs);
        means.push(picture.iter().flatten().map(|&c| f64::from(c)).sum::<f64>() / (3.0 * count));
    }
    let conditions = format!(
        "{}, {}×{}, {}, {samples} samples per pixel; surfaces are not asked for",
        args.scene(),
        size.width,
        size.height,
        args.light.integrator
    );
    Ok(vec![
        Row::new("still.samples_per_sec", "samples/s", &rates, &conditions),
        Row::new("still.mean_radiance", "linear", &means, &conditions),
    ])
}
