//! An output folder that appears whole or not at all.

use std::path::{Path, PathBuf};

use tempfile::TempDir;

use crate::error::EvalError;

/// A hidden folder beside the wanted one, renamed to it at the end; removed if that never comes.
pub(crate) struct OutputFolder {
    wanted: PathBuf,
    partial: TempDir,
}

impl OutputFolder {
    /// # Errors
    /// If `wanted` exists and is something other than an earlier output, or the place is not writable.
    pub(crate) fn create(wanted: &Path) -> Result<OutputFolder, EvalError> {
        let is_empty = || wanted.read_dir().is_ok_and(|mut entries| entries.next().is_none());
        if wanted.exists() && !wanted.join("results.json").is_file() && !is_empty() {
            return Err(EvalError::OutputInUse { path: wanted.to_path_buf() });
        }
        let parent = match wanted.parent() {
            Some(parent) if !parent.as_os_str().is_empty() => parent,
            _ => Path::new("."),
        };
        let unwritable = |e| EvalError::unwritable(wanted, e);
        std::fs::create_dir_all(parent).map_err(unwritable)?;
        let mut builder = tempfile::Builder::new();
        builder.prefix(".frameless-partial-");
        // Temporary folders are private unless told otherwise; this one is going to be the output.
        #[cfg(unix)]
        builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o777));
        let partial = builder.tempdir_in(parent).map_err(unwritable)?;
        Ok(OutputFolder { wanted: wanted.to_path_buf(), partial })
    }

    /// Where to write.
    pub(crate) fn path(&self) -> &Path {
        self.partial.path()
    }

    /// Everything has been written: let the folder appear.
    pub(crate) fn publish(self) -> Result<(), EvalError> {
        let unwritable = |e: std::io::Error| EvalError::unwritable(&self.wanted, e);
        if self.wanted.exists() {
            // The old output is moved away first, so that at no time a mixture of both is there.
            let old = self.partial.path().with_extension("old");
            std::fs::rename(&self.wanted, &old).map_err(unwritable)?;
            std::fs::rename(self.partial.path(), &self.wanted).map_err(unwritable)?;
            return std::fs::remove_dir_all(&old).map_err(unwritable);
        }
        std::fs::rename(self.partial.path(), &self.wanted).map_err(unwritable)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn appears_whole_or_not_at_all() {
        let parent = tempfile::tempdir().expect("a temporary folder");
        let wanted = parent.path().join("out");
        let write = |text: &str| {
            let folder = OutputFolder::create(&wanted).expect("writable");
            std::fs::write(folder.path().join("results.json"), text).expect("writable");
            folder
        };
        drop(write("unfinished"));
        assert_eq!(
            parent.path().read_dir().expect("readable").count(),
            0,
            "something was left behind"
        );
        write("first").publish().expect("published");
        write("second").publish().expect("replaced");
        let text = std::fs::read_to_string(wanted.join("results.json")).expect("readable");
        assert_eq!(text, "second");
        assert_eq!(
            parent.path().read_dir().expect("readable").count(),
            1,
            "something was left behind"
        );
    }

    #[test]
    fn somebody_elses_folder_is_left_alone() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        std::fs::write(folder.path().join("thesis.tex"), "").expect("writable");
        let error = OutputFolder::create(folder.path()).err().expect("refused");
        assert!(matches!(error, EvalError::OutputInUse { .. }));
    }
}
