//! Errors: the reasons why maps cannot be merged.

use super::tile_file::Lattice;
use std::path::{Path, PathBuf};

/// Reason why maps cannot be merged.
#[derive(Debug, thiserror::Error)]
pub enum FleetError {
    /// The system refuses.
    #[error("{path} cannot be read or written: {source}. Check the disk and the permissions")]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// The system's error.
        source: std::io::Error,
    },
    /// A file is not what it should be.
    #[error("{path} {reason}")]
    Content {
        /// The file.
        path: PathBuf,
        /// Reason, and what to do.
        reason: String,
    },
    /// Maps of different voxels.
    #[error(
        "{path} has {found}, the maps before it {expected}. Map all recordings with the same \
         volume.voxel_size_m, volume.truncation_m and colour"
    )]
    OtherLattice {
        /// The file that differs.
        path: PathBuf,
        /// Lattice that was found.
        found: Lattice,
        /// The lattice of those before it.
        expected: Lattice,
    },
    /// Something is there already.
    #[error("{path} exists. Give another --out, or remove it")]
    Exists {
        /// The folder.
        path: PathBuf,
    },
    /// A file of another program.
    #[error(transparent)]
    Format(#[from] crate::formats::FormatError),
    /// A run's blocks.
    #[error(transparent)]
    Store(#[from] crate::run::store::StoreError),
}

impl FleetError {
    /// An error of the system at a path.
    pub(super) fn io(path: &Path) -> impl FnOnce(std::io::Error) -> Self {
        let path = path.to_path_buf();
        move |source| Self::Io { path, source }
    }

    /// A file that is not what it should be.
    pub(super) fn content(path: &Path, reason: impl Into<String>) -> Self {
        Self::Content { path: path.to_path_buf(), reason: reason.into() }
    }
}
