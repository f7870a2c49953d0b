//! The run folder: written under another name next to its target, and renamed when its run has
//! ended. A snapshot in it, of a run that was killed or ended early, is what resumes the run.

mod error;
#[cfg(test)]
mod tests;

pub use error::FolderError;

use crate::formats::SUMMARY_FILE;
use std::fs::{File, TryLockError};
use std::io::ErrorKind;
use std::path::{Component, Path, PathBuf};

/// Name of the snapshot in the folder of a run that can be resumed.
pub const SNAPSHOT_FILE: &str = "run.snapshot";
/// Name of the snapshot before it.
pub const PREVIOUS_SNAPSHOT_FILE: &str = "run.snapshot.previous";
/// Name of a file that keeps disk space for trajectory, rows and summary, should the disk become
/// full during the run.
const RESERVE_FILE: &str = ".reserve";
/// Size of the file, bytes.
const RESERVE_BYTES: usize = 2 << 20;

/// A folder under construction, locked against other runs. Unless [`RunFolder::commit`] is reached
/// or there is a snapshot, nothing of it remains.
#[derive(Debug)]
pub struct RunFolder {
    target: PathBuf,
    partial: PathBuf,
    overwrite: bool,
    /// True if the folder stays when this is dropped.
    keep: bool,
    /// True if the folder belongs to a run that ended early; it goes back to its target unless the
    /// run ends anew.
    reopened: bool,
    /// Locked while this exists; `None` where the system cannot lock a folder.
    _lock: Option<File>,
}

impl RunFolder {
    /// Begins a folder that will become `target`.
    ///
    /// # Errors
    /// The target is taken or cannot be replaced, another run writes to it, or the disk refuses.
    pub fn begin(target: &Path, overwrite: bool) -> Result<Self, FolderError> {
        let target = resolved(target)?;
        check_target(&target, overwrite)?;
        let partial = sibling(&target, "partial");
        let failed = |source| FolderError::Write { path: partial.clone(), source };
        std::fs::create_dir_all(&partial).map_err(failed)?;
        let lock = lock(&partial, &target)?;
        if has_snapshot(&partial) && !overwrite {
            return Err(FolderError::Interrupted { path: target });
        }
        let folder = Self { partial, overwrite, keep: false, reopened: false, _lock: lock, target };
        clear(&folder.partial)?;
        folder.try_rename()?;
        folder.reserve()?;
        Ok(folder)
    }

    /// The folder of an interrupted run to `target` that left a snapshot. An incomplete snapshot
    /// next to it is removed.
    ///
    /// # Errors
    /// There is no such run, or another process resumes it.
    pub fn reopen(target: &Path) -> Result<Self, FolderError> {
        let target = resolved(target)?;
        let partial = sibling(&target, "partial");
        let nothing = |reason| FolderError::NothingToResume { path: target.clone(), reason };
        let killed = has_snapshot(&partial);
        let ended_early = !partial.is_dir() && has_snapshot(&target);
        if !killed && !ended_early {
            return Err(nothing(match (partial.is_dir(), target.join(SUMMARY_FILE).is_file()) {
                (true, _) => "it was interrupted before its first snapshot. Start it again",
                (false, true) => {
                    "it has no snapshot: it is complete, or ran without --snapshot-every"
                }
                (false, false) => "there is no such run. Give the --out of the interrupted run",
            }));
        }
        let lock = lock(if killed { &partial } else { &target }, &target)?;
        if ended_early {
            std::fs::rename(&target, &partial)
                .map_err(|source| FolderError::Fixed { path: target.clone(), source })?;
        }
        let folder = Self {
            target,
            partial,
            overwrite: false,
            keep: false,
            reopened: ended_early,
            _lock: lock,
        };
        folder.reserve()?;
        match std::fs::remove_file(sibling(&folder.snapshot(), "partial")) {
            Err(source) if source.kind() != ErrorKind::NotFound => {
                Err(FolderError::Write { path: folder.snapshot(), source })
            }
            _ => Ok(folder),
        }
    }

    /// Returns true if the results of a reopened run were in place already: it was killed while it
    /// removed what it no longer needed.
    pub fn is_complete(&self) -> bool {
        let summary = std::fs::read(self.file(SUMMARY_FILE)).ok();
        let summary =
            summary.and_then(|bytes| serde_json::from_slice::<serde_json::Value>(&bytes).ok());
        self.reopened
            && summary.is_some_and(|summary| {
                summary.get("incomplete").is_none_or(serde_json::Value::is_null)
            })
    }

