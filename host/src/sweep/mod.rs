//! Many runs with one thing varied, and one page that shows them beside the original's numbers: the paper's tables and figures.
//!
//! A [`Plan`] lists the points of each sweep and the runs they need; points that mean the same run share it. Each finished run leaves one
//! file, `runs/KEY.json`, written at once: a sweep that was interrupted goes on with the runs that have none. `plan.json` says what the folder is
//! for; parts made on several machines are put together when their plans are the same, and told apart when their results are not.

mod draw;
mod page;
mod plan;
mod published;
mod result;
mod store;
mod table;
#[cfg(test)]
mod tests;

pub use plan::{Data, Kind, Plan, Point, Wanted};
pub use result::{FrameSample, RunResult};
pub use store::{Results, SweepFolder, merge};

use crate::run::FolderError;
use std::path::PathBuf;

/// Why a sweep cannot go on.
#[derive(Debug, thiserror::Error)]
pub enum SweepError {
    /// A file cannot be read.
    #[error("{path} cannot be read: {source}. Check that it is there and readable")]
    Read {
        /// The file.
        path: PathBuf,
        /// What the machine says.
        source: std::io::Error,
    },
    /// A file cannot be written.
    #[error(transparent)]
    Write(#[from] FolderError),
    /// A file holds something else.
    #[error("{path} is no file of a sweep: {reason}. Remove it, or give another --out")]
    Foreign {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        reason: String,
    },
    /// The folder belongs to another sweep.
    #[error("{path} belongs to a sweep of other runs. Repeat that one's arguments to go on with it, or give another --out")]
    Other {
        /// The folder's plan.
        path: PathBuf,
    },
    /// Two machines disagree.
    #[error(
        "{path} has another result of run {run} than the folders before it: {ours} against {theirs}. The same run gives the same digest everywhere: compare versions, data and paths of --depth"
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
