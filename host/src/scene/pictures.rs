//! The pictures of a run folder: some frames, and the finished map.

use serde::{Deserialize, Serialize};

/// Name of the folder of pictures in the run folder.
pub const PICTURES_FOLDER: &str = "pictures";
/// Name of the list of pictures in it.
pub const PICTURES_INDEX: &str = "index.json";
/// Name of the picture of the finished map in it.
pub const OVERVIEW: &str = "overview.jpg";

/// Contents of a picture of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PictureKind {
    /// The left image.
    Left,
    /// Instance masks in the colours of their motion states, transparent elsewhere, as large as the
    /// left picture.
    Masks,
    /// Disparity from far (blue) to near (red).
    Disparity,
    /// The map from the camera's pose, with every object in its place.
    Map,
}

impl PictureKind {
    /// All.
    pub const ALL: [Self; 4] = [Self::Left, Self::Masks, Self::Disparity, Self::Map];

    /// Name of the file of a frame.
    pub fn file(self, frame: usize) -> String {
        format!("{frame:06}_{}", self.ending())
    }

    /// Returns the end of a picture's file name, which tells its contents and format.
    const fn ending(self) -> &'static str {
        match self {
            Self::Left => "left.jpg",
            Self::Masks => "masks.png",
            Self::Disparity => "disparity.jpg",
            Self::Map => "map.jpg",
        }
    }
}

/// The list of pictures.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct PictureIndex {
    /// Width of the images that boxes of tracks are measured in, px.
    pub width: usize,
    /// Height of the pictures, px.
    pub height: usize,
    /// Numbers of the frames that have pictures.
    pub frames: Vec<usize>,
}
