//! Where no window can be opened, and why.

use std::ffi::OsString;
use std::fmt;
use std::panic::{self, AssertUnwindSafe, PanicHookInfo};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// No window can be opened here; says why in one line.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NoDisplay(String);

impl fmt::Display for NoDisplay {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "no display: {}", self.0)
    }
}

impl std::error::Error for NoDisplay {}

/// Whether there is a display to open a window on, told from the environment `variable` as X11 and Wayland programs do.
/// Always so on systems that need no such variable.
///
/// # Errors
/// If there is none.
pub(crate) fn check(variable: impl Fn(&str) -> Option<OsString>) -> Result<(), NoDisplay> {
    if !cfg!(all(unix, not(target_os = "macos"))) {
        return Ok(());
    }
    let set = |name| variable(name).is_some_and(|value| !value.is_empty());
    if ["DISPLAY", "WAYLAND_DISPLAY", "WAYLAND_SOCKET"].into_iter().any(set) {
        return Ok(());
    }
    Err(NoDisplay("neither DISPLAY nor WAYLAND_DISPLAY is set".to_owned()))
}

/// The window system's or graphics driver's error, for the user.
pub(crate) fn explain(error: &eframe::Error) -> anyhow::Error {
    match error {
        eframe::Error::AppCreation(error) => anyhow::anyhow!("cannot start the view: {error}"),
        eframe::Error::Wgpu(error) => anyhow::Error::new(NoDisplay(format!(
            "the graphics driver cannot draw into a window ({error}); a software driver (lavapipe, package \
             mesa-vulkan-drivers) is enough"
        ))),
        error => {
            // The window library puts its source file and line before the reason.
            let text = error.to_string();
            let reason = text.rsplit(": ").next().unwrap_or(&text);
            anyhow::Error::new(NoDisplay(format!("cannot open a window ({reason})")))
        }
    }
}

/// What the window comes to. The window library panics where its connection to an X server breaks, as it does when that ends.
///
/// # Errors
/// If the connection has been lost.
///
/// # Panics
/// As `window` does of anything else.
pub(crate) fn while_connected<T>(window: impl FnOnce() -> T) -> anyhow::Result<T> {
    let is_lost = Arc::new(AtomicBool::new(false));
    let usual: Arc<dyn Fn(&PanicHookInfo<'_>) + Send + Sync> = panic::take_hook().into();
    let (told, others) = (Arc::clone(&is_lost), Arc::clone(&usual));
    panic::set_hook(Box::new(move |panic| {
        if panic.payload_as_str().is_some_and(speaks_of_connection) {
            told.store(true, Ordering::Relaxed);
        } else if !told.load(Ordering::Relaxed) {
            others(panic);
        }
    }));
    let result = panic::catch_unwind(AssertUnwindSafe(window));
    panic::set_hook(Box::new(move |panic| usual(panic)));
    match result {
        Ok(result) => Ok(result),
        Err(_) if is_lost.load(Ordering::Relaxed) => {
            Err(anyhow::anyhow!("the connection to the display was lost"))
        }
        Err(panic) => panic::resume_unwind(panic),
    }
}

/// As an error of the X client library is written that some result is unwrapped with.
fn speaks_of_connection(panic: &str) -> bool {
    panic.contains("Connection(IoError") || panic.contains("ConnectionError(IoError")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lost_connection_is_an_error_and_other_panics_stay_panics() {
        let lost: Result<(), &str> = Err("an IoError");
        let error =
            while_connected(|| panic!("`unwrap()` on an `Err`: Connection(IoError({lost:?}))"));
        let error: anyhow::Result<()> = error;
        let text = error.expect_err("it is lost").to_string();
        assert!(text.contains("connection to the display"), "{text}");
        assert_eq!(while_connected(|| 7).expect("nothing is lost"), 7);
        let other =
            panic::catch_unwind(|| while_connected(|| panic!("something else")).map(|()| 0));
        assert!(other.is_err(), "a panic that is none of the display's");
    }

    #[test]
    #[cfg(all(unix, not(target_os = "macos")))]
    fn without_a_display_the_reason_is_named() {
        let error = check(|_| None).unwrap_err().to_string();
        assert!(error.starts_with("no display: ") && error.contains("WAYLAND_DISPLAY"), "{error}");
        assert!(check(|_| Some(OsString::new())).is_err(), "empty is not set");
    }

    #[test]
    fn any_display_will_do() {
        for present in ["DISPLAY", "WAYLAND_DISPLAY", "WAYLAND_SOCKET"] {
            check(|name| (name == present).then(|| OsString::from(":0"))).unwrap();
        }
    }
}
