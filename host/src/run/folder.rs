//! The run folder: written under another name next to its target, and renamed when its run has
//! ended. A snapshot in it, of a run that was killed or ended early, is what resumes the run.

mod error;
mod reserve;
mod target;
#[cfg(test)]
mod tests;
mod whole;

pub use error::FolderError;
pub use target::{PREVIOUS_SNAPSHOT_FILE, SNAPSHOT_FILE, has_snapshot};
pub use whole::{replace_whole, write_whole};

use crate::formats::{FRAMES_FILE, SUMMARY_FILE};
use crate::owned::{self, NotOwned, OwnedFolder, is_taken, sibling};
use reserve::Reserve;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use target::{check_target, move_away, recover, remove_condemned, resolved, take_target};

/// A folder under construction, locked against other runs. Unless [`RunFolder::commit`] is reached
/// or there is a snapshot, nothing of it remains.
#[derive(Debug)]
pub struct RunFolder {
    target: PathBuf,
    partial: OwnedFolder,
    overwrite: bool,
    /// True if the folder stays when this is dropped.
    keep: bool,
    /// True if the folder belongs to a run that ended early; it goes back to its target unless the
    /// run ends anew.
    reopened: bool,
    reserve: Reserve,
}

impl RunFolder {
    /// Begins a folder that will become `target`.
    ///
    /// # Errors
    /// The target is taken or cannot be replaced, another run writes to it, or the disk refuses.
    pub fn begin(target: &Path, overwrite: bool) -> Result<Self, FolderError> {
        let target = resolved(target)?;
        recover(&target);
        check_target(&target, overwrite)?;
        let path = sibling(&target, "partial");
        let partial = OwnedFolder::open_or_create(&path).map_err(in_the_way(&target))?;
        if has_snapshot(&path) && !overwrite {
            return Err(FolderError::Interrupted { path: target });
        }
        // Results of a run that could not move them, or was killed before it did.
        if path.join(FRAMES_FILE).is_file() && !Reserve::is_held(&path) && !overwrite {
            return Err(FolderError::Unmoved { partial: path, path: target });
        }
        if let Some(file) = partial.foreign_entry().map_err(in_the_way(&target))? {
            return Err(FolderError::ForeignFile { path, file });
        }
        let reserve = Reserve::default();
        let mut folder = Self { partial, overwrite, keep: false, reopened: false, target, reserve };
        folder.partial.clear().map_err(in_the_way(&folder.target))?;
        remove_condemned(&folder.target);
        folder.try_rename()?;
        folder.reserve = Reserve::take(folder.path())?;
        Ok(folder)
    }

