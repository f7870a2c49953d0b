//! Reasons why a folder is left alone, in sentences.

use std::io;
use std::path::{Path, PathBuf};

/// Reason why a folder cannot be taken as dynvox's own.
#[derive(Debug, thiserror::Error)]
pub enum NotOwned {
    /// No proof that dynvox made it.
    #[error(
        "{path} is not known to be made by dynvox: {reason}. It is left alone; move it, or remove \
         it yourself if you do not need it"
    )]
    Foreign {
        /// The file or folder.
        path: PathBuf,
        /// Fact that is against it.
        reason: &'static str,
    },
    /// Another process has it.
    #[error("another process is writing to {path}. Wait for it, or give another folder")]
    InUse {
        /// The folder.
        path: PathBuf,
    },
    /// The system refuses.
    #[error("{path} cannot be read or written: {source}. Check the disk and the permissions")]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// The system's error.
        source: io::Error,
    },
}

impl NotOwned {
    /// An error of the system at a path.
    pub(super) fn io(path: &Path) -> impl FnOnce(io::Error) -> Self {
        let path = path.to_path_buf();
        move |source| Self::Io { path, source }
    }

    /// A file or folder that dynvox did not make.
    pub(super) fn foreign(path: &Path, reason: &'static str) -> Self {
        Self::Foreign { path: path.to_path_buf(), reason }
    }
}

impl From<NotOwned> for io::Error {
    fn from(error: NotOwned) -> Self {
        match error {
            NotOwned::Io { source, .. } => source,
            NotOwned::Foreign { .. } => Self::new(io::ErrorKind::AlreadyExists, error),
            NotOwned::InUse { .. } => Self::new(io::ErrorKind::ResourceBusy, error),
        }
    }
}
