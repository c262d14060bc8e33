//! The page's files, built into the program.

/// Path, content type, content.
type File = (&'static str, &'static str, &'static [u8]);

const CSS: &str = "text/css; charset=utf-8";
const SCRIPT: &str = "text/javascript; charset=utf-8";
const SVG: &str = "image/svg+xml";

/// The page itself.
pub(crate) const INDEX: &str = include_str!("../page/index.html");

macro_rules! file {
    ($name:literal, $kind:expr) => {
        ($name, $kind, include_bytes!(concat!("../page/", $name)))
    };
}

/// What it loads.
const FILES: [File; 21] = [
    file!("style.css", CSS),
    file!("icon.svg", SVG),
    file!("connection.js", SCRIPT),
    file!("crc.js", SCRIPT),
    file!("format.js", SCRIPT),
    file!("hands.js", SCRIPT),
    file!("help.js", SCRIPT),
    file!("hud.js", SCRIPT),
    file!("latency.js", SCRIPT),
    file!("layout.js", SCRIPT),
    file!("main.js", SCRIPT),
    file!("messages.js", SCRIPT),
    file!("panel.js", SCRIPT),
    file!("picture.js", SCRIPT),
    file!("protocol.js", SCRIPT),
    file!("record.js", SCRIPT),
    file!("save.js", SCRIPT),
    file!("theme.js", SCRIPT),
    file!("transport.js", SCRIPT),
    file!("upload.js", SCRIPT),
    ("favicon.ico", SVG, include_bytes!("../page/icon.svg")),
];

/// Content type and content of a file of the page.
pub(crate) fn file(name: &str) -> Option<(&'static str, &'static [u8])> {
    FILES.iter().find(|(known, ..)| *known == name).map(|(_, kind, content)| (*kind, *content))
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;
    use std::path::Path;

    use super::*;

    #[test]
    fn every_file_of_the_page_is_served() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("page");
        let names = std::fs::read_dir(folder).unwrap();
        let names: BTreeSet<String> =
            names.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
        let unserved = names.iter().filter(|name| *name != "index.html" && file(name).is_none());
        assert_eq!(unserved.collect::<Vec<_>>(), Vec::<&String>::new());
        assert!(file("../src/page.rs").is_none() && file("").is_none());
    }
}
