//! Folders that a run saves one file a frame to, next to its own.

use crate::run::{FolderError, RunFolder};
use anyhow::bail;
use std::path::{Path, PathBuf};

/// A folder that takes its name when the run is complete, if it was asked for.
pub struct Saved(Option<RunFolder>);

impl Saved {
    /// Begins the folder that `option` names.
    pub fn begin(target: Option<&Path>, option: &str) -> anyhow::Result<Self> {
        let Some(target) = target else { return Ok(Self(None)) };
        if target.exists() {
            bail!("{} exists. Give another {option}, or remove it", target.display());
        }
        Ok(Self(Some(RunFolder::begin(target, false)?)))
    }

    /// Where files go.
    pub fn path(&self) -> Option<PathBuf> {
        self.0.as_ref().map(|folder| folder.path().to_path_buf())
    }

    /// Gives the folder its name.
    pub fn commit(self) -> Result<(), FolderError> {
        self.0.map_or(Ok(()), |folder| folder.commit(&[]).map(|_| ()))
    }
}
