//! `frameless bench`: speeds as ratios against something measured in the same run.

mod display;
mod edit;
mod engine;
mod latency;
mod load;
mod rays;
mod sampler;
mod scaling;
mod still;
mod table;

use crate::args::{BenchArgs, Benchmark};
use crate::failure::Failure;
use crate::output;

/// Measure, then print a table or JSON.
pub(crate) fn run(args: &BenchArgs) -> Result<(), Failure> {
    let rows = match args.what {
        Benchmark::Engine => engine::measure(args)?,
        Benchmark::Sampler => sampler::measure(args)?,
        Benchmark::Display => display::measure(args)?,
        Benchmark::Edit => edit::measure(args)?,
        Benchmark::Rays => rays::measure(args)?,
        Benchmark::Still => still::measure(args)?,
        Benchmark::Latency => latency::measure(args)?,
        Benchmark::Scaling => scaling::measure(args)?,
        Benchmark::Load => load::measure(args)?,
    };
    let text = if args.json { table::json(&rows) } else { table::plain(&rows) };
    Ok(output::print(&text)?)
}

/// Threads that trace, counted.
fn threads(args: &BenchArgs) -> usize {
    match args.threads {
        0 => std::thread::available_parallelism().map_or(1, usize::from),
        threads => threads,
    }
}
