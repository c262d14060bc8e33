//! What was ignored or replaced, gathered so that a scene with a thousand transparent materials says so once.

use std::collections::HashMap;

/// Names that are spelled out per kind of warning; the rest are counted.
const NAMES_SHOWN: usize = 4;
/// Kinds of warnings that are kept. Kinds hold text from the file, so that a hostile file could make millions.
const KINDS_KEPT: usize = 100;

/// Kinds of warnings in order of appearance, each with those whom it concerns.
#[derive(Debug, Default)]
pub(super) struct Warnings {
    kinds: Vec<Kind>,
    index_of: HashMap<String, usize>,
    left_out: usize,
}

#[derive(Debug)]
struct Kind {
    what: String,
    names: Vec<String>,
    more: usize,
}

impl Warnings {
    /// Something that concerns the whole file.
    pub(super) fn add(&mut self, what: impl Into<String>) {
        self.kind(what.into());
    }

    /// Something that happened to one of many: `whom` is e.g. `material "glass"`.
    pub(super) fn about(&mut self, what: impl Into<String>, whom: impl Into<String>) {
        let Some(kind) = self.kind(what.into()) else { return };
        let whom = whom.into();
        if kind.names.contains(&whom) {
            return;
        }
        if kind.names.len() < NAMES_SHOWN {
            kind.names.push(whom);
        } else {
            kind.more += 1;
        }
    }

    fn kind(&mut self, what: String) -> Option<&mut Kind> {
        if let Some(&index) = self.index_of.get(&what) {
            return Some(&mut self.kinds[index]);
        }
        if self.kinds.len() == KINDS_KEPT {
            self.left_out += 1;
            return None;
        }
        self.index_of.insert(what.clone(), self.kinds.len());
        self.kinds.push(Kind { what, names: Vec::new(), more: 0 });
        self.kinds.last_mut()
    }

    /// One line per kind.
    pub(super) fn into_lines(self) -> Vec<String> {
        let mut lines: Vec<String> = self.kinds.iter().map(Kind::line).collect();
        if self.left_out > 0 {
            lines.push(format!("{} further warnings left out", self.left_out));
        }
        lines
    }
}

impl Kind {
    fn line(&self) -> String {
        let names = self.names.join(", ");
        match (self.names.len(), self.more) {
            (0, _) => self.what.clone(),
            (_, 0) => format!("{}: {names}", self.what),
            (_, more) => format!("{}: {names} and {more} more", self.what),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_kind_is_said_once_with_a_few_names() {
        let mut warnings = Warnings::default();
        warnings.add("skins are not drawn");
        warnings.add("skins are not drawn");
        for number in 0..6 {
            warnings.about("drawn opaque", format!("material {number}"));
        }
        warnings.about("drawn opaque", "material 0");
        assert_eq!(
            warnings.into_lines(),
            [
                "skins are not drawn",
                "drawn opaque: material 0, material 1, material 2, material 3 and 2 more"
            ]
        );
    }

    #[test]
    fn a_flood_of_kinds_is_counted_not_kept() {
        let mut warnings = Warnings::default();
        for number in 0..1000 {
            warnings.add(format!("kind {number}"));
        }
        let lines = warnings.into_lines();
        assert_eq!(lines.len(), KINDS_KEPT + 1);
        assert_eq!(lines[KINDS_KEPT], "900 further warnings left out");
    }
}
