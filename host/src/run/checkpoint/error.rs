//! Why an interrupted run cannot be resumed. The run's folder stays as it is.

use std::io;
use std::path::PathBuf;

/// Reason why an interrupted run cannot be resumed.
#[derive(Debug, thiserror::Error)]
pub enum ResumeError {
    /// The system refuses.
    #[error("{path} cannot be read: {source}. Check the disk and the permissions")]
    Read {
        /// The snapshot.
        path: PathBuf,
        /// The system's error.
        source: io::Error,
    },
    /// Something else is in its place.
    #[error("{path} is not a snapshot of a run. Start the run again with --overwrite")]
    Foreign {
        /// The file.
        path: PathBuf,
    },
    /// Another dynvox wrote it.
    #[error(
        "{path} is a snapshot of version {found}; this dynvox takes version {taken}. Resume with \
         the dynvox that wrote it, or start again with --overwrite"
    )]
    Version {
        /// The snapshot.
        path: PathBuf,
        /// Version of the snapshot.
        found: u32,
        /// The one taken.
        taken: u32,
    },
    /// Another dynvox of the same snapshot version wrote it.
    #[error(
        "{path} was written by another dynvox: {reason}. Resume with that one, or start the run \
         again with --overwrite"
    )]
    Otherwise {
        /// The snapshot.
        path: PathBuf,
        /// Difference, as it completes the message's sentence.
        reason: String,
    },
    /// A byte of it changed, or it was cut short.
    #[error("{path} is damaged: its checksum does not match. Start the run again with --overwrite")]
    Damaged {
        /// The snapshot.
        path: PathBuf,
    },
    /// A setting, or the data set.
    #[error(
        "the resumed run would differ from the interrupted one: {differences}. Restore settings \
         and data, or start it again with --overwrite"
    )]
    Different {
        /// Each with what it was and is.
        differences: String,
    },
    /// The request cannot be stored.
    #[error(
        "a snapshot cannot store what was asked for: {reason}. Rename it, or run without \
         --snapshot-every"
    )]
    NotStorable {
        /// The part, a path that is not Unicode.
        reason: String,
    },
}
