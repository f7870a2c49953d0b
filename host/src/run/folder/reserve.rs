//! Disk space kept for what is written last, should the disk become full during the run.
//!
//! Two files hold it: one for rows, trajectories and tables, one for the summary. Each comes with
//! empty files, which hold entries of the file system: a disk can run out of those first.

use super::FolderError;
use crate::owned;
use std::path::Path;

/// Name of the file for rows, trajectories and tables.
const RESERVE_FILE: &str = ".reserve";
/// Size of this file, bytes.
const RESERVE_BYTES: usize = 2 << 20;
/// Empty files next to it: a file for each table, and what holds the map.
const RESERVE_FILES: usize = 16;
/// Name of the file for the summary.
const LAST_FILE: &str = ".reserve-last";
/// Size of this file, bytes.
const LAST_BYTES: usize = 256 << 10;
/// Empty files next to it.
const LAST_FILES: usize = 2;

/// The reserve of a folder.
pub(super) struct Reserve;

impl Reserve {
    /// Takes the disk space and the files.
    ///
    /// # Errors
    /// The disk has not even these.
    pub fn take(folder: &Path) -> Result<(), FolderError> {
        for (name, bytes, files) in
            [(RESERVE_FILE, RESERVE_BYTES, RESERVE_FILES), (LAST_FILE, LAST_BYTES, LAST_FILES)]
        {
            let path = folder.join(name);
            owned::write(&path, &vec![0; bytes])
                .and_then(|()| {
                    (0..files)
                        .try_for_each(|number| owned::write(&numbered(folder, name, number), &[]))
                })
                .map_err(|source| FolderError::NoReserve { path, source })?;
        }
        Ok(())
    }

    /// Gives back what rows, trajectories and tables need.
    pub fn release(folder: &Path) {
        remove(folder, RESERVE_FILE, RESERVE_FILES);
    }

    /// Gives back what the summary needs.
    pub fn release_last(folder: &Path) {
        remove(folder, LAST_FILE, LAST_FILES);
    }
}

fn numbered(folder: &Path, name: &str, number: usize) -> std::path::PathBuf {
    folder.join(format!("{name}-{number}"))
}

/// Removes a reserve. Without one there is nothing to give back.
fn remove(folder: &Path, name: &str, files: usize) {
    let _ = owned::remove_file(&folder.join(name));
    (0..files).for_each(|number| drop(owned::remove_file(&numbered(folder, name, number))));
}
