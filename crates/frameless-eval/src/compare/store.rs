//! Finished cells on disk: found again by everything that determines them.

use std::io::Write;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use crate::error::EvalError;
use crate::output::folder_in;
use crate::results::RunResult;

/// Everything that determines the outcome of some work, as lines of text.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub(crate) struct Key(String);

impl Key {
    /// The key of work described by `text`.
    pub(crate) fn new(text: String) -> Key {
        Key(text)
    }

    /// A file name: 128 bits are enough for no two keys ever to share one.
    fn file_name(&self) -> String {
        hex(&Sha256::digest(&self.0)[..16])
    }
}

/// Bytes in hexadecimal digits.
pub(crate) fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// The folder of finished cells.
pub(crate) struct Store {
    folder: PathBuf,
}

#[derive(Deserialize, Serialize)]
struct StoredRun {
    /// [`Key`], for people who wonder what a file is.
    key: String,
    result: RunResult,
}

impl Store {
    pub(crate) fn new(folder: PathBuf) -> Store {
        Store { folder }
    }

    /// The outcome of an earlier run. A file that cannot be read or does not say what it should counts as none: the run is
    /// made again and the file replaced.
    pub(crate) fn run(&self, key: &Key) -> Option<RunResult> {
        let text = std::fs::read_to_string(self.run_path(key)).ok()?;
        let stored: StoredRun = serde_json::from_str(&text).ok()?;
        (stored.key == key.0).then_some(stored.result)
    }

    /// Whether there is an outcome of an earlier run.
    pub(crate) fn has_run(&self, key: &Key) -> bool {
        self.run(key).is_some()
    }

    /// Keeps the outcome of a run. The file appears whole.
    pub(crate) fn keep_run(&self, key: &Key, result: &RunResult) -> Result<(), EvalError> {
        let stored = StoredRun { key: key.0.clone(), result: result.clone() };
        let json = serde_json::to_string(&stored).expect("plain data");
        write_whole(&self.run_path(key), json.as_bytes())
    }

    /// The folder with the pictures made for `key`, if they have been made.
    pub(crate) fn pictures(&self, key: &Key) -> Option<PathBuf> {
        Some(self.pictures_path(key)).filter(|path| path.is_dir())
    }

    /// Lets `make` fill a folder, and keeps it under `key`.
    pub(crate) fn keep_pictures(
        &self,
        key: &Key,
        make: impl FnOnce(&Path) -> Result<(), EvalError>,
    ) -> Result<PathBuf, EvalError> {
        let partial = folder_in(&self.folder, ".partial-")?;
        make(partial.path())?;
        let path = self.pictures_path(key);
        match std::fs::rename(partial.path(), &path) {
            // Another comparison into the same folder was faster: the same key, the same pictures.
            Err(_) if path.is_dir() => Ok(path),
            outcome => outcome.map(|()| path.clone()).map_err(|e| EvalError::unwritable(&path, e)),
        }
    }

    fn run_path(&self, key: &Key) -> PathBuf {
        self.folder.join(key.file_name() + ".json")
    }

    fn pictures_path(&self, key: &Key) -> PathBuf {
        self.folder.join(key.file_name())
    }
}

/// A file that is never seen half-written.
fn write_whole(path: &Path, bytes: &[u8]) -> Result<(), EvalError> {
    let unwritable = |e: std::io::Error| EvalError::unwritable(path, e);
    let folder = path.parent().expect("a file lies in a folder");
    let mut builder = tempfile::Builder::new();
    builder.prefix(".partial-");
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    let mut file = builder.tempfile_in(folder).map_err(unwritable)?;
    file.write_all(bytes).map_err(unwritable)?;
    file.persist(path).map_err(|e| unwritable(e.error))?;
    Ok(())
}
