//! Files that the run wrote once: a resumed run refuses to go on without them.

use super::ObserveError;
use crate::formats::checksum_of;
use serde::{Deserialize, Serialize};
use std::fs::File;
use std::io::ErrorKind;
use std::path::Path;

/// A file below the run folder as it was written.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct WrittenFile {
    /// Path of the file below the run folder.
    name: String,
    bytes: u64,
    /// CRC-32 of these bytes.
    checksum: u32,
}

impl WrittenFile {
    /// The file as it is now, once it is on the disk.
    ///
    /// # Errors
    /// The file cannot be read, or the disk refuses.
    pub fn synced(folder: &Path, name: String) -> Result<Self, ObserveError> {
        let path = folder.join(&name);
        let known = File::open(&path).and_then(|file| {
            // On the disk before its checksum is noted: a snapshot relies on it.
            file.sync_all()?;
            let bytes = file.metadata()?.len();
            // A file that shrinks meanwhile has no checksum of that length.
            Ok((bytes, checksum_of(&file, bytes)?.ok_or(ErrorKind::UnexpectedEof)?))
        });
        let (bytes, checksum) = known.map_err(|source| ObserveError::Write { path, source })?;
        Ok(Self { name, bytes, checksum })
    }

    /// Checks that the file is unchanged.
    ///
    /// # Errors
    /// The file is missing, or a byte of it has changed.
    pub fn check(&self, folder: &Path) -> Result<(), ObserveError> {
        let path = folder.join(&self.name);
        let changed =
            |reason: &str| ObserveError::Changed { path: path.clone(), reason: reason.to_owned() };
        let failed = |source| ObserveError::Write { path: path.clone(), source };
        let file = match File::open(&path) {
            Ok(file) => file,
            Err(error) if error.kind() == ErrorKind::NotFound => {
                return Err(changed("it is missing"));
            }
            Err(source) => return Err(failed(source)),
        };
        // The length first: a checksum takes reading the whole file.
        let as_long = file.metadata().map_err(failed)?.len() == self.bytes;
        if !as_long || checksum_of(&file, self.bytes).map_err(failed)? != Some(self.checksum) {
            return Err(changed("it is truncated or changed"));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_that_was_lost_or_changed_is_refused_by_name() {
        let folder = tempfile::TempDir::new().unwrap();
        let path = folder.path().join("7.ply");
        std::fs::write(&path, b"ply\n").unwrap();
        let written = WrittenFile::synced(folder.path(), "7.ply".to_owned()).unwrap();
        assert!(written.check(folder.path()).is_ok());
        // A byte missing, one changed, and one too many.
        for bytes in [&b"ply"[..], b"plx\n", b"ply\n1"] {
            std::fs::write(&path, bytes).unwrap();
            let refused = written.check(folder.path()).unwrap_err().to_string();
            assert!(
                refused.contains("7.ply is not as the run left it: it is truncated or changed"),
                "{refused}"
            );
        }
        std::fs::remove_file(&path).unwrap();
        assert!(written.check(folder.path()).unwrap_err().to_string().contains("it is missing"));
        assert!(matches!(
            WrittenFile::synced(folder.path(), "7.ply".to_owned()),
            Err(ObserveError::Write { .. })
        ));
    }
}
