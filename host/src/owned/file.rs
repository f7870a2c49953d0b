//! Files and folders of output. Below a folder with a marker each is entered into its ledger.

use super::error::NotOwned;
use super::marker::{Marker, open_folder};
use super::{is_taken, sibling};
use cap_std::ambient_authority;
use cap_std::fs::{Dir, OpenOptions};
use std::fs::File;
use std::io::{self, BufWriter, ErrorKind, Write};
use std::path::{Component, Path, PathBuf};

/// A location of output: a folder, and the path below it.
struct Location {
    folder: Dir,
    /// Path below the folder, with `/`.
    below: String,
    /// True if the folder has a marker.
    marked: bool,
}

impl Location {
    /// The location of a path: below the nearest folder above it with a marker, or else below its
    /// parent.
    fn of(path: &Path) -> io::Result<Self> {
        let path = std::path::absolute(path)?;
        let Some(parent) = path.parent() else { return Err(ErrorKind::InvalidInput.into()) };
        // The nearest one, since run folders may lie in a fleet's folder.
        match parent.ancestors().find(|folder| Marker::is_in(folder)) {
            Some(home) => {
                let below = named(path.strip_prefix(home).map_err(io::Error::other)?)?;
                let folder = open_folder(home)?.ok_or(ErrorKind::NotADirectory)?;
                Ok(Self { folder, below, marked: true })
            }
            None => {
                let below = named(Path::new(path.file_name().unwrap_or_default()))?;
                let folder = Dir::open_ambient_dir(parent, ambient_authority())?;
                Ok(Self { folder, below, marked: false })
            }
        }
    }

    /// Returns true if dynvox made what is at the location. Nothing there is an error.
    fn is_own(&self) -> io::Result<bool> {
        let found = self.folder.symlink_metadata(&self.below)?;
        let marker = if self.marked { Marker::read(&self.folder)? } else { None };
        Ok(marker.is_some_and(|marker| {
            found.is_file() && marker.files.contains(&self.below)
                || found.is_dir() && marker.folders.contains(&self.below)
        }))
    }

    /// Returns true if the location is free, false if something of dynvox's own is there.
    fn is_free(&self, path: &Path) -> io::Result<bool> {
        match self.is_own() {
            Ok(true) => Ok(false),
            Ok(false) => {
                Err(NotOwned::foreign(path, "its folder's marker does not list it").into())
            }
            Err(error) if error.kind() == ErrorKind::NotFound => Ok(true),
            Err(error) => Err(error),
        }
    }

    fn enter(&self, ending: &str) -> io::Result<()> {
        if self.marked {
            Marker::enter(&self.folder, &format!("{}{ending}", self.below))
        } else {
            Ok(())
        }
    }
}

/// A path below a folder as the ledger has it.
fn named(path: &Path) -> io::Result<String> {
    let refused = || io::Error::new(ErrorKind::InvalidInput, "its name cannot be written down");
    let mut names = Vec::new();
    for component in path.components() {
        let Component::Normal(name) = component else { return Err(refused()) };
        let name = name.to_str().filter(|name| !name.contains('\n')).ok_or_else(refused)?;
        names.push(name);
    }
    if names.is_empty() { Err(refused()) } else { Ok(names.join("/")) }
}

/// Creates a file for reading and writing. A file of dynvox's own that is there is removed first.
///
/// # Errors
/// Something else is there, a link included, or the disk refuses.
pub fn create_file(path: &Path) -> io::Result<File> {
    let location = Location::of(path)?;
    if location.is_free(path)? {
        location.enter("")?;
    } else {
        location.folder.remove_file(&location.below)?;
    }
    let options = OpenOptions::new().read(true).write(true).create_new(true).clone();
    location.folder.open_with(&location.below, &options).map(cap_std::fs::File::into_std)
}

/// Creates a file for reading and writing next to `path` that has no name any more, so that it is
/// gone with its process.
///
/// # Errors
/// The disk refuses.
pub fn create_unnamed(path: &Path) -> io::Result<File> {
    let name = free_draft(path)?;
    let file = create_file(&name)?;
    // Created above by this process.
    std::fs::remove_file(&name)?;
    Ok(file)
}

/// Creates a file with a content.
///
/// # Errors
/// Something else is there, or the disk refuses.
pub fn write(path: &Path, bytes: &[u8]) -> io::Result<()> {
    create_file(path)?.write_all(bytes)
}

/// Creates a folder and those above it. One that is there is used.
///
/// # Errors
/// A file or a link is there, or the disk refuses.
pub fn create_folder(path: &Path) -> io::Result<()> {
    match path.symlink_metadata() {
        Ok(found) if found.is_dir() => return Ok(()),
        Ok(_) => return Err(NotOwned::foreign(path, "it is a link or a file, not a folder").into()),
        Err(_) => {}
    }
    if let Some(parent) = path.parent().filter(|parent| !parent.as_os_str().is_empty())
        && !parent.is_dir()
    {
        create_folder(parent)?;
    }
    let location = Location::of(path)?;
    location.enter("/")?;
    match location.folder.create_dir(&location.below) {
        // Another thread was faster.
        Err(error) if error.kind() == ErrorKind::AlreadyExists => Ok(()),
        made => made,
    }
}

