//! The path that a run folder takes in the end, and what may stand there.
//!
//! An earlier run is moved to `.NAME.replaced` while the new one takes its place, then to
//! `.NAME.removed`, and is removed. A process killed in between leaves one of them: the first goes
//! back if the target is missing, the second is removed by the next run.

use super::FolderError;
use crate::owned::{NotOwned, OwnedFolder, is_taken, sibling};
use std::path::{Component, Path, PathBuf};

/// Name of the snapshot in the folder of a run that can be resumed.
pub const SNAPSHOT_FILE: &str = "run.snapshot";
/// Name of the snapshot before it.
pub const PREVIOUS_SNAPSHOT_FILE: &str = "run.snapshot.previous";
/// Suffix of earlier results while their place is taken.
const REPLACED: &str = "replaced";
/// Suffix of earlier results whose place is taken.
const REMOVED: &str = "removed";

/// Returns true if a run left a snapshot in a folder.
pub fn has_snapshot(folder: &Path) -> bool {
    [SNAPSHOT_FILE, PREVIOUS_SNAPSHOT_FILE].iter().any(|name| folder.join(name).is_file())
}

/// The target as a path whose last part is a name.
pub(super) fn resolved(target: &Path) -> Result<PathBuf, FolderError> {
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

/// Refuses a target that is taken, or that `--overwrite` may not replace.
pub(super) fn check_target(target: &Path, overwrite: bool) -> Result<(), FolderError> {
    let path = target.to_path_buf();
    let Ok(found) = target.symlink_metadata() else { return Ok(()) };
    if found.is_symlink() {
        return Err(FolderError::Link { path });
    }
    let empty = target.read_dir().is_ok_and(|mut entries| entries.next().is_none());
    match (overwrite, empty) {
        (_, true) => Ok(()),
        (false, _) if has_snapshot(target) => Err(FolderError::Interrupted { path }),
        (false, _) => Err(FolderError::Exists { path }),
        (true, _) => take_target(target).map(drop),
    }
}

/// Takes the earlier run at a target; `None` where there is nothing, or an empty folder.
///
/// # Errors
/// Something foreign is there, or in there; or another process writes to it.
pub(super) fn take_target(target: &Path) -> Result<Option<OwnedFolder>, FolderError> {
    let path = target.to_path_buf();
    let is_empty = || target.read_dir().is_ok_and(|mut entries| entries.next().is_none());
    if !is_taken(target) || is_empty() {
        return Ok(None);
    }
    let refused = |error| match error {
        NotOwned::Foreign { .. } => FolderError::Foreign { path: path.clone() },
        NotOwned::InUse { .. } => FolderError::InUse { path: path.clone() },
        NotOwned::Io { path, source } => FolderError::Write { path, source },
    };
    let old = OwnedFolder::open(target).map_err(refused)?;
    match old.foreign_entry().map_err(refused)? {
        Some(file) => Err(FolderError::ForeignFile { path, file }),
        None => Ok(Some(old)),
    }
}

/// Moves the earlier run away from its target.
pub(super) fn move_away(old: &mut OwnedFolder, target: &Path) -> Result<(), NotOwned> {
    old.rename(&unused(target, REPLACED))
}

/// Removes an earlier run that was moved away, now that its place is taken.
pub(super) fn condemn(old: &mut OwnedFolder, target: &Path) -> Result<(), NotOwned> {
    old.rename(&unused(target, REMOVED))?;
    old.remove()
}

/// Moves the earlier run back that a killed process had moved away.
pub(super) fn recover(target: &Path) {
    if !is_taken(target)
        && let Ok(mut old) = OwnedFolder::open(&sibling(target, REPLACED))
    {
        // It stays where it is otherwise.
        let _ = old.rename(target);
    }
}

/// Removes an earlier run that a killed process was removing.
pub(super) fn remove_condemned(target: &Path) {
    if let Ok(old) = OwnedFolder::open(&sibling(target, REMOVED)) {
        // It stays where it is otherwise.
        let _ = old.remove();
    }
}

/// The first unused name among `a/.b.suffix`, `a/.b.suffix-2` and so on.
fn unused(target: &Path, suffix: &str) -> PathBuf {
    let first = sibling(target, suffix);
    let numbered = (2u32..).map(|number| sibling(target, &format!("{suffix}-{number}")));
    std::iter::once(first.clone()).chain(numbered).find(|path| !is_taken(path)).unwrap_or(first)
}
