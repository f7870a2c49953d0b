//! A calibration format's row in the table of formats, and the files that one is read from.
//!
//! Each format's file holds such a row as `FORMAT`; [`super::CALIBRATION_FORMATS`] lists them.

use super::StereoCalibration;
use super::tree::{Node, Tree};
use crate::formats::{FormatError, read_text};
use std::cell::OnceCell;
use std::path::{Path, PathBuf};

/// Format of the calibration of a raw pair.
pub struct CalibrationFormat {
    /// Name in messages and tables.
    pub name: &'static str,
    /// Files and their keys, as the documentation and refusals list them.
    pub files: &'static str,
    /// Recognizes the format by what the files hold.
    pub(super) matches: fn(&Files) -> bool,
    /// Reads files that match.
    pub(super) read: fn(&Files) -> Result<StereoCalibration, FormatError>,
    /// Names and texts of the files of an example: two cameras of 752 x 480 px, 0.11 m apart.
    pub example: &'static [(&'static str, &'static str)],
}

/// Files of one calibration, read as text and, if they are YAML, JSON or XML, as trees.
pub(super) struct Files {
    files: Vec<(PathBuf, String)>,
    /// Width and height of the raw images, px, if the caller knows them.
    pub image_size: Option<[u32; 2]>,
    trees: OnceCell<Result<Vec<Tree>, FormatError>>,
}

impl Files {
    /// Reads files.
    ///
    /// # Errors
    /// A file cannot be read.
    pub fn read(paths: &[&Path], image_size: Option<[u32; 2]>) -> Result<Self, FormatError> {
        let file = |path: &&Path| Ok((path.to_path_buf(), read_text(path)?));
        let files = paths.iter().map(file).collect::<Result<_, FormatError>>()?;
        Ok(Self::new(files, image_size))
    }

    /// Takes paths with their texts.
    pub fn new(files: Vec<(PathBuf, String)>, image_size: Option<[u32; 2]>) -> Self {
        Self { files, image_size, trees: OnceCell::new() }
    }

    /// Path of the first file.
    pub fn path(&self) -> &Path {
        self.files.first().map_or(Path::new(""), |(path, _)| path)
    }

    /// Text of the first file.
    pub fn text(&self) -> &str {
        self.files.first().map_or("", |(_, text)| text)
    }

    /// Tells whether the first file's name ends so.
    pub fn ends_in(&self, ending: &str) -> bool {
        self.path().extension().is_some_and(|found| found.eq_ignore_ascii_case(ending))
    }

    /// Roots of all files; none if one of them is no tree.
    pub fn roots(&self) -> Vec<Node<'_>> {
        self.trees().as_ref().map_or(Vec::new(), |trees| trees.iter().map(Tree::root).collect())
    }

    /// Root of the first file.
    ///
    /// # Errors
    /// A file is no tree.
    pub fn root(&self) -> Result<Node<'_>, FormatError> {
        self.roots().first().copied().ok_or_else(|| {
            FormatError::content(self.path(), "it is not YAML, JSON or XML", "Give another file")
        })
    }

    /// Tells whether any of the files has a key at its top.
    pub fn has(&self, key: &'static str) -> bool {
        self.roots().iter().any(|root| root.get(key).is_some())
    }

    /// Refuses files that no format matches.
    pub fn refuse(self, known: &str) -> FormatError {
        let path = self.path().to_path_buf();
        match self.trees.into_inner() {
            Some(Err(error)) => error,
            _ => FormatError::content(
                &path,
                "its keys are of no known calibration",
                format!(
                    "Known are {known}; `dynvox calibration` writes any of them as dynvox's own"
                ),
            ),
        }
    }

    fn trees(&self) -> &Result<Vec<Tree>, FormatError> {
        self.trees.get_or_init(|| {
            self.files.iter().map(|(path, text)| Tree::from_text(text, path)).collect()
        })
    }
}
