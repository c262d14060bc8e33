//! The program `frameless`. One file per subcommand; `args` says what each of them takes.

mod args;
mod bench;
mod compare;
mod failure;
mod info;
mod input;
mod logger;
mod output;
mod parse;
mod render;
mod scenes;
mod serve;
mod trace;
mod view;

use std::process::ExitCode;

use crate::args::{Args, Command, ViewArgs};
use crate::failure::Failure;

fn main() -> ExitCode {
    logger::start();
    let result = match Args::checked() {
        Ok(args) => run(args),
        Err(error) if error.use_stderr() => Err(Failure::of_arguments(&error)),
        Err(help) => output::print_help(&help).map_err(Failure::other),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            eprintln!("error: {failure}");
            ExitCode::from(failure.code())
        }
    }
}

fn run(args: Args) -> Result<(), Failure> {
    match args.command.unwrap_or_else(|| Command::View(ViewArgs::default())) {
        Command::View(args) => view::run(&args),
        Command::Serve(args) => serve::run(&args),
        Command::Compare(args) => compare::run(&args),
        Command::Render(args) => render::run(&args),
        Command::Trace(args) => trace::run(&args),
        Command::Info(args) => info::run(&args),
        Command::Bench(args) => bench::run(&args),
        Command::Scenes => scenes::run(),
    }
}
