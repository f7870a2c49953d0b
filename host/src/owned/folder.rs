//! A folder with a marker, locked by the process that writes to it.

use super::error::NotOwned;
use super::marker::{MARKER_FILE, Marker, open_folder};
use cap_std::fs::Dir;
use std::fs::{File, TryLockError};
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};

/// A folder that dynvox made, by proof of its marker.
#[derive(Debug)]
pub struct OwnedFolder {
    path: PathBuf,
    id: String,
    /// Locked while this exists, so that the folder of a dead process is told from a living one's;
    /// `None` where the system cannot lock a folder.
    _lock: Option<File>,
}

impl OwnedFolder {
    /// Makes a folder with its marker, and the folders above it. An empty folder that is there
    /// already becomes this one.
    ///
    /// # Errors
    /// Something else is there, another process has it, or the disk refuses.
    pub fn create(path: &Path) -> Result<Self, NotOwned> {
        if let Some(parent) = path.parent() {
            std::fs::create_dir_all(parent).map_err(NotOwned::io(parent))?;
        }
        let is_new = match std::fs::create_dir(path) {
            Err(error) if error.kind() == ErrorKind::AlreadyExists => false,
            made => made.map(|()| true).map_err(NotOwned::io(path))?,
        };
        let folder = real_folder(path)?;
        let lock = lock(path)?;
        let mut entries = folder.entries().map_err(NotOwned::io(path))?;
        if entries.next().is_some() {
            return Err(NotOwned::foreign(path, "it is not empty and has no marker"));
        }
        let id = Marker::create(&folder).map_err(|error| {
            if is_new {
                // Removed only if it is still empty.
                let _ = std::fs::remove_dir(path);
            }
            NotOwned::io(path)(error)
        })?;
        Ok(Self { path: path.to_path_buf(), id, _lock: lock })
    }

    /// Takes a folder that has a marker.
    ///
    /// # Errors
    /// It is a link, has no marker, or another process has it.
    pub fn open(path: &Path) -> Result<Self, NotOwned> {
        let folder = real_folder(path)?;
        let lock = lock(path)?;
        let marker = Marker::read(&folder).map_err(NotOwned::io(path))?;
        let marker = marker.ok_or_else(|| {
            NotOwned::foreign(path, "it has no marker (.dynvox), as folders of earlier versions")
        })?;
        Ok(Self { path: path.to_path_buf(), id: marker.id, _lock: lock })
    }

    /// Takes a folder that has a marker, or makes one.
    ///
    /// # Errors
    /// Something else is there, another process has it, or the disk refuses.
    pub fn open_or_create(path: &Path) -> Result<Self, NotOwned> {
        if Marker::is_in(path) { Self::open(path) } else { Self::create(path) }
    }

    /// Returns the path of the folder.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Opens the folder, if it is still the one of this marker.
    fn read(&self) -> Result<(Dir, Marker), NotOwned> {
        let folder = real_folder(&self.path)?;
        match Marker::read(&folder).map_err(NotOwned::io(&self.path))? {
            Some(marker) if marker.id == self.id => Ok((folder, marker)),
            _ => Err(NotOwned::foreign(&self.path, "another folder took its place")),
        }
    }

    /// Returns the first file, folder or link in there that dynvox did not make.
    ///
    /// # Errors
    /// The folder is no longer this one, or cannot be read.
    pub fn foreign_entry(&self) -> Result<Option<PathBuf>, NotOwned> {
        let (folder, marker) = self.read()?;
        foreign_below(&folder, "", &marker)
            .map(|found| found.map(|name| self.path.join(name)))
            .map_err(NotOwned::io(&self.path))
    }

    /// Removes all that dynvox made in there, and the ledger's lines. What is foreign stays.
    ///
    /// # Errors
    /// The folder is no longer this one, or the disk refuses.
    pub fn clear(&mut self) -> Result<(), NotOwned> {
        let (folder, marker) = self.read()?;
        let failed = |source| NotOwned::Io { path: self.path.clone(), source };
        remove_entries(&folder, &marker).map_err(failed)?;
        folder.remove_file(MARKER_FILE).map_err(failed)?;
        self.id = Marker::create(&folder).map_err(failed)?;
        Ok(())
    }

