//! Files of a recording: one file, or those of a folder in the order in which they were written.

use super::CONVERT;
use crate::formats::bounds::{
    MAX_BAG_FILES, MAX_YAML_ALIASES, MAX_YAML_NODES, SETTINGS_TEXT, thousands,
};
use crate::formats::read_text_within;
use crate::input::source::InputError;
use serde::Deserialize;
use std::path::{Path, PathBuf};

/// File of ROS 2 that lists the files of a recording.
const METADATA: &str = "metadata.yaml";

/// Container of a recording, told by the ending of its name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// MCAP.
    Mcap,
    /// SQLite, ROS 2's older default.
    Db3,
    /// ROS 1.
    Bag,
    /// Any of them, packed as a whole.
    Packed,
}

impl Kind {
    /// The container of a file's name; `None` of other files.
    pub fn of_name(path: &Path) -> Option<Self> {
        match path.extension()?.to_str()?.to_ascii_lowercase().as_str() {
            "mcap" => Some(Self::Mcap),
            "db3" => Some(Self::Db3),
            "bag" => Some(Self::Bag),
            "zstd" | "zst" | "gz" | "lz4" | "bz2" => {
                Self::of_name(Path::new(path.file_stem()?)).map(|_| Self::Packed)
            }
            _ => None,
        }
    }
}

/// Part of `metadata.yaml` that is read.
#[derive(Deserialize)]
struct Metadata {
    rosbag2_bagfile_information: Information,
}

#[derive(Deserialize)]
struct Information {
    #[serde(default)]
    relative_file_paths: Vec<String>,
    #[serde(default)]
    compression_mode: String,
}

/// Returns true if a path is a recording: a file by its ending, or a folder with such files and
/// `metadata.yaml`, or with the numbered files of one recording.
pub fn is_recording(path: &Path) -> bool {
    if path.is_file() {
        return Kind::of_name(path).is_some();
    }
    if !path.is_dir() {
        return false;
    }
    let files = files_in(path);
    !files.is_empty() && (path.join(METADATA).is_file() || numbered(&files).is_some())
}

/// The files of a recording, in order.
///
/// # Errors
/// A file that is listed is missing, there are too many, or they are packed.
pub fn files_at(path: &Path) -> Result<Vec<PathBuf>, InputError> {
    let files = if path.is_file() { vec![path.to_path_buf()] } else { listed(path)? };
    if files.len() > MAX_BAG_FILES {
        let (found, most) = (thousands(files.len()), thousands(MAX_BAG_FILES));
        let reason = format!(
            "it has {found} files; at most {most} are read. Record longer files, or give some of \
             them in a folder of their own"
        );
        return Err(InputError::bag(path, reason));
    }
    match files.iter().find(|file| Kind::of_name(file) == Some(Kind::Packed)) {
        None => Ok(files),
        Some(packed) => Err(packed_whole(packed)),
    }
}

/// The files of a folder: as `metadata.yaml` lists them, else by their numbers.
fn listed(folder: &Path) -> Result<Vec<PathBuf>, InputError> {
    let found = files_in(folder);
    let metadata = folder.join(METADATA);
    if !metadata.is_file() {
        return numbered(&found).ok_or_else(|| InputError::File { path: folder.to_path_buf() });
    }
    let refuse = |reason: &str| {
        let one = found.first().map_or(folder, PathBuf::as_path).display();
        let reason =
            format!("{reason}. Write it anew with `ros2 bag reindex`, or give one file: {one}");
        InputError::bag(&metadata, reason)
    };
    let text = read_text_within(&metadata, &SETTINGS_TEXT)?;
    let options = serde_saphyr::options! {
        budget: serde_saphyr::budget! {
            max_nodes: MAX_YAML_NODES,
            max_aliases: MAX_YAML_ALIASES,
        },
    };
    let read: Metadata = serde_saphyr::from_str_with_options(&text, options)
        .map_err(|_| refuse("it is no list of a recording's files"))?;
    let information = read.rosbag2_bagfile_information;
    if information.compression_mode.eq_ignore_ascii_case("message") {
        let reason = format!("its messages are packed one by one. {}", conversion(folder));
        return Err(InputError::bag(folder, reason));
    }
    // Older recorders put the folder's name before that of the file; none lies elsewhere.
    let inside = |name: &String| Some(folder.join(Path::new(name).file_name()?));
    let files: Vec<PathBuf> = information.relative_file_paths.iter().filter_map(inside).collect();
    if files.is_empty() {
        return Err(refuse("it lists no files"));
    }
    match files.iter().find(|file| !file.is_file()) {
        None => Ok(files),
        // Unpacked by hand, or packed again.
        Some(missing) => match numbered(&found) {
            Some(numbered) if numbered.len() == files.len() => Ok(numbered),
            _ => Err(refuse(&format!(
                "it lists {}, which is not there",
                missing.file_name().unwrap_or_default().to_string_lossy()
            ))),
        },
    }
}

/// The refusal of a packed file, with the command that unpacks it.
fn packed_whole(path: &Path) -> InputError {
    let ending = path.extension().and_then(|ending| ending.to_str()).unwrap_or_default();
    let (tool, options) = match ending.to_ascii_lowercase().as_str() {
        "gz" => ("gunzip", "-k"),
        "bz2" => ("bunzip2", "-k"),
        "lz4" => ("lz4", "-d"),
        _ => ("zstd", "-d"),
    };
    let shown = path.display();
    let unpacked = path.with_extension("");
    let reason = format!(
        "it is packed as a whole. Unpack it with `{tool} {options} {shown}` and give {}, or the \
         folder where it is one of several",
        unpacked.display()
    );
    InputError::bag(path, reason)
}

