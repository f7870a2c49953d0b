//! The files that a calibration is read from, and what a reader notes of them.

use super::tree::{Node, Tree};
use crate::formats::FormatError;
use crate::formats::calibration::hints::{CalibrationHints, LensFamily};
use std::cell::{Cell, OnceCell, RefCell};
use std::path::{Path, PathBuf};

/// Files of one calibration, read as text and, if they are YAML, JSON or XML, as trees.
pub(super) struct Files<'f> {
    files: &'f [(PathBuf, String)],
    hints: CalibrationHints,
    /// Width and height of the raw images, px, if the caller knows them.
    image_size: Option<[u32; 2]>,
    trees: OnceCell<Result<Vec<Tree>, FormatError>>,
    /// Sentences about what was guessed.
    guesses: RefCell<Vec<String>>,
    /// True if a reader asked for the images' size in vain.
    lacks_size: Cell<bool>,
    /// Lens that a reader guessed.
    guessed_lens: Cell<Option<LensFamily>>,
}

impl<'f> Files<'f> {
    /// Takes paths with their texts.
    pub fn new(
        files: &'f [(PathBuf, String)],
        hints: CalibrationHints,
        image_size: Option<[u32; 2]>,
    ) -> Self {
        Self {
            files,
            hints,
            image_size,
            trees: OnceCell::new(),
            guesses: RefCell::default(),
            lacks_size: Cell::new(false),
            guessed_lens: Cell::new(None),
        }
    }

    /// Path of the first file.
    pub fn path(&self) -> &'f Path {
        self.files.first().map_or(Path::new(""), |(path, _)| path)
    }

    /// Text of the first file.
    pub fn text(&self) -> &'f str {
        self.files.first().map_or("", |(_, text)| text)
    }

    /// Paths and texts of all files.
    pub fn all(&self) -> &'f [(PathBuf, String)] {
        self.files
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

    /// Root of the first file that has a key at its top.
    pub fn root_with(&self, key: &str) -> Option<Node<'_>> {
        self.roots().into_iter().find(|root| root.has(key))
    }

    /// Tells whether any of the files has a key at its top.
    pub fn has(&self, key: &str) -> bool {
        self.root_with(key).is_some()
    }

    /// Size of the images, px, if it is known.
    pub fn known_size(&self) -> Option<[u32; 2]> {
        self.image_size
    }

    /// Size of the images, which the files do not say.
    ///
    /// # Errors
    /// It is not known.
    pub fn image_size(&self, at: Node<'_>) -> Result<[u32; 2], FormatError> {
        self.image_size.ok_or_else(|| {
            self.lacks_size.set(true);
            at.refuse(
                "it does not say the size of the images",
                "Give --image WxH, or add image_width and image_height; with images beside it, \
                 their size is taken",
            )
        })
    }

    /// Notes that the size of the images decides, and is not known.
    pub fn lack_size(&self) {
        self.lacks_size.set(true);
    }

    /// Tells whether KITTI's colour pair is wanted.
    pub fn wants_colour(&self) -> bool {
        self.hints.colour
    }

    /// Tells whether a person says that the cameras stand one above the other.
    pub fn are_vertical(&self) -> bool {
        self.hints.vertical
    }

    /// Lens that a person says.
    pub fn lens_family(&self) -> Option<LensFamily> {
        self.hints.lens_model
    }

    /// Notes a guess of the lens.
    pub fn guess_lens(&self, family: LensFamily, reason: &str) {
        if self.guessed_lens.replace(Some(family)).is_none() {
            self.guess(format!(
                "guess: {} lenses ({reason}); --lens-model {} says otherwise",
                family.name(),
                family.other().name()
            ));
        }
    }

    /// Notes a guess, in a sentence.
    pub fn guess(&self, sentence: String) {
        self.guesses.borrow_mut().push(sentence);
    }

    /// Tells whether names say that the first of two files is the right camera's.
    pub fn right_comes_first(&self) -> bool {
        let [first, second] = [0, 1].map(|at| self.files.get(at).map(|file| side_of(&file.0)));
        first == Some(Some(Side::Right)) && second == Some(Some(Side::Left))
    }

    /// Sentences about what was guessed, whether the images' size is lacking, and the lens that was
    /// guessed.
    pub fn noted(self) -> (Vec<String>, bool, Option<LensFamily>) {
        (self.guesses.into_inner(), self.lacks_size.get(), self.guessed_lens.get())
    }

    /// Refuses files that no format matches.
    pub fn refuse(&self, known: &str) -> FormatError {
        match self.trees() {
            // The reason is a sentence already.
            Err(FormatError::Content { path, reason, action }) => {
                FormatError::content(path, reason.clone(), action.clone())
            }
            _ => FormatError::content(
                self.path(),
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

/// Side of a camera.
#[derive(Clone, Copy, PartialEq)]
enum Side {
    Left,
    Right,
}

/// Side that the last folder and the name of a file say.
fn side_of(path: &Path) -> Option<Side> {
    let words = path.iter().rev().take(2).map(|part| part.to_string_lossy().to_lowercase());
    words.into_iter().find_map(|word| {
        let has = |marks: [&str; 3]| marks.iter().any(|mark| word.contains(mark));
        match (has(["left", "cam0", "_l."]), has(["right", "cam1", "_r."])) {
            (true, false) => Some(Side::Left),
            (false, true) => Some(Side::Right),
            _ => None,
        }
    })
}
