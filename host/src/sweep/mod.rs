//! Many runs with one setting varied, and one page that compares them with the original's numbers:
//! the paper's tables and figures.
//!
//! A [`Plan`] lists the points of each sweep and the runs they need; points with equal requests
//! share a run. Each finished run leaves one file, `runs/KEY.json`, written atomically: an
//! interrupted sweep continues with the missing runs. `plan.json` is the folder's plan; parts made
//! on several machines are merged when their plans are equal, and refused when their results
//! differ.

mod figures;
mod page;
mod plan;
mod published;
mod result;
mod store;
mod table;
#[cfg(test)]
mod tests;

pub use plan::{Data, Kind, Plan, Point, SweepRequest};
pub use result::{FrameSample, RunResult};
pub use store::{Results, SweepFolder, merge};

use crate::run::FolderError;
use std::path::PathBuf;

/// Reason why a sweep cannot continue.
#[derive(Debug, thiserror::Error)]
pub enum SweepError {
    /// A file cannot be read.
    #[error("{path} cannot be read: {source}. Check that it is there and readable")]
    Read {
        /// The file.
        path: PathBuf,
        /// The system's error.
        source: std::io::Error,
    },
    /// A file cannot be written.
    #[error(transparent)]
    Write(#[from] FolderError),
    /// A file is not of a sweep.
    #[error("{path} is not a file of a sweep: {reason}. Remove it, or give another --out")]
    Foreign {
        /// The file.
        path: PathBuf,
        /// Reason, as it completes the message's sentence.
        reason: String,
    },
    /// The folder belongs to another sweep.
    #[error(
        "{path} belongs to another sweep. Repeat its arguments to continue it, or give another \
         --out"
    )]
    Other {
        /// The folder's plan.
        path: PathBuf,
    },
    /// Two machines disagree.
    #[error(
        "{path}: run {run} has digest {theirs}, but {ours} in an earlier folder. Equal runs give \
         equal digests: compare versions, data and paths of --depth"
    )]
    Differs {
        /// The folder.
        path: PathBuf,
        /// Key of the run.
        run: String,
        /// Digest found before.
        ours: String,
        /// Digest found here.
        theirs: String,
    },
}
