//! The output folder: finished cells that stay, and results that appear whole or not at all.

use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use tempfile::TempDir;

use crate::error::EvalError;

/// ```text
/// OUT/results.json    numbers, for programs        ┐
/// OUT/report.html     everything, for people       ├ of one comparison, and only of a finished one
/// OUT/pictures/       stills, curves, videos       ┘
/// OUT/cells/          finished runs, kept whatever happens
/// ```
pub(crate) struct OutputFolder {
    path: PathBuf,
}

/// Where cells lie.
const CELLS: &str = "cells";
/// Says what the folder is, to people and to the next comparison.
const README: &str = "README.txt";
const README_TEXT: &str = "\
Finished runs of `frameless compare`, one per file or folder, named after everything that determines them. The next
comparison into this folder takes from here what still fits. Delete the folder and everything is run again.
";
/// In the order in which they appear: whoever finds the last finds the others.
const PUBLISHED: [&str; 3] = ["pictures", "report.html", RESULTS];
const RESULTS: &str = "results.json";

impl OutputFolder {
    /// Makes the folder if it is not there.
    ///
    /// # Errors
    /// If `path` exists and is something other than the output of a comparison, or the place is not writable.
    pub(crate) fn open(path: &Path) -> Result<OutputFolder, EvalError> {
        let is_empty = || path.read_dir().is_ok_and(|mut entries| entries.next().is_none());
        let readme = path.join(CELLS).join(README);
        let is_ours = || path.join(RESULTS).is_file() || readme.is_file();
        if path.exists() && !is_ours() && !is_empty() {
            return Err(EvalError::OutputInUse { path: path.to_path_buf() });
        }
        let folder = OutputFolder { path: path.to_path_buf() };
        std::fs::create_dir_all(folder.cells())
            .and_then(|()| std::fs::write(&readme, README_TEXT))
            .map_err(|e| EvalError::unwritable(path, e))?;
        Ok(folder)
    }

    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// Where finished cells are kept.
    pub(crate) fn cells(&self) -> PathBuf {
        self.path.join(CELLS)
    }

    /// A place for what is to be [published](OutputFolder::publish); gone if that never comes.
    pub(crate) fn partial(&self) -> Result<TempDir, EvalError> {
        folder_in(&self.path, ".partial-")
    }

    /// Everything has been written to `partial`: let it appear in place of what was published before.
    ///
    /// # Errors
    /// If the folder cannot be written. There is no `results.json` then.
    pub(crate) fn publish(&self, partial: TempDir) -> Result<(), EvalError> {
        for name in PUBLISHED.iter().rev() {
            remove(&self.path.join(name))?;
        }
        for name in PUBLISHED {
            let (from, to) = (partial.path().join(name), self.path.join(name));
            std::fs::rename(from, &to).map_err(|e| EvalError::unwritable(&to, e))?;
        }
        Ok(())
    }
}

impl Drop for OutputFolder {
    /// Without a finished cell there is nothing to keep.
    fn drop(&mut self) {
        let cells = self.cells();
        let only_readme = |entries: std::fs::ReadDir| entries.count() == 1;
        if cells.read_dir().is_ok_and(only_readme) {
            // What cannot be removed is an empty folder that does no harm.
            let _ = std::fs::remove_file(cells.join(README));
            let _ = std::fs::remove_dir(&cells);
            let _ = std::fs::remove_dir(&self.path);
        }
    }
}

/// A new folder for unfinished work, gone with the value.
pub(crate) fn folder_in(parent: &Path, prefix: &str) -> Result<TempDir, EvalError> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(prefix);
    // Temporary folders are private unless told otherwise; these become output.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o777));
    builder.tempdir_in(parent).map_err(|e| EvalError::unwritable(parent, e))
}

fn remove(path: &Path) -> Result<(), EvalError> {
    let removed =
        if path.is_dir() { std::fs::remove_dir_all(path) } else { std::fs::remove_file(path) };
    match removed {
        Err(error) if error.kind() != ErrorKind::NotFound => {
            Err(EvalError::unwritable(path, error))
        }
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn write(folder: &OutputFolder, text: &str) -> TempDir {
        let partial = folder.partial().expect("writable");
        std::fs::create_dir(partial.path().join("pictures")).expect("writable");
        for file in ["pictures/a.png", "report.html", "results.json"] {
            std::fs::write(partial.path().join(file), text).expect("writable");
        }
        partial
    }

    fn entries(folder: &Path) -> Vec<String> {
        let entries = folder.read_dir().expect("readable");
        let mut names: Vec<String> =
            entries.map(|e| e.expect("readable").file_name().to_string_lossy().into()).collect();
        names.sort();
        names
    }

    #[test]
    fn appears_whole_or_not_at_all() {
        let parent = tempfile::tempdir().expect("a temporary folder");
        let wanted = parent.path().join("out");
        let folder = OutputFolder::open(&wanted).expect("writable");
        drop(write(&folder, "unfinished"));
        drop(folder);
        assert!(entries(parent.path()).is_empty(), "something was left behind");

        let folder = OutputFolder::open(&wanted).expect("writable");
        std::fs::write(folder.cells().join("a.json"), "{}").expect("writable");
        for text in ["first", "second"] {
            folder.publish(write(&folder, text)).expect("published");
            for file in ["pictures/a.png", "report.html", "results.json"] {
                assert_eq!(std::fs::read_to_string(wanted.join(file)).expect("readable"), text);
            }
        }
        drop(folder);
        assert_eq!(entries(&wanted), ["cells", "pictures", "report.html", "results.json"]);
        OutputFolder::open(&wanted).expect("an earlier output is not foreign");
    }

    #[test]
    fn somebody_elses_folder_is_left_alone() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        std::fs::write(folder.path().join("thesis.tex"), "").expect("writable");
        let error = OutputFolder::open(folder.path()).err().expect("refused");
        assert!(matches!(error, EvalError::OutputInUse { .. }));
        assert_eq!(entries(folder.path()), ["thesis.tex"]);
        let file = folder.path().join("thesis.tex");
        assert!(OutputFolder::open(&file).is_err(), "a file is no folder");
    }
}
