//! Reading `results.json`.

use std::path::Path;

use serde::Deserialize;

use crate::error::EvalError;
use crate::results::{RESULTS_VERSION, Results};

/// What every version begins with.
#[derive(Deserialize)]
struct Header {
    format: String,
    version: u32,
}

impl Results {
    /// Reads a results file of the present version.
    ///
    /// # Errors
    /// If the file cannot be read, is no results file, or has another version; the message names the file.
    pub fn read(path: &Path) -> Result<Results, EvalError> {
        let text = std::fs::read_to_string(path)
            .map_err(|source| EvalError::Unreadable { path: path.to_path_buf(), source })?;
        Results::parse(&text)
            .map_err(|message| EvalError::Invalid { path: path.to_path_buf(), message })
    }

    /// As [`Results::read`], from text.
    ///
    /// # Errors
    /// What was wanted, and what came.
    pub fn parse(text: &str) -> Result<Results, String> {
        let header: Header = serde_json::from_str(text)
            .map_err(|error| format!("wanted the results.json of a comparison: {error}"))?;
        if header.format != FORMAT {
            return Err(format!("wanted the format {FORMAT:?}, got {:?}", header.format));
        }
        if header.version != RESULTS_VERSION {
            return Err(format!(
                "results of version {}, but this program reads version {RESULTS_VERSION}; run the experiment again",
                header.version
            ));
        }
        serde_json::from_str(text).map_err(|error| error.to_string())
    }
}

/// The first words of every results file.
pub(crate) const FORMAT: &str = "frameless results";

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn other_files_and_versions_are_refused_by_what_they_are() {
        for (text, part) in [
            ("", "wanted the results.json"),
            ("title = 'x'", "wanted the results.json"),
            ("{}", "missing field `format`"),
            (r#"{"format": "glTF", "version": 2}"#, "got \"glTF\""),
            (r#"{"format": "frameless results", "version": 1, "runs": []}"#, "version 1"),
            (r#"{"format": "frameless results", "version": 2}"#, "missing field"),
        ] {
            let message = Results::parse(text).expect_err(text);
            assert!(message.contains(part), "{text}: {message}");
        }
    }
}
