//! Why a run folder cannot be written, in sentences.

use crate::terminal::quoted;
use std::path::PathBuf;

/// Reason why a run folder cannot be written.
#[derive(Debug, thiserror::Error)]
pub enum FolderError {
    /// Something is there already.
    #[error("{path} exists. Give another --out, remove it, or replace it with --overwrite")]
    Exists {
        /// The folder asked for.
        path: PathBuf,
    },
    /// Existing file or folder without the proof that a run made it.
    #[error(
        "{path} is not a run folder: it has no marker (.dynvox; run folders of earlier versions \
         have none), so --overwrite leaves it alone. Remove it yourself, or give another --out"
    )]
    Foreign {
        /// The folder asked for.
        path: PathBuf,
    },
    /// A file in a run folder that no run made.
    #[error(
        "{file} is in the folder {path}, but was not made by dynvox, so the folder is left alone. \
         Move the file elsewhere, or give another --out"
    )]
    ForeignFile {
        /// The run folder.
        path: PathBuf,
        /// The file, folder or link.
        file: PathBuf,
    },
    /// A link at the target.
    #[error("{path} is a link. Give the folder that it leads to as --out, or another")]
    Link {
        /// The folder asked for.
        path: PathBuf,
    },
    /// Something has the name of the partial folder.
    #[error(
        "{partial} is in the way of a run to {path}: {reason}. It is left alone; move it, remove \
         it yourself, or give another --out"
    )]
    InTheWay {
        /// File, folder or link that has the name.
        partial: PathBuf,
        /// The folder asked for.
        path: PathBuf,
        /// Fact that is against it.
        reason: &'static str,
    },
    /// Results of an earlier run were not moved to the target.
    #[error(
        "the results of an earlier run are in {partial}, and were not moved to {path}. Move that \
         folder, or start again with --overwrite"
    )]
    Unmoved {
        /// Folder that holds the results.
        partial: PathBuf,
        /// The folder asked for.
        path: PathBuf,
    },
    /// No disk space for the end of the run.
    #[error(
        "{path} cannot be written: {source}. It keeps disk space for the end of the run. Free disk \
         space and files, or give another --out"
    )]
    NoReserve {
        /// The file.
        path: PathBuf,
        /// The system's error.
        source: std::io::Error,
    },
    /// An interrupted run has a snapshot there.
    #[error(
        "an interrupted run to {path} has a snapshot. Resume it with `dynvox run --resume {quoted}`, \
         or start again with --overwrite",
        quoted = quoted(.path)
    )]
    Interrupted {
        /// The folder asked for.
        path: PathBuf,
    },
    /// There is no run to resume.
    #[error("no run to {path} can be resumed: {reason}")]
    NothingToResume {
        /// The folder asked for.
        path: PathBuf,
        /// Reason, and what to do.
        reason: &'static str,
    },
    /// Another run writes there.
    #[error("another run is writing to {path}. Wait for it, or give another --out")]
    InUse {
        /// The folder asked for.
        path: PathBuf,
    },
    /// It is the current directory.
    #[error("{path} is the current directory, which cannot be replaced. Give another --out")]
    Current {
        /// The folder asked for.
        path: PathBuf,
    },
    /// The finished folder could not be renamed to it.
    #[error(
        "{path} cannot be replaced: {source}. Is it a mount point? Give a folder inside it as --out"
    )]
    Fixed {
        /// The folder asked for.
        path: PathBuf,
        /// The system's error.
        source: std::io::Error,
    },
    /// The results are complete and not where they should be.
    #[error(
        "the results are complete in {partial}, but cannot be moved to {path}: {reason}. Move the \
         folder yourself"
    )]
    NotMoved {
        /// Folder that holds the results.
        partial: PathBuf,
        /// The folder asked for.
        path: PathBuf,
        /// Reason, as it completes the message's sentence.
        reason: String,
    },
    /// The system refuses.
    #[error(
        "{path} cannot be written: {source}. Check the disk and the permissions, or give another \
         --out"
    )]
    Write {
        /// The file or folder.
        path: PathBuf,
        /// The system's error.
        source: std::io::Error,
    },
}
