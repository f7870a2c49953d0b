//! The marker of a folder: proof that dynvox made it, and the ledger of what it made in there.

use cap_std::ambient_authority;
use cap_std::fs::{Dir, OpenOptions};
use std::collections::BTreeSet;
use std::hash::{BuildHasher, Hasher, RandomState};
use std::io::{self, ErrorKind, Read, Write};
use std::path::Path;

/// Name of the marker in its folder.
pub const MARKER_FILE: &str = ".dynvox";
/// Begin of the first line. The version is that of the layout of the file.
const MAGIC: &str = "dynvox made this folder and the files below; version 1; id ";
/// Digits of an id.
const ID_DIGITS: usize = 32;
/// Largest marker that is read, bytes: some two million files.
const MAX_BYTES: u64 = 128 << 20;

/// The content of a marker.
#[derive(Debug, Default)]
pub(super) struct Marker {
    /// Random, so that a folder that took the place of another is told from it.
    pub id: String,
    /// Paths of files below the folder, with `/`.
    pub files: BTreeSet<String>,
    /// Paths of folders below the folder, parents first.
    pub folders: BTreeSet<String>,
}

impl Marker {
    /// Reads the marker of an open folder; `None` where it has none, or the marker is a link, or
    /// not of this version.
    pub fn read(folder: &Dir) -> io::Result<Option<Self>> {
        let is_file = match folder.symlink_metadata(MARKER_FILE) {
            Ok(found) => found.is_file() && found.len() <= MAX_BYTES,
            Err(error) if error.kind() == ErrorKind::NotFound => false,
            Err(error) => return Err(error),
        };
        if !is_file {
            return Ok(None);
        }
        let mut bytes = Vec::new();
        folder.open(MARKER_FILE)?.take(MAX_BYTES).read_to_end(&mut bytes)?;
        Ok(Self::parse(&String::from_utf8_lossy(&bytes)))
    }

    fn parse(text: &str) -> Option<Self> {
        let (head, ledger) = text.split_once('\n')?;
        let id = head.strip_prefix(MAGIC)?;
        if id.len() != ID_DIGITS || !id.bytes().all(|digit| digit.is_ascii_hexdigit()) {
            return None;
        }
        let mut marker = Self { id: id.to_owned(), ..Self::default() };
        // A line without its end was cut off before its file was made.
        for line in ledger.split_inclusive('\n').filter_map(|line| line.strip_suffix('\n')) {
            match line.strip_suffix('/') {
                Some(folder) => marker.folders.insert(folder.to_owned()),
                None => marker.files.insert(line.to_owned()),
            };
        }
        Some(marker)
    }

    /// Writes a new marker with an empty ledger, and returns its id.
    pub fn create(folder: &Dir) -> io::Result<String> {
        let word = || RandomState::new().build_hasher().finish();
        let id = format!("{:016x}{:016x}", word(), word());
        let mut file =
            folder.open_with(MARKER_FILE, OpenOptions::new().write(true).create_new(true))?;
        if let Err(error) = writeln!(file, "{MAGIC}{id}") {
            // A marker without its first line would be no proof.
            let _ = folder.remove_file(MARKER_FILE);
            return Err(error);
        }
        Ok(id)
    }

    /// Enters a file, or with a `/` at its end a folder, into the ledger of a folder.
    pub fn enter(folder: &Dir, entry: &str) -> io::Result<()> {
        let mut file = folder.open_with(MARKER_FILE, OpenOptions::new().append(true))?;
        file.write_all(format!("{entry}\n").as_bytes())
    }

    /// Returns true if the folder at a path has a marker.
    pub fn is_in(folder: &Path) -> bool {
        let Ok(found) = folder.join(MARKER_FILE).symlink_metadata() else { return false };
        let mut head = [0; MAGIC.len()];
        found.is_file()
            && std::fs::File::open(folder.join(MARKER_FILE))
                .and_then(|mut file| file.read_exact(&mut head))
                .is_ok_and(|()| head == MAGIC.as_bytes())
    }
}

/// Opens a real folder: a link to one is refused.
pub(super) fn open_folder(path: &Path) -> io::Result<Option<Dir>> {
    match path.symlink_metadata() {
        Ok(found) if found.is_dir() => Dir::open_ambient_dir(path, ambient_authority()).map(Some),
        Ok(_) => Ok(None),
        Err(error) => Err(error),
    }
}
