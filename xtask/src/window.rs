//! The window on a virtual screen: does it open, draw, save a screenshot and close?

use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::mpsc;
use std::thread;
use std::time::Duration;

use anyhow::{Context, Result, ensure};

use crate::command::{Stopped, output_within};
use crate::picture;

/// Long enough to trace every pixel of the small window several times in software.
const SECS_UNTIL_SCREENSHOT: &str = "3";

/// Starting a software Vulkan driver on a busy machine takes seconds; longer than this is a hang.
const LIMIT: Duration = Duration::from_secs(90);

/// Open the window, let it draw for some seconds, and look at its screenshot. Returns what was seen.
pub(crate) fn smoke(program: &Path, out: &Path) -> Result<String> {
    let screen = Screen::start()?;
    let screenshot = out.join("window.png");
    let mut view = Command::new(program);
    view.args(["view", "sphere", "--size", "320x240", "--after", SECS_UNTIL_SCREENSHOT]);
    view.arg("--screenshot").arg(&screenshot);
    view.env("DISPLAY", &screen.display).env_remove("WAYLAND_DISPLAY").env_remove("WAYLAND_SOCKET");
    // Without one, libraries of the desktop complain on every start.
    view.env("XDG_RUNTIME_DIR", out);
    let answer = output_within(&mut view, LIMIT)?;
    ensure!(
        answer.status.success(),
        "the window ended with {}: {}",
        answer.status,
        String::from_utf8_lossy(&answer.stderr).trim_end()
    );
    let (width, height) = picture::shows_something(&screenshot)?;
    Ok(format!("screenshot of {width}×{height} pixels shows a picture"))
}

/// A virtual screen that nobody else uses, gone when dropped.
struct Screen {
    _server: Stopped,
    /// As in the environment variable DISPLAY.
    display: String,
}

impl Screen {
    /// The server picks a free number itself and writes it to the file descriptor it is told.
    fn start() -> Result<Screen> {
        let server = Command::new("Xvfb")
            .args(["-displayfd", "1", "-screen", "0", "1024x768x24", "-nolisten", "tcp"])
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .context("cannot start Xvfb")?;
        let mut server = Stopped(server);
        let stdout = server.0.stdout.take().context("Xvfb has no standard output")?;
        let (send, number) = mpsc::channel();
        thread::spawn(move || {
            let mut line = String::new();
            // An unreadable line leaves it empty, which is refused below; nobody waits after a time-out.
            let _ = BufReader::new(stdout).read_line(&mut line);
            let _ = send.send(line);
        });
        let number = number.recv_timeout(LIMIT).context("Xvfb does not say which screen it is")?;
        ensure!(!number.trim().is_empty(), "Xvfb ended without opening a screen");
        Ok(Screen { _server: server, display: format!(":{}", number.trim()) })
    }
}