/// The files of recordings in a folder, by name; hidden ones are passed over.
fn files_in(folder: &Path) -> Vec<PathBuf> {
    let entries = folder.read_dir().into_iter().flatten().flatten().map(|entry| entry.path());
    let hidden =
        |path: &Path| path.file_name().is_none_or(|name| name.to_string_lossy().starts_with('.'));
    let mut files: Vec<PathBuf> = entries
        .filter(|path| Kind::of_name(path).is_some() && path.is_file() && !hidden(path))
        .take(MAX_BAG_FILES + 1)
        .collect();
    files.sort();
    files
}

/// Files `NAME_0`, `NAME_1`, ... of one recording by their numbers; `None` of files that belong to
/// several.
fn numbered(files: &[PathBuf]) -> Option<Vec<PathBuf>> {
    let part = |path: &PathBuf| {
        // Of packed files both endings go.
        let name = path.file_name()?.to_str()?;
        let stem = name.split_once('.').map_or(name, |(stem, _)| stem);
        let (name, number) = stem.rsplit_once('_')?;
        Some((number.parse::<u64>().ok()?, name.to_owned(), path.clone()))
    };
    let mut parts = files.iter().map(part).collect::<Option<Vec<_>>>()?;
    parts.sort();
    let (_, first, _) = parts.first()?;
    let one = parts.iter().all(|(_, name, _)| name == first)
        && parts.windows(2).all(|pair| pair[0].0 < pair[1].0);
    one.then(|| parts.into_iter().map(|(.., path)| path).collect())
}

/// Note for a file that is one of several of its recording.
pub fn siblings_note(path: &Path) -> Option<String> {
    if !path.is_file() {
        return None;
    }
    let folder = path.parent()?;
    let count = numbered(&files_in(folder)).filter(|files| files.len() > 1)?.len();
    let shown = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    Some(format!("one of {count} files of a recording: give {} to map all", shown.display()))
}

/// Sentence with the command that converts a recording of another kind.
pub fn conversion(path: &Path) -> String {
    let to = path.with_extension("");
    format!(
        "Convert it with {CONVERT} --src {} --dst {}-mcap --dst-storage mcap` (`pip install \
         rosbags`) and give the result",
        path.display(),
        to.display()
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;
    use tempfile::TempDir;

    fn folder(names: &[&str]) -> TempDir {
        let folder = TempDir::new().unwrap();
        for name in names {
            fs::write(folder.path().join(name), "x").unwrap();
        }
        folder
    }

    fn names(files: Vec<PathBuf>) -> Vec<String> {
        files.iter().map(|path| path.file_name().unwrap().to_string_lossy().into()).collect()
    }

    fn metadata(folder: &TempDir, files: &[&str], more: &str) {
        let list: String = files.iter().map(|file| format!("    - {file}\n")).collect();
        let text = format!(
            "rosbag2_bagfile_information:\n  version: 5\n{more}  relative_file_paths:\n{list}"
        );
        fs::write(folder.path().join(METADATA), text).unwrap();
    }

    #[test]
    fn files_come_in_the_order_in_which_they_were_written() {
        // 10 after 9, unlike in the order of names.
        let split = folder(&["d_10.mcap", "d_2.mcap", "d_9.mcap", "._d_2.mcap"]);
        assert!(is_recording(split.path()));
        let by_number = ["d_2.mcap", "d_9.mcap", "d_10.mcap"];
        assert_eq!(names(files_at(split.path()).unwrap()), by_number);
        metadata(&split, &["d_9.mcap", "rosbag2/d_10.mcap", "../d_2.mcap"], "");
        let listed = ["d_9.mcap", "d_10.mcap", "d_2.mcap"];
        assert_eq!(names(files_at(split.path()).unwrap()), listed);
        let note = siblings_note(&split.path().join("d_2.mcap")).unwrap();
        assert!(note.contains("one of 3 files of a recording"), "{note}");
    }

    #[test]
    fn files_of_several_recordings_are_no_recording() {
        assert!(!is_recording(folder(&["a.mcap", "b.mcap"]).path()));
        assert!(!is_recording(folder(&["a_0.mcap", "b_1.mcap"]).path()));
        assert!(!is_recording(folder(&["left.png"]).path()));
        let alone = folder(&["a_0.mcap"]);
        assert_eq!(siblings_note(&alone.path().join("a_0.mcap")), None);
    }

    #[test]
    fn missing_and_packed_files_are_named_with_the_next_step() {
        let refused = |folder: &TempDir| files_at(folder.path()).unwrap_err().to_string();
        let split = folder(&["d_0.mcap"]);
        metadata(&split, &["d_0.mcap", "d_1.mcap"], "");
        let missing = refused(&split);
        assert!(missing.contains("it lists d_1.mcap, which is not there"), "{missing}");
        assert!(missing.contains("ros2 bag reindex"), "{missing}");
        let packed = folder(&["d_0.mcap.zstd"]);
        metadata(&packed, &["d_0.mcap.zstd"], "  compression_mode: FILE\n");
        assert!(refused(&packed).contains("`zstd -d "), "{}", refused(&packed));
        // Unpacked beside it, the list still names the packed ones.
        let unpacked = folder(&["d_0.mcap"]);
        metadata(&unpacked, &["d_0.mcap.zstd"], "  compression_mode: FILE\n");
        assert_eq!(names(files_at(unpacked.path()).unwrap()), ["d_0.mcap"]);
        let messages = folder(&["d_0.mcap"]);
        metadata(&messages, &["d_0.mcap"], "  compression_mode: MESSAGE\n");
        assert!(refused(&messages).contains("one by one"), "{}", refused(&messages));
        fs::write(split.path().join(METADATA), "- 1\n").unwrap();
        assert!(refused(&split).contains("no list of a recording's files"), "{}", refused(&split));
    }
}