    /// Takes disk space for what is written last.
    fn reserve(&self) -> Result<(), FolderError> {
        let path = self.file(RESERVE_FILE);
        std::fs::write(&path, vec![0; RESERVE_BYTES])
            .map_err(|source| FolderError::Write { path, source })
    }

    /// Gives the disk space back that was kept for what is written last.
    pub fn release_reserve(&self) {
        // Without it there is nothing to give back.
        let _ = std::fs::remove_file(self.file(RESERVE_FILE));
    }

    /// Lets the folder stay where it is when this is dropped.
    pub fn keep(&mut self) {
        self.keep = true;
    }

    /// Tries the renaming of the end with what is at the target now.
    fn try_rename(&self) -> Result<(), FolderError> {
        if !self.target.exists() {
            return Ok(());
        }
        let old = unused(&self.target, "replaced");
        let there_and_back =
            std::fs::rename(&self.target, &old).and_then(|()| std::fs::rename(&old, &self.target));
        there_and_back.map_err(|source| FolderError::Fixed { path: self.target.clone(), source })
    }

    /// Decides whether a resumed run may replace its target, and tries it.
    ///
    /// # Errors
    /// The target exists and may not or cannot be replaced.
    pub fn check_target(&mut self, overwrite: bool) -> Result<(), FolderError> {
        self.overwrite = overwrite;
        check_target(&self.target, overwrite)?;
        self.try_rename()
    }

    /// Returns the path of the snapshot, whether or not it exists.
    pub fn snapshot(&self) -> PathBuf {
        self.file(SNAPSHOT_FILE)
    }

    /// Returns true if the folder replaces earlier results.
    pub fn overwrites(&self) -> bool {
        self.overwrite
    }

    /// Returns true if there is a snapshot, or the one before.
    pub fn has_snapshot(&self) -> bool {
        has_snapshot(&self.partial)
    }

    /// Returns the path that the finished run will have.
    pub fn target(&self) -> &Path {
        &self.target
    }

    /// The next free folder `parent/name-NNN`.
    pub fn next_name(parent: &Path, name: &str) -> PathBuf {
        let taken = |path: &PathBuf| path.exists() || sibling(path, "partial").exists();
        (1u32..)
            .map(|number| parent.join(format!("{name}-{number:03}")))
            .find(|path| !taken(path))
            .unwrap_or_else(|| parent.join(name))
    }

    /// Returns the path of the folder while the run lasts.
    pub fn path(&self) -> &Path {
        &self.partial
    }

    /// Returns the path of a file of that name in the partial folder.
    pub fn file(&self, name: &str) -> PathBuf {
        self.partial.join(name)
    }

    /// Creates a file and hands a buffered writer to `write`. What cannot be written leaves no
    /// file.
    pub fn write(
        &self,
        name: &str,
        write: impl FnOnce(&mut std::io::BufWriter<std::fs::File>) -> std::io::Result<()>,
    ) -> Result<(), FolderError> {
        let path = self.file(name);
        let made =
            std::fs::File::create(&path).map(std::io::BufWriter::new).and_then(|mut file| {
                write(&mut file)?;
                std::io::Write::flush(&mut file)
            });
        made.map_err(|source| {
            // It may not exist.
            let _ = std::fs::remove_file(&path);
            FolderError::Write { path, source }
        })
    }

    /// Renames the folder to its target, which is returned. Temporary files, the snapshot among
    /// them, are removed only then, so that a run killed in its last moment can still be resumed.
    ///
    /// # Errors
    /// It cannot be renamed, and stays where it is, complete; or a temporary file cannot be
    /// removed.
    pub fn commit(mut self, temporary: &[&str]) -> Result<PathBuf, FolderError> {
        self.keep = true;
        self.release_reserve();
        let not_moved = |reason: String| FolderError::NotMoved {
            partial: self.partial.clone(),
            path: self.target.clone(),
            reason,
        };
        check_target(&self.target, self.overwrite).map_err(|error| not_moved(error.to_string()))?;
        let old = unused(&self.target, "replaced");
        let replaced = self.target.exists();
        if replaced {
            std::fs::rename(&self.target, &old).map_err(|source| not_moved(source.to_string()))?;
        }
        if let Err(source) = std::fs::rename(&self.partial, &self.target) {
            if replaced {
                // Should this fail as well, the earlier results are in `old`.
                let _ = std::fs::rename(&old, &self.target);
            }
            return Err(not_moved(source.to_string()));
        }
        if replaced {
            std::fs::remove_dir_all(&old)
                .map_err(|source| FolderError::Write { path: old, source })?;
        }
        for name in temporary {
            let path = self.target.join(name);
            match std::fs::remove_file(&path) {
                Err(source) if source.kind() != ErrorKind::NotFound => {
                    return Err(FolderError::Write { path, source });
                }
                _ => {}
            }
        }
        Ok(self.target.clone())
    }
}

