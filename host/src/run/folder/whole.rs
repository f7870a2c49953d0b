//! Files that appear under their names when they are complete.

use super::FolderError;
use crate::owned;
use std::fs::File;
use std::io::{BufWriter, Result};
use std::path::Path;

/// Writes a file atomically. Nothing foreign is replaced.
///
/// # Errors
/// Something else is there, or the disk refuses.
pub fn write_whole(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<File>) -> Result<()>,
) -> std::result::Result<(), FolderError> {
    let path_of_error = path.to_path_buf();
    owned::write_whole(path, write)
        .map_err(|source| FolderError::Write { path: path_of_error, source })
}

/// Writes a file that a user named to be replaced, atomically.
///
/// # Errors
/// A link or a folder is there, or the disk refuses.
pub fn replace_whole(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<File>) -> Result<()>,
) -> std::result::Result<(), FolderError> {
    let path_of_error = path.to_path_buf();
    owned::replace_whole(path, write)
        .map_err(|source| FolderError::Write { path: path_of_error, source })
}
