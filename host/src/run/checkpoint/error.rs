//! Why a stopped run cannot go on, in sentences. The run's folder stays as it is.

use std::io;
use std::path::PathBuf;

/// Why a stopped run cannot go on.
#[derive(Debug, thiserror::Error)]
pub enum ResumeError {
    /// The machine refuses.
    #[error("{path} cannot be read: {source}. Check the disk and the rights")]
    Read {
        /// The snapshot.
        path: PathBuf,
        /// What the machine says.
        source: io::Error,
    },
    /// Something else is in its place.
    #[error("{path} is not a snapshot of a run. Begin the run again with --overwrite")]
    Foreign {
        /// The file.
        path: PathBuf,
    },
    /// Another dynvox wrote it.
    #[error(
        "{path} is a snapshot of version {found}; this dynvox takes version {taken}. Go on with the dynvox that wrote it, or begin again with --overwrite"
    )]
    Version {
        /// The snapshot.
        path: PathBuf,
        /// Its version.
        found: u32,
        /// The one taken.
        taken: u32,
    },
    /// Another dynvox wrote it that says the same version.
    #[error("{path} was written by another dynvox: {reason}. Go on with that one, or begin the run again with --overwrite")]
    Otherwise {
        /// The snapshot.
        path: PathBuf,
        /// What differs.
        reason: String,
    },
    /// A byte of it changed, or it was cut short.
    #[error("{path} is damaged: its bytes are not those that were written. Begin the run again with --overwrite")]
    Damaged {
        /// The snapshot.
        path: PathBuf,
    },
    /// A setting, or the data set.
    #[error("the run would not be the one that was begun: {differences}. Give it back what it had, or begin it again with --overwrite")]
    Unlike {
        /// Each with what it was and is.
        differences: String,
    },
    /// The command line cannot be kept.
    #[error("{what} is not Unicode, and a snapshot must hold it. Rename it, or go without --snapshot-every")]
    NotUnicode {
        /// The word, as well as it can be shown.
        what: String,
    },
}
