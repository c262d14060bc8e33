//! What went wrong while loading, and where in the file.

use std::fmt;

use super::limits::flag_of;

/// A file that could not be loaded: which one, where in it, and what is wrong there.
#[derive(Debug, thiserror::Error)]
#[error("{file}: {place}: {problem}")]
pub struct LoadError {
    /// As the caller named it.
    pub file: String,
    /// Where in the file.
    pub place: Place,
    /// What is wrong there.
    #[source]
    pub problem: Problem,
}

/// A place in a glTF file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Place {
    /// The file as a whole: it cannot be read, or it is too large.
    Whole,
    /// Byte offset from the file's begin: GLB structure and JSON syntax.
    Byte(u64),
    /// JSON pointer (RFC 6901) into the glTF document.
    Pointer(String),
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Place::Whole => f.write_str("whole file"),
            Place::Byte(offset) => write!(f, "byte {offset}"),
            Place::Pointer(pointer) if pointer.is_empty() => f.write_str("/"),
            Place::Pointer(pointer) => f.write_str(pointer),
        }
    }
}

/// What is wrong at a place.
#[derive(Debug, thiserror::Error)]
pub enum Problem {
    /// The file, or one that it names, cannot be read.
    #[error("cannot be read: {0}")]
    Io(#[from] std::io::Error),
    /// Not JSON.
    #[error("invalid JSON: {0}")]
    Json(String),
    /// Something else stands where one thing is wanted.
    #[error("wanted {wanted}, got {came}")]
    Unexpected {
        /// What the specification wants there.
        wanted: String,
        /// What the file has.
        came: String,
    },
    /// More than [`crate::Limits`] allow.
    #[error("{came} {what}, more than the limit of {limit}{}", how_to_raise(what, *enough))]
    Limit {
        /// The thing that is counted.
        what: &'static str,
        /// How many the file asks for.
        came: u64,
        /// How many are allowed.
        limit: u64,
        /// Of which value of the field of [`crate::Limits`] that bounds it this would be allowed, if the limit is a part of that.
        enough: Option<u64>,
    },
    /// The file says that it cannot be understood without this extension.
    #[error("the file requires the extension {0}, which is not supported")]
    RequiredExtension(String),
}

/// A [`LoadError`] before the file's name is added.
#[derive(Debug)]
pub(super) struct Fault {
    pub(super) place: Place,
    pub(super) problem: Problem,
}

impl Fault {
    /// The limit is a part of one that a flag raises: `enough` of that for so many.
    pub(super) fn telling(mut self, of: impl FnOnce(u64) -> u64) -> Fault {
        if let Problem::Limit { came, enough, .. } = &mut self.problem {
            *enough = Some(of(*came));
        }
        self
    }

    pub(super) fn at_byte(offset: usize, wanted: &str, came: impl fmt::Display) -> Fault {
        Fault { place: Place::Byte(offset as u64), problem: unexpected(wanted, came) }
    }

    pub(super) fn at(pointer: &str, wanted: impl fmt::Display, came: impl fmt::Display) -> Fault {
        Fault { place: Place::Pointer(pointer.to_owned()), problem: unexpected(wanted, came) }
    }

    pub(super) fn in_file(self, file: &str) -> LoadError {
        LoadError { file: file.to_owned(), place: self.place, problem: self.problem }
    }
}

/// Names the flag of the program `frameless` that raises the limit, if there is one.
fn how_to_raise(what: &str, enough: Option<u64>) -> String {
    const MIB: u64 = 1 << 20;
    let Some(flag) = flag_of(what) else { return String::new() };
    match enough {
        None => format!("; {flag} raises it"),
        Some(bytes) if flag == "--max-memory" => {
            format!("; {flag} raises it ({}M or more)", bytes.div_ceil(MIB))
        }
        Some(count) => format!("; {flag} raises it ({count} or more)"),
    }
}

fn unexpected(wanted: impl fmt::Display, came: impl fmt::Display) -> Problem {
    Problem::Unexpected { wanted: wanted.to_string(), came: came.to_string() }
}

/// Text from a file, fit for a message: in quotes, control characters escaped, at most 60 characters.
pub(super) fn quoted(text: &str) -> String {
    let (shown, rest) = split_after(text, 60);
    let ellipsis = if rest.is_empty() { "" } else { "…" };
    format!("{shown:?}{ellipsis}")
}

/// What another library says about a file, fit for a message: one line of at most 120 characters.
pub(crate) fn one_line(message: &dyn fmt::Display) -> String {
    let message = message.to_string();
    let (shown, rest) = split_after(message.trim(), 120);
    let shown: String =
        shown.chars().map(|char| if char.is_control() { ' ' } else { char }).collect();
    if rest.is_empty() { shown } else { shown + "…" }
}

fn split_after(text: &str, chars: usize) -> (&str, &str) {
    let end = text.char_indices().nth(chars).map_or(text.len(), |(end, _)| end);
    text.split_at(end)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quoted_text_cannot_steer_a_terminal_nor_flood_it() {
        assert_eq!(quoted("a\u{1b}[31m"), r#""a\u{1b}[31m""#);
        assert_eq!(quoted(&"ä".repeat(1000)).chars().count(), 63);
        assert_eq!(one_line(&"a\n\u{1b}b\n"), "a  b");
        assert_eq!(one_line(&"ä".repeat(1000)).chars().count(), 121);
    }
}
