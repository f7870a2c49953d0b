//! Folders that a run saves one file a frame to, next to its own.

use super::{FolderError, RunError, RunFolder};
use std::path::{Path, PathBuf};

/// A folder that takes its name when the run is complete, if it was asked for.
pub(super) struct Saved(Option<RunFolder>);

impl Saved {
    /// Begins the folder that `option` names.
    ///
    /// # Errors
    /// It exists, or the disk refuses.
    pub fn begin(target: Option<&Path>, option: &'static str) -> Result<Self, RunError> {
        let Some(target) = target else { return Ok(Self(None)) };
        if target.exists() {
            return Err(RunError::SavedExists { path: target.to_path_buf(), option });
        }
        Ok(Self(Some(RunFolder::begin(target, false)?)))
    }

    /// Path that files are written to.
    pub fn path(&self) -> Option<PathBuf> {
        self.0.as_ref().map(|folder| folder.path().to_path_buf())
    }

    /// Gives the folder its name.
    ///
    /// # Errors
    /// It cannot be renamed.
    pub fn commit(self) -> Result<(), FolderError> {
        self.0.map_or(Ok(()), |folder| folder.commit(&[]).map(|_| ()))
    }
}