    /// Removes the folder with all that dynvox made in there. What is foreign stays, and the folder
    /// with it.
    ///
    /// # Errors
    /// A foreign file stays, the folder is no longer this one, or the disk refuses.
    pub fn remove(&self) -> Result<(), NotOwned> {
        let (folder, marker) = self.read()?;
        remove_entries(&folder, &marker).map_err(NotOwned::io(&self.path))?;
        if let Some(path) = self.foreign_entry()? {
            return Err(NotOwned::Foreign { path, reason: "it is not of the folder's ledger" });
        }
        folder.remove_file(MARKER_FILE).map_err(NotOwned::io(&self.path))?;
        std::fs::remove_dir(&self.path).map_err(NotOwned::io(&self.path))
    }

    /// Removes the marker: from here on the folder is the user's.
    ///
    /// # Errors
    /// The folder is no longer this one, or the disk refuses.
    pub fn give_away(self) -> Result<(), NotOwned> {
        let (folder, _) = self.read()?;
        folder.remove_file(MARKER_FILE).map_err(NotOwned::io(&self.path))
    }

    /// Renames the folder. Nothing is replaced but an empty folder.
    ///
    /// # Errors
    /// The folder is no longer this one, or the system refuses.
    pub fn rename(&mut self, to: &Path) -> Result<(), NotOwned> {
        self.read()?;
        std::fs::rename(&self.path, to).map_err(NotOwned::io(to))?;
        self.path = to.to_path_buf();
        Ok(())
    }
}

/// Opens a folder that is no link.
fn real_folder(path: &Path) -> Result<Dir, NotOwned> {
    open_folder(path)
        .map_err(NotOwned::io(path))?
        .ok_or_else(|| NotOwned::foreign(path, "it is a link or a file, not a folder"))
}

/// Locks a folder; the lock ends with the process. Systems that cannot lock a folder have no lock.
fn lock(path: &Path) -> Result<Option<File>, NotOwned> {
    let in_use = || NotOwned::InUse { path: path.to_path_buf() };
    let Ok(folder) = File::open(path) else { return Ok(None) };
    match folder.try_lock() {
        Err(TryLockError::WouldBlock) => Err(in_use()),
        Err(TryLockError::Error(_)) => Ok(None),
        // Another process may have renamed it in the meantime.
        Ok(()) if !path.is_dir() => Err(in_use()),
        Ok(()) => Ok(Some(folder)),
    }
}

/// The first entry below `prefix` that is not in the ledger, as a path below the folder.
fn foreign_below(folder: &Dir, prefix: &str, marker: &Marker) -> io::Result<Option<String>> {
    let entries = if prefix.is_empty() { folder.entries()? } else { folder.read_dir(prefix)? };
    for entry in entries {
        let entry = entry?;
        let name = entry.file_name().to_string_lossy().into_owned();
        let path = if prefix.is_empty() { name } else { format!("{prefix}/{name}") };
        let kind = entry.file_type()?;
        // A link is neither file nor folder here, and so is always foreign.
        let known = path == MARKER_FILE
            || kind.is_file() && marker.files.contains(&path)
            || kind.is_dir() && marker.folders.contains(&path);
        if !known {
            return Ok(Some(path));
        }
        if kind.is_dir()
            && let Some(found) = foreign_below(folder, &path, marker)?
        {
            return Ok(Some(found));
        }
    }
    Ok(None)
}

/// Removes the files of the ledger, and its folders where they are empty then.
fn remove_entries(folder: &Dir, marker: &Marker) -> io::Result<()> {
    let is_real = |path: &&String| folder.symlink_metadata(path).is_ok_and(|found| found.is_dir());
    let real: Vec<&String> = marker.folders.iter().filter(is_real).collect();
    for path in &marker.files {
        let parent = path.rsplit_once('/').map(|(parent, _)| parent);
        let reached = parent.is_none_or(|parent| real.iter().any(|known| *known == parent));
        if reached && folder.symlink_metadata(path).is_ok_and(|found| found.is_file()) {
            folder.remove_file(path)?;
        }
    }
    // Children stand behind their parents.
    for path in real.iter().rev() {
        match folder.remove_dir(path) {
            Err(error) if error.kind() == ErrorKind::DirectoryNotEmpty => {}
            Err(error) if error.kind() == ErrorKind::NotFound => {}
            removed => removed?,
        }
    }
    Ok(())
}
