//! What the libraries have to say beside their results, on standard error.

use log::{Level, LevelFilter, Log, Metadata, Record};

use crate::output::printable;

/// Warnings of our own crates; of others, such as the graphics drivers' many, only errors.
struct ToStandardError;

impl Log for ToStandardError {
    fn enabled(&self, metadata: &Metadata<'_>) -> bool {
        let own = metadata.target().starts_with("frameless");
        metadata.level() <= if own { Level::Warn } else { Level::Error }
    }

    fn log(&self, record: &Record<'_>) {
        if self.enabled(record.metadata()) {
            eprintln!("warning: {}", printable(&record.args().to_string()));
        }
    }

    fn flush(&self) {}
}

/// From now on what is logged is seen. Called once.
pub(crate) fn start() {
    // Fails only if there is a logger already.
    if log::set_logger(&ToStandardError).is_ok() {
        log::set_max_level(LevelFilter::Warn);
    }
}

/// From now on nothing that is logged is seen.
pub(crate) fn silence() {
    log::set_max_level(LevelFilter::Off);
}
