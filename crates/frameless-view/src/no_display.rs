//! Where no window can be opened, and why.

use std::ffi::OsString;
use std::fmt;

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

#[cfg(test)]
mod tests {
    use super::*;

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
