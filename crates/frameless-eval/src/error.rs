//! What can go wrong with an experiment.

use std::path::{Path, PathBuf};

use frameless::EngineError;
use frameless_scene::LoadError;
use thiserror::Error;

/// An experiment that could not be read, run or written.
#[derive(Debug, Error)]
pub enum EvalError {
    /// The experiment file could not be read.
    #[error("{}: {source}", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// The experiment file is not what it should be.
    #[error("{}: {message}", path.display())]
    Invalid {
        /// The file.
        path: PathBuf,
        /// What was wanted, what came, and where.
        message: String,
    },
    /// A scene file could not be loaded.
    #[error(transparent)]
    Scene(#[from] LoadError),
    /// An event speaks of something that the scene does not have.
    #[error("scene {scene:?}: {message}")]
    Script {
        /// The scene's name in the experiment.
        scene: String,
        /// Which event, and what is there instead.
        message: String,
    },
    /// The output folder exists and holds something else.
    #[error(
        "{}: the folder exists and holds no results.json; choose another --out, or empty it",
        path.display()
    )]
    OutputInUse {
        /// The folder.
        path: PathBuf,
    },
    /// The output could not be written.
    #[error("{}: {message}", path.display())]
    Unwritable {
        /// The file or folder.
        path: PathBuf,
        /// What failed.
        message: String,
    },
    /// The renderer's answer could not be used.
    #[error(transparent)]
    Engine(#[from] EngineError),
    /// The user has asked to stop, within a run.
    #[error("interrupted")]
    Interrupted,
    /// The user has asked to stop; what was finished is kept.
    #[error(
        "interrupted: {kept} of {wanted} runs are finished and kept in {}; the same command again goes on from there",
        out.display()
    )]
    Unfinished {
        /// Runs that need not be made again.
        kept: usize,
        /// Runs of the experiment.
        wanted: usize,
        /// The output folder.
        out: PathBuf,
    },
}

impl EvalError {
    /// Whether the user's input is to blame rather than the program or the machine.
    pub fn is_bad_input(&self) -> bool {
        use EvalError::{Invalid, OutputInUse, Scene, Script, Unreadable};
        matches!(
            self,
            Unreadable { .. } | Invalid { .. } | Scene(_) | Script { .. } | OutputInUse { .. }
        )
    }

    pub(crate) fn unwritable(path: &Path, cause: impl std::fmt::Display) -> EvalError {
        EvalError::Unwritable { path: path.to_path_buf(), message: cause.to_string() }
    }
}
