//! Space kept for what is written last, should disk or descriptors run out during the run.
//!
//! Two files hold it on disk: one for rows, trajectories and tables, one for the summary. Each comes
//! with empty files, which hold entries of the file system: a disk can run out of those first.

use super::FolderError;
use crate::owned;
use std::fs::File;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

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
/// Descriptors: what is open at once while the results are written.
const DESCRIPTORS: usize = 8;

/// The reserve of a folder.
#[derive(Debug, Default)]
pub(super) struct Reserve {
    descriptors: Mutex<Vec<File>>,
}

impl Reserve {
    /// Takes disk space, files and descriptors.
    ///
    /// # Errors
    /// The system has not even these.
    pub fn take(folder: &Path) -> Result<Self, FolderError> {
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
        let path = folder.join(LAST_FILE);
        let descriptors = (0..DESCRIPTORS).map(|_| File::open(&path)).collect::<Result<_, _>>();
        let descriptors = descriptors.map_err(|source| FolderError::NoReserve { path, source })?;
        Ok(Self { descriptors: Mutex::new(descriptors) })
    }

    /// Returns true if a folder's run has not come to its end: its reserve is held.
    pub fn is_held(folder: &Path) -> bool {
        folder.join(LAST_FILE).is_file()
    }

    /// Gives back what rows, trajectories and tables need.
    pub fn release(&self, folder: &Path) {
        self.descriptors.lock().unwrap_or_else(PoisonError::into_inner).clear();
        remove(folder, RESERVE_FILE, RESERVE_FILES);
    }

    /// Gives back what the summary needs.
    pub fn release_last(folder: &Path) {
        remove(folder, LAST_FILE, LAST_FILES);
    }
}

fn numbered(folder: &Path, name: &str, number: usize) -> PathBuf {
    folder.join(format!("{name}-{number}"))
}

/// Removes a reserve. Without one there is nothing to give back.
fn remove(folder: &Path, name: &str, files: usize) {
    let _ = owned::remove_file(&folder.join(name));
    (0..files).for_each(|number| drop(owned::remove_file(&numbered(folder, name, number))));
}
