//! What can be wrong with a file.

use std::path::{Path, PathBuf};

/// A file that cannot be read as what it should be.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FormatError {
    /// The operating system does not hand it out.
    #[error("{path} cannot be read: {source}. Check that the file is there and readable")]
    Read {
        /// The file or folder.
        path: PathBuf,
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// It does not hold what its format demands.
    #[error("{path} cannot be used: {reason}. {action}")]
    Content {
        /// The file.
        path: PathBuf,
        /// Reason, without a full stop.
        reason: String,
        /// Next action, as a sentence without a full stop.
        action: String,
    },
}

impl FormatError {
    /// A file with the wrong content.
    pub fn content(path: &Path, reason: impl Into<String>, action: impl Into<String>) -> Self {
        Self::Content { path: path.to_path_buf(), reason: reason.into(), action: action.into() }
    }

    /// An image that has not the size of those it belongs to.
    pub fn other_size(path: &Path, found: (usize, usize), expected: (usize, usize)) -> Self {
        let reason = format!(
            "it is {} x {} px, but the images are {} x {} px",
            found.0, found.1, expected.0, expected.1
        );
        Self::content(path, reason, "All must have one size: scale or crop them alike")
    }

    /// Attaches the path to a failed read.
    pub fn read(path: &Path) -> impl FnOnce(std::io::Error) -> Self + '_ {
        move |source| Self::Read { path: path.to_path_buf(), source }
    }
}

/// The text of a file.
///
/// # Errors
/// It cannot be read, or is not UTF-8.
pub fn read_text(path: &Path) -> Result<String, FormatError> {
    std::fs::read_to_string(path).map_err(FormatError::read(path))
}
