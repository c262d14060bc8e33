//! `frameless bench`: speeds as ratios against something measured in the same run.

mod display;
mod edit;
mod engine;
mod rays;
mod sampler;
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
    };
    let text = if args.json { table::json(&rows) } else { table::plain(&rows) };
    Ok(output::print(&text)?)
}
