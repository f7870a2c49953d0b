//! The run folder: written under another name next to its target, and renamed when it is complete. One that holds a snapshot stays there
//! when its run ends early, so that the run can be resumed.

#[cfg(test)]
mod tests;

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
    /// An interrupted run has a snapshot there.
    #[error("an interrupted run to {path} has a snapshot. Resume it with `dynvox run --resume {path}`, or start again with --overwrite")]
    Interrupted {
        /// The folder asked for.
        path: PathBuf,
    },
    /// There is no run to resume.
    #[error("no run to {path} can be resumed: {reason}")]
    NothingToResume {
        /// The folder asked for.
        path: PathBuf,
        /// Why, and what to do.
        reason: &'static str,
    },
    /// The machine refuses.
    #[error("{path} cannot be written: {source}. Check the disk and the permissions, or give another --out")]
    Write {
        /// The file or folder.
        path: PathBuf,
        /// What the machine says.
        source: std::io::Error,
    },
}

/// Name of the snapshot in a folder under construction.
const SNAPSHOT: &str = "run.snapshot";

/// A folder under construction. Unless [`RunFolder::commit`] is reached or there is a snapshot, nothing of it stays.
#[derive(Debug)]
pub struct RunFolder {
    target: PathBuf,
    partial: PathBuf,
    done: bool,
}

impl RunFolder {
    /// Begins a folder that will become `target`.
    pub fn begin(target: &Path, overwrite: bool) -> Result<Self, FolderError> {
        check_target(target, overwrite)?;
        let partial = beside(target, "partial");
        if partial.join(SNAPSHOT).is_file() && !overwrite {
            return Err(FolderError::Interrupted { path: target.to_path_buf() });
        }
        let failed = |source| FolderError::Write { path: partial.clone(), source };
        if partial.exists() {
            std::fs::remove_dir_all(&partial).map_err(failed)?;
        }
        std::fs::create_dir_all(&partial).map_err(failed)?;
        Ok(Self { target: target.to_path_buf(), partial, done: false })
    }

    /// The folder of an interrupted run to `target` that left a snapshot. An incomplete snapshot next to it is removed.
    pub fn reopen(target: &Path) -> Result<Self, FolderError> {
        let partial = beside(target, "partial");
        let nothing = |reason| FolderError::NothingToResume { path: target.to_path_buf(), reason };
        if !partial.join(SNAPSHOT).is_file() {
            return Err(nothing(match (partial.is_dir(), target.join("summary.json").is_file()) {
                (true, _) => "it was interrupted before its first snapshot. Start it again",
                (false, true) => "it is complete",
                (false, false) => "there is no such run. Give the --out of the interrupted run",
            }));
        }
        let folder = Self { target: target.to_path_buf(), partial, done: false };
        match std::fs::remove_file(beside(&folder.snapshot(), "partial")) {
            Err(source) if source.kind() != std::io::ErrorKind::NotFound => Err(FolderError::Write { path: folder.snapshot(), source }),
            _ => Ok(folder),
        }
    }

    /// Refuses a target that is taken.
    ///
    /// # Errors
    /// It exists and may not be replaced.
    pub fn check_target(&self, overwrite: bool) -> Result<(), FolderError> {
        check_target(&self.target, overwrite)
    }

    /// Where the snapshot is, or will be.
    pub fn snapshot(&self) -> PathBuf {
        self.file(SNAPSHOT)
    }

    /// Where it will be.
    pub fn target(&self) -> &Path {
        &self.target
    }

    /// The next free folder `parent/name-NNN`.
    pub fn next_name(parent: &Path, name: &str) -> PathBuf {
        let taken = |path: &PathBuf| path.exists() || beside(path, "partial").exists();
        (1u32..).map(|number| parent.join(format!("{name}-{number:03}"))).find(|path| !taken(path)).unwrap_or_else(|| parent.join(name))
    }

    /// Where it is while the run lasts.
    pub fn path(&self) -> &Path {
        &self.partial
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

    /// Renames the folder to its target, which is returned. Snapshot and temporary files are removed only then, so that a run killed in its
    /// last moment can still be resumed.
    pub fn commit(mut self, temporary: &[&str]) -> Result<PathBuf, FolderError> {
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
        for name in temporary.iter().chain([&SNAPSHOT]) {
            let path = self.target.join(name);
            match std::fs::remove_file(&path) {
                Err(source) if source.kind() != std::io::ErrorKind::NotFound => return Err(FolderError::Write { path, source }),
                _ => {}
            }
        }
        Ok(self.target.clone())
    }
}

impl Drop for RunFolder {
    fn drop(&mut self) {
        if !self.done && !self.snapshot().is_file() {
            // A failure here changes nothing: the run has failed already.
            let _ = std::fs::remove_dir_all(&self.partial);
        }
    }
}

/// Refuses a target that is taken.
fn check_target(target: &Path, overwrite: bool) -> Result<(), FolderError> {
    let empty = !target.exists() || target.read_dir().is_ok_and(|mut entries| entries.next().is_none());
    match (overwrite || empty, empty || target.join("summary.json").is_file()) {
        (true, true) => Ok(()),
        (true, false) => Err(FolderError::Foreign { path: target.to_path_buf() }),
        (false, _) => Err(FolderError::Exists { path: target.to_path_buf() }),
    }
}

/// `a/b` becomes `a/.b.suffix`: on the same disk, so that renaming is one step.
fn beside(target: &Path, suffix: &str) -> PathBuf {
    let name = target.file_name().unwrap_or_default().to_string_lossy().into_owned();
    target.with_file_name(format!(".{name}.{suffix}"))
}

/// Writes a file atomically: under another name first, renamed when it is synced to the disk.
pub fn write_whole(
    path: &Path,
    write: impl FnOnce(&mut std::io::BufWriter<std::fs::File>) -> std::io::Result<()>,
) -> Result<(), FolderError> {
    let draft = beside(path, "partial");
    let written = std::fs::File::create(&draft).map(std::io::BufWriter::new).and_then(|mut file| {
        write(&mut file)?;
        file.into_inner()?.sync_all()?;
        std::fs::rename(&draft, path)
    });
    written.map_err(|source| {
        // The draft may not exist.
        let _ = std::fs::remove_file(&draft);
        FolderError::Write { path: path.to_path_buf(), source }
    })
}
