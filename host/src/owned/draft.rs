//! A folder that appears under its name when it is complete.

use super::error::NotOwned;
use super::folder::OwnedFolder;
use super::marker::Marker;
use std::io;
use std::path::Path;

/// A sibling of the folder that is asked for, which is removed when this is dropped, unless it was
/// renamed.
#[derive(Debug)]
pub struct DraftFolder(Option<OwnedFolder>);

impl DraftFolder {
    /// Makes the draft of `folder`. Drafts of it that dead processes left are removed.
    ///
    /// # Errors
    /// The disk refuses.
    pub fn begin(folder: &Path) -> io::Result<Self> {
        remove_dead(folder);
        let name = folder.file_name().unwrap_or_default().to_string_lossy();
        let process = std::process::id();
        let numbered =
            |number: u32| folder.with_file_name(format!(".{name}.partial-{process}-{number}"));
        // A name in use is that of another draft of this process, or not ours: the next one is
        // tried.
        for draft in (1u32..1000).map(numbered) {
            match OwnedFolder::create(&draft) {
                Ok(made) => return Ok(Self(Some(made))),
                Err(NotOwned::Io { source, .. }) => return Err(source),
                Err(NotOwned::Foreign { .. } | NotOwned::InUse { .. }) => {}
            }
        }
        Err(io::ErrorKind::AlreadyExists.into())
    }

    /// Returns the path at which the draft is written.
    pub fn path(&self) -> &Path {
        self.0.as_ref().map_or(Path::new(""), OwnedFolder::path)
    }

    /// Gives it the name that was asked for. An empty folder of that name is replaced, nothing
    /// else.
    ///
    /// # Errors
    /// Something is there, or the system refuses; the draft is removed.
    pub fn rename(mut self, folder: &Path) -> io::Result<()> {
        if let Some(draft) = &mut self.0 {
            draft.rename(folder)?;
        }
        self.0 = None;
        Ok(())
    }

    /// Gives it the name that was asked for, without a marker: the folder is the user's from here
    /// on.
    ///
    /// # Errors
    /// Something is there, or the system refuses; the draft is removed.
    pub fn give_away(mut self, folder: &Path) -> io::Result<()> {
        let Some(mut draft) = self.0.take() else { return Ok(()) };
        draft.rename(folder).inspect_err(|_| drop(draft.remove()))?;
        Ok(draft.give_away()?)
    }
}

impl Drop for DraftFolder {
    fn drop(&mut self) {
        if let Some(draft) = &self.0 {
            // What cannot be removed is found by the next draft of the folder.
            let _ = draft.remove();
        }
    }
}

/// Removes drafts of a folder whose processes are gone. One that cannot be removed stays.
fn remove_dead(folder: &Path) {
    let (Some(parent), Some(name)) = (folder.parent(), folder.file_name()) else { return };
    let begin = format!(".{}.partial-", name.to_string_lossy());
    // The parent of a bare name is the current directory.
    let parent = if parent.as_os_str().is_empty() { Path::new(".") } else { parent };
    for entry in parent.read_dir().into_iter().flatten().flatten() {
        let path = entry.path();
        if entry.file_name().to_string_lossy().starts_with(&begin)
            && Marker::is_in(&path)
            && let Ok(dead) = OwnedFolder::open(&path)
        {
            let _ = dead.remove();
        }
    }
}
