//! A folder that appears under its name when it is complete.

use std::io;
use std::path::{Path, PathBuf};

/// A sibling of the folder that is asked for, which goes when it is dropped, unless it was renamed.
pub struct DraftFolder(PathBuf);

impl DraftFolder {
    /// The draft of `folder`. Nothing is made yet.
    pub fn of(folder: &Path) -> Self {
        let name = folder.file_name().unwrap_or_default().to_string_lossy();
        Self(folder.with_file_name(format!(".{name}.partial-{}", std::process::id())))
    }

    /// Returns the path at which the draft is written.
    pub fn path(&self) -> &Path {
        &self.0
    }

    /// Gives it the name that was asked for.
    ///
    /// # Errors
    /// The system's, of renaming; the draft is removed.
    pub fn rename(self, folder: &Path) -> io::Result<()> {
        std::fs::rename(&self.0, folder)
    }
}

impl Drop for DraftFolder {
    fn drop(&mut self) {
        // Gone already when all went well.
        let _ = std::fs::remove_dir_all(&self.0);
    }
}