    /// The folder of an interrupted run to `target` that left a snapshot. An incomplete snapshot
    /// next to it is removed.
    ///
    /// # Errors
    /// There is no such run, or another process resumes it.
    pub fn reopen(target: &Path) -> Result<Self, FolderError> {
        let target = resolved(target)?;
        recover(&target);
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
        let mut owned = OwnedFolder::open(if killed { &partial } else { &target })
            .map_err(in_the_way(&target))?;
        if ended_early {
            owned.rename(&partial).map_err(fixed(&target))?;
        }
        let mut folder = Self {
            target,
            partial: owned,
            overwrite: false,
            keep: false,
            reopened: ended_early,
            reserve: Reserve::default(),
        };
        folder.reserve = Reserve::take(folder.path())?;
        match owned::remove_file(&sibling(&folder.snapshot(), "partial")) {
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

    /// Gives the disk space back that was kept for rows and tables.
    pub fn release_reserve(&self) {
        self.reserve.release(self.path());
    }

    /// Gives the disk space back that was kept for the summary, which is written last.
    pub fn release_last_reserve(&self) {
        Reserve::release_last(self.path());
    }

    /// Lets the folder stay where it is when this is dropped.
    pub fn keep(&mut self) {
        self.keep = true;
    }

    /// Tries the renaming of the end with what is at the target now.
    fn try_rename(&self) -> Result<(), FolderError> {
        let Some(mut old) = take_target(&self.target)? else { return Ok(()) };
        move_away(&mut old, &self.target)
            .and_then(|()| old.rename(&self.target))
            .map_err(fixed(&self.target))
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
        has_snapshot(self.path())
    }

    /// Returns the path that the finished run will have.
    pub fn target(&self) -> &Path {
        &self.target
    }

    /// The next free folder `parent/name-NNN`.
    pub fn next_name(parent: &Path, name: &str) -> PathBuf {
        let taken = |path: &PathBuf| is_taken(path) || is_taken(&sibling(path, "partial"));
        (1u32..)
            .map(|number| parent.join(format!("{name}-{number:03}")))
            .find(|path| !taken(path))
            .unwrap_or_else(|| parent.join(name))
    }

    /// Returns the path of the folder while the run lasts.
    pub fn path(&self) -> &Path {
        self.partial.path()
    }

    /// Returns the path of a file of that name in the partial folder.
    pub fn file(&self, name: &str) -> PathBuf {
        self.path().join(name)
    }

    /// Creates a file and hands a buffered writer to `write`. What cannot be written leaves no
    /// file.
    pub fn write(
        &self,
        name: &str,
        write: impl FnOnce(&mut std::io::BufWriter<std::fs::File>) -> std::io::Result<()>,
    ) -> Result<(), FolderError> {
        let path = self.file(name);
        let made = owned::create_file(&path).map(std::io::BufWriter::new).and_then(|mut file| {
            write(&mut file)?;
            std::io::Write::flush(&mut file)
        });
        made.map_err(|source| {
            // It may not exist.
            let _ = owned::remove_file(&path);
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
        self.release_last_reserve();
        let (partial, target) = (self.path().to_path_buf(), self.target.clone());
        let not_moved = |reason: String| FolderError::NotMoved {
            partial: partial.clone(),
            path: target.clone(),
            reason,
        };
        check_target(&target, self.overwrite).map_err(|error| not_moved(error.to_string()))?;
        let mut old = take_target(&target).map_err(|error| not_moved(error.to_string()))?;
        if let Some(old) = &mut old {
            move_away(old, &target).map_err(|error| not_moved(error.to_string()))?;
        }
        if let Err(error) = self.partial.rename(&target) {
            if let Some(mut old) = old {
                // Should this fail as well, the next run finds the earlier results.
                let _ = old.rename(&target);
            }
            return Err(not_moved(error.to_string()));
        }
        if let Some(mut old) = old {
            let path = old.path().to_path_buf();
            target::condemn(&mut old, &target)
                .map_err(|source| FolderError::Write { path, source: source.into() })?;
        }
        for name in temporary {
            let path = target.join(name);
            match owned::remove_file(&path) {
                Err(source) if source.kind() != ErrorKind::NotFound => {
                    return Err(FolderError::Write { path, source });
                }
                _ => {}
            }
        }
        Ok(target)
    }
}

impl Drop for RunFolder {
    fn drop(&mut self) {
        if self.keep {
            return;
        }
        // A failure here changes nothing: the run has failed already.
        if !self.has_snapshot() {
            let _ = self.partial.remove();
            return;
        }
        self.release_reserve();
        self.release_last_reserve();
        if self.reopened {
            let _ = self.partial.rename(&self.target);
        }
    }
}

/// The error of a partial folder that cannot be used.
fn in_the_way(target: &Path) -> impl FnOnce(NotOwned) -> FolderError {
    let target = target.to_path_buf();
    move |error| match error {
        NotOwned::InUse { .. } => FolderError::InUse { path: target },
        NotOwned::Foreign { path, reason } => {
            FolderError::InTheWay { partial: path, path: target, reason }
        }
        NotOwned::Io { path, source } => FolderError::Write { path, source },
    }
}

/// The error of a target that cannot be renamed.
fn fixed(target: &Path) -> impl FnOnce(NotOwned) -> FolderError {
    let path = target.to_path_buf();
    move |error| FolderError::Fixed { path, source: error.into() }
}
