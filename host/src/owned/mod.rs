//! Output on disk: the only module that creates output and the only one that removes any.
//!
//! A folder that dynvox makes has a marker, the file [`MARKER_FILE`]: a first line with magic,
//! version and a random id, and below it a ledger with the path of each file and folder that was
//! made in there. The line is written before the file is made. So a folder is dynvox's own by
//! proof, and so is each file in it:
//!
//! - A folder without a marker is never emptied, replaced or removed.
//! - Of a marked folder only files of its ledger are removed. A foreign file, or a link, stays, and
//!   its folder with it.
//! - A file is created, never truncated: what stands in its place must be of the ledger, and is
//!   removed first, so that another name of it (a hard link) keeps its content.
//! - Files below a marked folder are reached from a handle of the folder (`cap-std`), so that a
//!   link on the way does not lead out of it.
//!
//! The lint `disallowed_methods` keeps the removing functions of `std::fs` out of other modules.
#![allow(clippy::disallowed_methods, reason = "the module that creates and removes")]

mod draft;
mod error;
mod file;
mod folder;
mod marker;
mod overlap;
#[cfg(test)]
mod tests;

pub use draft::DraftFolder;
pub use error::NotOwned;
pub use file::{
    create_file, create_folder, create_unnamed, remove_file, remove_folder, remove_own,
    rename_file, replace_whole, write, write_whole,
};
pub use folder::OwnedFolder;
pub use marker::MARKER_FILE;
pub use overlap::{Overlap, check_overlap};

use std::path::{Path, PathBuf};

/// Returns the path of a hidden sibling: `a/b` becomes `a/.b.suffix`. It lies on the same disk, so
/// that renaming is one step.
pub fn sibling(target: &Path, suffix: &str) -> PathBuf {
    let name = target.file_name().unwrap_or_default().to_string_lossy().into_owned();
    target.with_file_name(format!(".{name}.{suffix}"))
}

/// Returns true if something has the path, a link without a target included.
pub fn is_taken(path: &Path) -> bool {
    path.symlink_metadata().is_ok()
}
