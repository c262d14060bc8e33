//! Running the program and looking at what it says.

use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

/// What one run of the program left behind.
pub(crate) struct Run {
    /// The exit code; `None` if a signal ended it.
    pub(crate) code: Option<i32>,
    /// Standard output.
    pub(crate) out: String,
    /// Standard error.
    pub(crate) err: String,
    /// From start to end.
    pub(crate) duration: Duration,
}

impl Run {
    /// It worked, and complained of nothing.
    #[track_caller]
    pub(crate) fn succeeded(self) -> Self {
        assert_eq!(self.code, Some(0), "stderr: {}", self.err);
        self
    }

    /// It ended with `code` and one line that begins with `error: ` and contains `word`, and printed
    /// nothing else.
    #[track_caller]
    pub(crate) fn refused(self, code: i32, word: &str) -> Self {
        assert_eq!(self.code, Some(code), "stderr: {}", self.err);
        let errors: Vec<&str> = self.err.lines().collect();
        assert_eq!(errors.len(), 1, "wanted one line: {}", self.err);
        assert!(errors[0].starts_with("error: "), "{}", self.err);
        assert!(errors[0].contains(word), "no {word:?} in: {}", self.err);
        assert_eq!(self.out, "", "partial output");
        self
    }
}

/// The program with no display, so that no test opens a window.
pub(crate) fn program<S: AsRef<std::ffi::OsStr>>(arguments: &[S]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_frameless"));
    command.args(arguments).stdin(Stdio::null());
    for display in ["DISPLAY", "WAYLAND_DISPLAY", "WAYLAND_SOCKET"] {
        command.env_remove(display);
    }
    command
}

/// The program, run to its end.
pub(crate) fn frameless<S: AsRef<std::ffi::OsStr>>(arguments: &[S]) -> Run {
    ran(program(arguments))
}

/// The same with no more memory to write to than so many KiB, where the system can be told.
pub(crate) fn frameless_within<S: AsRef<std::ffi::OsStr>>(memory_kib: u32, arguments: &[S]) -> Run {
    if !cfg!(target_os = "linux") {
        return frameless(arguments);
    }
    let program = program(arguments);
    let mut limited = Command::new("sh");
    limited.args(["-c", &format!("ulimit -d {memory_kib} && exec \"$@\""), "sh"]);
    limited.arg(program.get_program()).args(program.get_args()).stdin(Stdio::null());
    ran(limited)
}

fn ran(mut command: Command) -> Run {
    let start = Instant::now();
    let Output { status, stdout, stderr } = command.output().expect("the program starts");
    Run {
        code: status.code(),
        out: String::from_utf8_lossy(&stdout).into_owned(),
        err: String::from_utf8_lossy(&stderr).into_owned(),
        duration: start.elapsed(),
    }
}
