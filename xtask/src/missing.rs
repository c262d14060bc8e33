//! What the checks need from the machine, and how one gets it.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// Libraries that the window loads while it runs (none is needed to build), with their Debian packages.
const WINDOW_LIBRARIES: [(&str, &str); 6] = [
    ("libX11-xcb.so.1", "libx11-xcb1"),
    ("libXcursor.so.1", "libxcursor1"),
    ("libXi.so.6", "libxi6"),
    ("libXrandr.so.2", "libxrandr2"),
    ("libxkbcommon-x11.so.0", "libxkbcommon-x11-0"),
    ("libvulkan.so.1", "libvulkan1"),
];

/// Something that is not there: what, what for, and how to install it.
pub(crate) struct Missing {
    what: &'static str,
    purpose: &'static str,
    install: String,
}

impl std::fmt::Display for Missing {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} is missing ({}); install it with: {}", self.what, self.purpose, self.install)
    }
}

/// Needed to build: nothing can be checked without it.
pub(crate) fn to_build() -> Vec<Missing> {
    let compilers = ["c++", "g++", "clang++"];
    let named_compiler = std::env::var_os("CXX").is_some();
    let mut missing = Vec::new();
    if !named_compiler && !compilers.iter().any(|compiler| runs(compiler, &["--version"])) {
        missing.push(debian("a C++ compiler", "the video encoder is built from C++", "g++"));
    }
    for (component, args) in
        [("rustfmt", ["fmt", "--version"]), ("clippy", ["clippy", "--version"])]
    {
        let cargo = std::env::var("CARGO").unwrap_or_else(|_| "cargo".into());
        if !runs(&cargo, &args) {
            let install = format!("rustup component add {component}");
            missing.push(Missing { what: component, purpose: "it is one of the checks", install });
        }
    }
    missing
}

/// Needed for an environment with Python packages of its own.
pub(crate) fn to_make_a_venv() -> Option<Missing> {
    let purpose = "our metrics are checked against Python packages";
    let is_there = runs("python3", &["-c", "import ensurepip, venv"]);
    (!is_there).then(|| debian("python3 with venv", purpose, "python3-venv"))
}

/// Needed to open the window on a virtual screen.
pub(crate) fn to_open_a_window() -> Vec<Missing> {
    let mut missing = Vec::new();
    if !runs("Xvfb", &["-help"]) {
        missing.push(debian("Xvfb", "the window opens on a virtual screen", "xvfb"));
    }
    if !has_vulkan_driver() {
        let purpose = "the window is drawn in software";
        missing.push(debian("a Vulkan driver", purpose, "mesa-vulkan-drivers"));
    }
    if let Some(known) = known_libraries() {
        for (library, package) in WINDOW_LIBRARIES {
            if !known.contains(library) {
                missing.push(debian(library, "the window loads it", package));
            }
        }
    }
    missing
}

/// Needed to look into the comparison's video.
pub(crate) fn to_read_a_video() -> Vec<Missing> {
    if runs("ffprobe", &["-version"]) {
        return Vec::new();
    }
    vec![debian("ffprobe", "it reads the comparison's video", "ffmpeg")]
}

/// Needed to open the report.
pub(crate) fn to_open_a_report() -> Vec<Missing> {
    if browser().is_some() {
        return Vec::new();
    }
    vec![debian("Chromium", "the report is opened in a browser", "chromium")]
}

/// Needed to open the web page in another browser.
pub(crate) fn to_open_firefox() -> Vec<Missing> {
    if ["firefox", "firefox-esr"].iter().any(|name| runs(name, &["--version"])) {
        return Vec::new();
    }
    vec![debian("Firefox", "the web page is opened in it, too", "firefox-esr")]
}

/// Needed to run the examples with Mitsuba.
pub(crate) fn to_run_mitsuba() -> Missing {
    debian("LLVM 16 or newer", "Mitsuba compiles its kernels with it", "libllvm19")
}

/// The newest LLVM that Mitsuba can use: what the environment says, or what the dynamic linker knows.
pub(crate) fn llvm() -> Option<PathBuf> {
    if let Some(named) = std::env::var_os("DRJIT_LIBLLVM_PATH") {
        return Some(named.into());
    }
    newest_llvm(&known_libraries()?)
}

/// From lines like `libLLVM-16.so.1 (libc6,x86-64) => /lib/x86_64-linux-gnu/libLLVM-16.so.1`. Older ones lack what Mitsuba asks for.
fn newest_llvm(libraries: &str) -> Option<PathBuf> {
    const OLDEST: u32 = 16;
    let version = |line: &str| {
        let name = line.split_whitespace().next()?.strip_prefix("libLLVM")?;
        let digits = name.strip_prefix("-").or(name.strip_prefix(".so."))?;
        digits.split(|c: char| !c.is_ascii_digit()).next()?.parse::<u32>().ok()
    };
    let found = libraries.lines().filter_map(|line| {
        let path = line.split_once("=> ")?.1;
        Some((version(line)?, path))
    });
    found.filter(|(version, _)| *version >= OLDEST).max().map(|(_, path)| path.into())
}

/// The browser's name, if there is one.
pub(crate) fn browser() -> Option<&'static str> {
    let names = ["chromium", "chromium-browser", "google-chrome"];
    names.into_iter().find(|name| runs(name, &["--version"]))
}

fn debian(what: &'static str, purpose: &'static str, package: &str) -> Missing {
    Missing { what, purpose, install: format!("apt-get install {package}") }
}

/// Whether the program starts; what it answers does not matter, except that cargo says no to an unknown
/// subcommand and Xvfb's help ends with an error code.
fn runs(program: &str, args: &[&str]) -> bool {
    let status =
        Command::new(program).args(args).stdout(Stdio::null()).stderr(Stdio::null()).status();
    status.is_ok_and(|status| status.success() || program == "Xvfb")
}

fn has_vulkan_driver() -> bool {
    ["/usr/share/vulkan/icd.d", "/etc/vulkan/icd.d", "/usr/local/share/vulkan/icd.d"]
        .iter()
        .filter_map(|folder| Path::new(folder).read_dir().ok())
        .any(|mut files| files.next().is_some())
}

/// The dynamic linker's list; `None` on systems without one, where the window step itself will tell.
fn known_libraries() -> Option<String> {
    let list = ["ldconfig", "/sbin/ldconfig"]
        .iter()
        .find_map(|program| Command::new(program).arg("-p").output().ok())?;
    Some(String::from_utf8_lossy(&list.stdout).into_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_newest_llvm_that_will_do_is_found() {
        let libraries = "\tlibLLVM-15.so.1 (libc6,x86-64) => /lib/libLLVM-15.so.1\n\
            \tlibLLVM.so.19.1 (libc6,x86-64) => /lib/libLLVM.so.19.1\n\
            \tlibLLVM-16.so.1 (libc6,x86-64) => /lib/libLLVM-16.so.1\n\
            \tlibLLVMSPIRVLib.so.20 (libc6,x86-64) => /lib/other\n";
        assert_eq!(newest_llvm(libraries), Some("/lib/libLLVM.so.19.1".into()));
        assert_eq!(newest_llvm(libraries.lines().next().unwrap_or_default()), None);
        assert_eq!(newest_llvm(""), None);
    }
}