impl Drop for RunFolder {
    fn drop(&mut self) {
        if self.keep {
            return;
        }
        // A failure here changes nothing: the run has failed already.
        if !self.has_snapshot() {
            let _ = std::fs::remove_dir_all(&self.partial);
            return;
        }
        self.release_reserve();
        if self.reopened {
            let _ = std::fs::rename(&self.partial, &self.target);
        }
    }
}

/// The target as a path whose last part is a name.
fn resolved(target: &Path) -> Result<PathBuf, FolderError> {
    let failed = |source| FolderError::Write { path: target.to_path_buf(), source };
    let current = std::env::current_dir().map_err(failed)?;
    let named = matches!(target.components().next_back(), Some(Component::Normal(_)));
    let path = if named { target.to_path_buf() } else { target.canonicalize().map_err(failed)? };
    let is_current = path
        .canonicalize()
        .is_ok_and(|path| current.canonicalize().is_ok_and(|current| path == current));
    if is_current || path.file_name().is_none() {
        Err(FolderError::Current { path: target.to_path_buf() })
    } else {
        Ok(path)
    }
}

/// Locks a folder; the lock ends with the process. Systems that cannot lock a folder have no lock.
fn lock(partial: &Path, target: &Path) -> Result<Option<File>, FolderError> {
    let in_use = || FolderError::InUse { path: target.to_path_buf() };
    let Ok(folder) = File::open(partial) else { return Ok(None) };
    match folder.try_lock() {
        Err(TryLockError::WouldBlock) => Err(in_use()),
        Err(TryLockError::Error(_)) => Ok(None),
        // Another run may have renamed it in the meantime.
        Ok(()) if !partial.is_dir() => Err(in_use()),
        Ok(()) => Ok(Some(folder)),
    }
}

/// Removes what an earlier run left.
fn clear(folder: &Path) -> Result<(), FolderError> {
    let failed = |source| FolderError::Write { path: folder.to_path_buf(), source };
    for entry in folder.read_dir().map_err(failed)? {
        let entry = entry.map_err(failed)?;
        let is_dir = entry.file_type().map_err(failed)?.is_dir();
        let removed = if is_dir {
            std::fs::remove_dir_all(entry.path())
        } else {
            std::fs::remove_file(entry.path())
        };
        removed.map_err(failed)?;
    }
    Ok(())
}

/// Returns true if a run left a snapshot in a folder.
pub fn has_snapshot(folder: &Path) -> bool {
    [SNAPSHOT_FILE, PREVIOUS_SNAPSHOT_FILE].iter().any(|name| folder.join(name).is_file())
}

/// Refuses a target that is taken.
fn check_target(target: &Path, overwrite: bool) -> Result<(), FolderError> {
    if !overwrite && has_snapshot(target) {
        return Err(FolderError::Interrupted { path: target.to_path_buf() });
    }
    let empty =
        !target.exists() || target.read_dir().is_ok_and(|mut entries| entries.next().is_none());
    match (overwrite || empty, empty || target.join(SUMMARY_FILE).is_file()) {
        (true, true) => Ok(()),
        (true, false) => Err(FolderError::Foreign { path: target.to_path_buf() }),
        (false, _) => Err(FolderError::Exists { path: target.to_path_buf() }),
    }
}

/// `a/b` becomes `a/.b.suffix`: on the same disk, so that renaming is one step.
fn sibling(target: &Path, suffix: &str) -> PathBuf {
    let name = target.file_name().unwrap_or_default().to_string_lossy().into_owned();
    target.with_file_name(format!(".{name}.{suffix}"))
}

/// The first unused name among `a/.b.suffix`, `a/.b.suffix-2` and so on.
fn unused(target: &Path, suffix: &str) -> PathBuf {
    let first = sibling(target, suffix);
    let numbered = (2u32..).map(|number| sibling(target, &format!("{suffix}-{number}")));
    std::iter::once(first.clone())
        .chain(numbered)
        .find(|path| path.symlink_metadata().is_err())
        .unwrap_or(first)
}

/// Writes a file atomically: under another name first, renamed when it is synced to the disk.
pub fn write_whole(
    path: &Path,
    write: impl FnOnce(&mut std::io::BufWriter<std::fs::File>) -> std::io::Result<()>,
) -> Result<(), FolderError> {
    let draft = sibling(path, "partial");
    let written =
        std::fs::File::create(&draft).map(std::io::BufWriter::new).and_then(|mut file| {
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