/// Removes a file that dynvox made.
///
/// # Errors
/// No file is there, dynvox did not make it, or the disk refuses.
pub fn remove_file(path: &Path) -> io::Result<()> {
    let location = Location::of(path)?;
    if location.is_free(path)? {
        return Err(ErrorKind::NotFound.into());
    }
    location.folder.remove_file(&location.below)
}

/// Removes a file if dynvox made it; a foreign one stays.
///
/// # Errors
/// The disk refuses.
pub fn remove_own(path: &Path) -> io::Result<()> {
    match remove_file(path) {
        Err(error) if matches!(error.kind(), ErrorKind::AlreadyExists | ErrorKind::NotFound) => {
            Ok(())
        }
        removed => removed,
    }
}

/// Removes a folder that dynvox made below one with a marker, if it is empty. Otherwise it stays.
///
/// # Errors
/// The disk refuses.
pub fn remove_folder(path: &Path) -> io::Result<()> {
    let location = Location::of(path)?;
    match location.is_own() {
        Ok(true) => {}
        Ok(false) => return Ok(()),
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(()),
        Err(error) => return Err(error),
    }
    match location.folder.remove_dir(&location.below) {
        Err(error) if error.kind() == ErrorKind::DirectoryNotEmpty => Ok(()),
        removed => removed,
    }
}

/// Renames a file within a folder with a marker. A file of dynvox's own at `to` is replaced.
///
/// # Errors
/// Something else is at `to`, dynvox did not make what is at `from`, or the disk refuses.
pub fn rename_file(from: &Path, to: &Path) -> io::Result<()> {
    let (source, target) = (Location::of(from)?, Location::of(to)?);
    if source.is_free(from)? {
        return Err(ErrorKind::NotFound.into());
    }
    if target.is_free(to)? {
        target.enter("")?;
    }
    source.folder.rename(&source.below, &target.folder, &target.below)
}

/// Writes a file atomically: under another name first, renamed when it is synced to the disk.
/// Nothing foreign is replaced.
///
/// # Errors
/// Something else is there, or the disk refuses. Nothing half-written stays behind.
pub fn write_whole(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>,
) -> io::Result<()> {
    let location = Location::of(path)?;
    let free = location.is_free(path)?;
    with_draft(path, write, |draft| {
        // In a folder of ours the ledger has refused foreign files before; elsewhere only a free
        // name is taken.
        if location.marked {
            rename_file(draft, path)
        } else if free {
            publish(draft, path)
        } else {
            Err(ErrorKind::AlreadyExists.into())
        }
    })
}

/// Writes a file that a user named to be replaced, atomically.
///
/// # Errors
/// A link or a folder is there, or the disk refuses. Nothing half-written stays behind.
pub fn replace_whole(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>,
) -> io::Result<()> {
    if path.symlink_metadata().is_ok_and(|found| !found.is_file()) {
        return Err(NotOwned::foreign(path, "it is a link or a folder, not a file").into());
    }
    if Location::of(path)?.marked {
        return write_whole(path, write);
    }
    with_draft(path, write, |draft| std::fs::rename(draft, path))
}

/// Writes a draft of a file next to it, and hands it over; it is removed on failure.
fn with_draft(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>,
    finish: impl FnOnce(&Path) -> io::Result<()>,
) -> io::Result<()> {
    let draft = free_draft(path)?;
    let mut file = BufWriter::new(create_file(&draft)?);
    let written =
        write(&mut file).and_then(|()| file.into_inner()?.sync_all()).and_then(|()| finish(&draft));
    if written.is_err() {
        // Created above by this process, and the disk has failed already.
        let _ = std::fs::remove_file(&draft);
    }
    written
}

/// The draft's path: always the same one below a marker, where the next draft replaces it, and
/// elsewhere one that is free.
fn free_draft(path: &Path) -> io::Result<PathBuf> {
    let first = sibling(path, "partial");
    if Location::of(path)?.marked || !is_taken(&first) {
        return Ok(first);
    }
    let numbered = (2u32..100).map(|number| sibling(path, &format!("partial-{number}")));
    numbered.into_iter().find(|path| !is_taken(path)).ok_or_else(|| ErrorKind::AlreadyExists.into())
}

/// Gives a draft its name if that is still free.
fn publish(draft: &Path, path: &Path) -> io::Result<()> {
    match std::fs::hard_link(draft, path) {
        Ok(()) => std::fs::remove_file(draft),
        Err(error) if error.kind() == ErrorKind::AlreadyExists => Err(error),
        // A file system without hard links.
        Err(_) if !is_taken(path) => std::fs::rename(draft, path),
        Err(_) => Err(ErrorKind::AlreadyExists.into()),
    }
}
