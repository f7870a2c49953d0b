//! The run folder: written beside its place under another name, and put in place when it is whole.

use std::path::{Path, PathBuf};

/// Why a run folder cannot be written.
#[derive(Debug, thiserror::Error)]
pub enum FolderError {
    /// Something is there already.
    #[error("{path} exists. Give another --out, remove it, or replace it with --overwrite")]
    Exists {
        /// The folder asked for.
        path: PathBuf,
    },
    /// What is there is not a run folder.
    #[error("{path} is not a run folder (it holds no summary.json), so --overwrite leaves it alone. Give another --out")]
    Foreign {
        /// The folder asked for.
        path: PathBuf,
    },
    /// The machine refuses.
    #[error("{path} cannot be written: {source}. Check the disk and the rights, or give another --out")]
    Write {
        /// The file or folder.
        path: PathBuf,
        /// What the machine says.
        source: std::io::Error,
    },
}

/// A folder under construction. Unless [`RunFolder::commit`] is reached, nothing of it stays.
#[derive(Debug)]
pub struct RunFolder {
    target: PathBuf,
    partial: PathBuf,
    done: bool,
}

impl RunFolder {
    /// Begins a folder that will stand at `target`.
    pub fn begin(target: &Path, overwrite: bool) -> Result<Self, FolderError> {
        if target.exists() {
            let empty = target.read_dir().is_ok_and(|mut entries| entries.next().is_none());
            match (overwrite || empty, empty || target.join("summary.json").is_file()) {
                (true, true) => {}
                (true, false) => return Err(FolderError::Foreign { path: target.to_path_buf() }),
                (false, _) => return Err(FolderError::Exists { path: target.to_path_buf() }),
            }
        }
        let partial = beside(target, "partial");
        let failed = |source| FolderError::Write { path: partial.clone(), source };
        if partial.exists() {
            std::fs::remove_dir_all(&partial).map_err(failed)?;
        }
        std::fs::create_dir_all(&partial).map_err(failed)?;
        Ok(Self { target: target.to_path_buf(), partial, done: false })
    }

    /// The next free folder `parent/name-NNN`.
    pub fn next_name(parent: &Path, name: &str) -> PathBuf {
        let taken = |path: &PathBuf| path.exists() || beside(path, "partial").exists();
        (1u32..).map(|number| parent.join(format!("{name}-{number:03}"))).find(|path| !taken(path)).unwrap_or_else(|| parent.join(name))
    }

    /// Where to write a file of that name.
    pub fn file(&self, name: &str) -> PathBuf {
        self.partial.join(name)
    }

    /// Creates a file and hands a buffered writer to `write`.
    pub fn write(
        &self,
        name: &str,
        write: impl FnOnce(&mut std::io::BufWriter<std::fs::File>) -> std::io::Result<()>,
    ) -> Result<(), FolderError> {
        let path = self.file(name);
        let made = std::fs::File::create(&path).map(std::io::BufWriter::new).and_then(|mut file| {
            write(&mut file)?;
            std::io::Write::flush(&mut file)
        });
        made.map_err(|source| FolderError::Write { path, source })
    }

    /// Puts the folder in its place and returns where that is.
    pub fn commit(mut self) -> Result<PathBuf, FolderError> {
        let failed = |source| FolderError::Write { path: self.target.clone(), source };
        let old = beside(&self.target, "replaced");
        let replaced = self.target.exists();
        if replaced {
            std::fs::rename(&self.target, &old).map_err(failed)?;
        }
        std::fs::rename(&self.partial, &self.target).map_err(failed)?;
        self.done = true;
        if replaced {
            std::fs::remove_dir_all(&old).map_err(failed)?;
        }
        Ok(self.target.clone())
    }
}

impl Drop for RunFolder {
    fn drop(&mut self) {
        if !self.done {
            // Nothing to be done about a failure here: the run has failed already.
            let _ = std::fs::remove_dir_all(&self.partial);
        }
    }
}

/// `a/b` becomes `a/.b.suffix`: on the same disk, so that renaming is one step.
fn beside(target: &Path, suffix: &str) -> PathBuf {
    let name = target.file_name().unwrap_or_default().to_string_lossy().into_owned();
    target.with_file_name(format!(".{name}.{suffix}"))
}

/// Writes a file as a whole: under another name first, then in its place.
pub fn write_whole(path: &Path, bytes: &[u8]) -> Result<(), FolderError> {
    let failed = |source| FolderError::Write { path: path.to_path_buf(), source };
    let draft = beside(path, "partial");
    let written = std::fs::write(&draft, bytes).and_then(|()| std::fs::rename(&draft, path));
    written.map_err(|source| {
        // The draft may not even be there.
        let _ = std::fs::remove_file(&draft);
        failed(source)
    })
}
