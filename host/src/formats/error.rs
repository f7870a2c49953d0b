//! What can be wrong with a file.

use super::bounds::{TABLE_TEXT, TextBound, check_bytes, most_text};
use super::text::decoded;
use std::fs::File;
use std::io::{ErrorKind, Read};
use std::path::{Path, PathBuf};

/// Next action for a file beyond its bounds.
const FETCH_ANEW: &str = "Check that it is the right file; write it anew, or split it";

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
    #[error("{path} cannot be used: {reason}{} {action}", stop_after(.reason))]
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

impl From<FormatError> for std::io::Error {
    fn from(error: FormatError) -> Self {
        match error {
            FormatError::Read { source, .. } => source,
            FormatError::Content { reason, .. } => Self::new(ErrorKind::InvalidData, reason),
        }
    }
}

/// Full stop of a sentence, unless it ends in a question.
fn stop_after(sentence: &str) -> &'static str {
    if sentence.ends_with('?') { "" } else { "." }
}

/// The text of a file within the bounds of a table.
///
/// # Errors
/// It cannot be read, is neither UTF-8 nor UTF-16, or is beyond the bounds.
pub fn read_text(path: &Path) -> Result<String, FormatError> {
    read_text_within(path, &TABLE_TEXT)
}

/// The text of a file within bounds. A file that is too long is refused by its length, before it is
/// read; of one without a length, such as a pipe, no more than the bound is read.
///
/// # Errors
/// It cannot be read, is neither UTF-8 nor UTF-16, or is beyond the bounds.
pub fn read_text_within(path: &Path, bound: &TextBound) -> Result<String, FormatError> {
    let refuse = |reason: String| FormatError::content(path, reason, FETCH_ANEW);
    let bytes = read_bytes_within(path, bound.what, bound.bytes)?;
    bound.check_lines(&bytes).map_err(refuse)?;
    decoded(bytes).map_err(|reason| FormatError::content(path, reason, "Save it as text in UTF-8"))
}

/// The bytes of a file that may have `most` of them; `what` names their kind in a message.
///
/// # Errors
/// It cannot be read, or is longer.
pub fn read_bytes_within(path: &Path, what: &str, most: u64) -> Result<Vec<u8>, FormatError> {
    let refuse = |reason: String| FormatError::content(path, reason, FETCH_ANEW);
    let file = File::open(path).map_err(FormatError::read(path))?;
    let len = file.metadata().map_err(FormatError::read(path))?.len();
    check_bytes(what, len, most).map_err(refuse)?;
    let mut bytes = Vec::with_capacity(len as usize);
    file.take(most + 1).read_to_end(&mut bytes).map_err(FormatError::read(path))?;
    if bytes.len() as u64 > most {
        return Err(refuse(format!("it does not end; {}", most_text(what, most))));
    }
    Ok(bytes)
}
