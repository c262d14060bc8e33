//! A bar on the terminal, or lines where there is none; and Ctrl-C as the wish to stop.

use std::io::IsTerminal;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use anyhow::Context;
use frameless_eval::Progress;
use indicatif::{ProgressBar, ProgressStyle};

pub(super) struct Bar {
    bar: ProgressBar,
    interrupted: Arc<AtomicBool>,
}

impl Bar {
    pub(super) fn new() -> anyhow::Result<Bar> {
        let interrupted = Arc::new(AtomicBool::new(false));
        let stop = Arc::clone(&interrupted);
        ctrlc::set_handler(move || stop.store(true, Ordering::Relaxed))
            .context("cannot listen for Ctrl-C")?;
        let bar = ProgressBar::new(0);
        let style = ProgressStyle::with_template("{bar:30} {percent:>3} %, {eta} left · {msg}");
        bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
        Ok(Bar { bar, interrupted })
    }

    /// Leaves no trace on the terminal.
    pub(super) fn clear(&self) {
        self.bar.finish_and_clear();
    }
}

impl Progress for Bar {
    fn plan(&self, work: u64) {
        self.bar.set_length(work);
    }

    fn stage(&self, what: &str) {
        self.bar.set_message(what.to_owned());
        // A log has no place for a bar.
        if !std::io::stderr().is_terminal() {
            let percent = 100 * self.bar.position() / self.bar.length().unwrap_or(1).max(1);
            eprintln!("{percent:>3} % {what}");
        }
    }

    fn advance(&self, work: u64) {
        self.bar.inc(work);
    }

    fn should_stop(&self) -> bool {
        self.interrupted.load(Ordering::Relaxed)
    }
}
