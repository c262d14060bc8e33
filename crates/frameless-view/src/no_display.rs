//! What to say where no window can be opened.

use std::ffi::OsString;

/// What to do instead.
const INSTEAD: &str = "run 'frameless compare experiments/figures.toml --out out/figures' \
     instead, which writes numbers, curves, pictures and a video";

/// Whether there is a display to open a window on, told from the environment `variable` as X11 and Wayland programs do.
/// Always so on systems that need no such variable.
///
/// # Errors
/// With a message for the user if there is none.
pub(crate) fn check(variable: impl Fn(&str) -> Option<OsString>) -> anyhow::Result<()> {
    if !cfg!(all(unix, not(target_os = "macos"))) {
        return Ok(());
    }
    let set = |name| variable(name).is_some_and(|value| !value.is_empty());
    if ["DISPLAY", "WAYLAND_DISPLAY", "WAYLAND_SOCKET"].into_iter().any(set) {
        return Ok(());
    }
    anyhow::bail!("no display: neither DISPLAY nor WAYLAND_DISPLAY is set; {INSTEAD}")
}

/// The window system's or graphics driver's error, for the user.
pub(crate) fn explain(error: &eframe::Error) -> anyhow::Error {
    match error {
        eframe::Error::AppCreation(error) => anyhow::anyhow!("cannot start the view: {error}"),
        eframe::Error::Wgpu(error) => anyhow::anyhow!(
            "no display: the graphics driver cannot draw into a window ({error}); a software driver \
             (lavapipe, package mesa-vulkan-drivers) is enough; or {INSTEAD}"
        ),
        error => {
            // The window library puts its source file and line before the reason.
            let text = error.to_string();
            let reason = text.rsplit(": ").next().unwrap_or(&text);
            anyhow::anyhow!("no display: cannot open a window ({reason}); {INSTEAD}")
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    #[cfg(all(unix, not(target_os = "macos")))]
    fn without_a_display_the_way_out_is_named() {
        let error = check(|_| None).unwrap_err().to_string();
        assert!(error.starts_with("no display: "), "{error}");
        assert!(error.contains("frameless compare experiments/figures.toml --out out"), "{error}");
        assert!(check(|_| Some(OsString::new())).is_err(), "empty is not set");
    }

    #[test]
    fn any_display_will_do() {
        for present in ["DISPLAY", "WAYLAND_DISPLAY", "WAYLAND_SOCKET"] {
            check(|name| (name == present).then(|| OsString::from(":0"))).unwrap();
        }
    }
}
