//! Files of the run folder that grow frame by frame, so that a long run keeps no rows in memory. A
//! checkpoint has the length and the checksum of each; a resumed run truncates what was written
//! after it.

use super::ObserveError;
use crate::formats::checksum_of;
use crate::owned;
use serde::{Deserialize, Serialize};
use std::fs::File;
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};

/// Bytes that are written at once.
const WRITE_BYTES: usize = 16 << 10;

/// A file that grows with the run. What the disk refuses stays in memory and is tried again with
/// the next write.
#[derive(Debug, Serialize, Deserialize)]
pub struct GrowingFile {
    name: String,
    bytes: u64,
    /// CRC-32 of these bytes.
    checksum: u32,
    /// The last of them, not yet written.
    #[serde(skip)]
    pending: Vec<u8>,
    #[serde(skip)]
    file: Option<File>,
}

impl GrowingFile {
    /// A file of the run folder that does not exist yet.
    pub fn new(name: &str) -> Self {
        Self { name: name.to_owned(), bytes: 0, checksum: 0, pending: Vec::new(), file: None }
    }

    /// Returns the name of the file.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Returns true if nothing was appended yet.
    pub fn is_empty(&self) -> bool {
        self.bytes == 0
    }

    /// Appends bytes, in memory at first.
    pub fn append(&mut self, bytes: &[u8]) {
        let mut checksum = crc32fast::Hasher::new_with_initial(self.checksum);
        checksum.update(bytes);
        self.checksum = checksum.finalize();
        self.bytes += bytes.len() as u64;
        self.pending.extend_from_slice(bytes);
    }

    /// Writes what was appended once it is worth a write.
    ///
    /// # Errors
    /// The disk refuses.
    pub fn write_due(&mut self, folder: &Path) -> Result<(), ObserveError> {
        if self.pending.len() < WRITE_BYTES { Ok(()) } else { self.write(folder) }
    }

    /// Writes all that was appended and waits until it is on the disk.
    ///
    /// # Errors
    /// The disk refuses.
    pub fn sync(&mut self, folder: &Path) -> Result<(), ObserveError> {
        self.write(folder)?;
        let path = self.path(folder);
        self.file
            .as_ref()
            .map_or(Ok(()), File::sync_data)
            .map_err(|source| ObserveError::Write { path, source })
    }

    /// Brings the file back to its state at the checkpoint.
    ///
    /// # Errors
    /// The file is missing, or not as the run left it.
    pub fn resume(&mut self, folder: &Path) -> Result<(), ObserveError> {
        let path = self.path(folder);
        let failed = |source| ObserveError::Write { path: path.clone(), source };
        let changed = |reason: String| ObserveError::Changed { path: path.clone(), reason };
        let file = match File::options().read(true).append(true).open(&path) {
            Ok(file) => file,
            Err(error) if error.kind() == ErrorKind::NotFound => {
                return Err(changed("it is missing".to_owned()));
            }
            Err(source) => return Err(failed(source)),
        };
        // Only the part written before the checkpoint has to be as it was.
        if checksum_of(&file, self.bytes).map_err(failed)? != Some(self.checksum) {
            return Err(changed(format!(
                "its first {} bytes are truncated or changed",
                self.bytes
            )));
        }
        // Rows after the checkpoint are cut off: the frames will be mapped again.
        file.set_len(self.bytes).map_err(failed)?;
        self.file = Some(file);
        Ok(())
    }

    /// Returns the path of the file in a run folder.
    pub fn path(&self, folder: &Path) -> PathBuf {
        folder.join(&self.name)
    }

    fn write(&mut self, folder: &Path) -> Result<(), ObserveError> {
        let path = self.path(folder);
        let failed = |source| ObserveError::Write { path: path.clone(), source };
        if self.file.is_none() {
            self.file = Some(owned::create_file(&path).map_err(failed)?);
        }
        let Some(file) = &mut self.file else { return Ok(()) };
        // By hand, since after a failure `pending` must hold exactly what is not yet written.
        while !self.pending.is_empty() {
            match file.write(&self.pending) {
                Ok(0) => return Err(failed(ErrorKind::WriteZero.into())),
                Ok(written) => drop(self.pending.drain(..written)),
                // A signal came: the write is repeated.
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(source) => return Err(failed(source)),
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn saved(file: &GrowingFile) -> GrowingFile {
        let mut bytes = Vec::new();
        ciborium::into_writer(file, &mut bytes).unwrap();
        ciborium::from_reader(&bytes[..]).unwrap()
    }

    #[test]
    fn a_resumed_file_ends_where_its_checkpoint_did_and_grows_on() {
        let folder = tempfile::TempDir::new().unwrap();
        let path = folder.path().join("rows.csv");
        let mut file = GrowingFile::new("rows.csv");
        file.append(b"a\n");
        file.write_due(folder.path()).unwrap();
        // Few bytes wait for more, and `sync` does not.
        assert!(!path.exists(), "two bytes are not worth a write");
        file.sync(folder.path()).unwrap();
        let checkpoint = saved(&file);
        file.append(&[b'x'; WRITE_BYTES]);
        file.write_due(folder.path()).unwrap();
        assert_eq!(std::fs::metadata(&path).unwrap().len(), 2 + WRITE_BYTES as u64);
        // What was written after the checkpoint is cut off.
        let mut again = saved(&checkpoint);
        again.resume(folder.path()).unwrap();
        again.append(b"b\n");
        again.sync(folder.path()).unwrap();
        assert_eq!(std::fs::read(&path).unwrap(), b"a\nb\n");
        for (bytes, reason) in
            [(&b"A\nb\n"[..], "truncated or changed"), (b"a", "truncated or changed")]
        {
            std::fs::write(&path, bytes).unwrap();
            assert!(
                saved(&checkpoint).resume(folder.path()).unwrap_err().to_string().contains(reason)
            );
        }
        std::fs::remove_file(&path).unwrap();
        assert!(
            saved(&checkpoint)
                .resume(folder.path())
                .unwrap_err()
                .to_string()
                .contains("it is missing")
        );
    }

    #[test]
    fn what_a_disk_refuses_is_written_later() {
        let folder = tempfile::TempDir::new().unwrap();
        // A folder that is not there stands for a disk that refuses.
        let missing = folder.path().join("below");
        let mut file = GrowingFile::new("rows.csv");
        file.append(b"a\n");
        assert!(matches!(file.sync(&missing), Err(ObserveError::Write { .. })));
        std::fs::create_dir(&missing).unwrap();
        file.append(b"b\n");
        file.sync(&missing).unwrap();
        // Nothing is lost, and nothing is there twice.
        assert_eq!(std::fs::read(missing.join("rows.csv")).unwrap(), b"a\nb\n");
    }
}
