//! The mapper's bounds as a table of a TOML or JSON file.

use dynvox_core::Capacity;
use serde::{Deserialize, Serialize};

/// A capacity in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct CapacityTable(#[serde(with = "CapacityDef")] pub Capacity);

#[derive(Serialize, Deserialize)]
#[serde(remote = "Capacity", deny_unknown_fields)]
struct CapacityDef {
    image_width: usize,
    image_height: usize,
    #[serde(default)]
    raw_width: usize,
    #[serde(default)]
    raw_height: usize,
    features: usize,
    matches: usize,
    blocks: usize,
    visible_blocks: usize,
    history_frames: usize,
    detections: usize,
    mask_words: usize,
    tracks: usize,
    objects: usize,
    object_blocks: usize,
    crop_pixels: usize,
    #[serde(default)]
    keyframes: usize,
    #[serde(default)]
    planning_width: usize,
    #[serde(default)]
    planning_length: usize,
    #[serde(default)]
    planning_height: usize,
    #[serde(default)]
    planning_distance_3d: bool,
    colour: bool,
}

/// A capacity as a file, for `--capacity`.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CapacityFile {
    /// The bounds.
    pub capacity: CapacityTable,
}

impl CapacityFile {
    /// The file of a capacity.
    pub fn of(capacity: &Capacity) -> Self {
        Self { capacity: CapacityTable(*capacity) }
    }

    /// Returns the table as text.
    ///
    /// # Errors
    /// A bound is beyond TOML's integers.
    pub fn to_toml(self) -> Result<String, toml::ser::Error> {
        toml::to_string(&self)
    }
}
