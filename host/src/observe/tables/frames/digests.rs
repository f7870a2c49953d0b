//! Digests of each frame, read from `frames.csv`.

use crate::formats::bounds::TABLE_TEXT;
use dynvox_core::geometry::MapSegment;
use serde::Deserialize;
use std::io::Read;

/// Part of a row that a comparison reads.
#[derive(Deserialize)]
pub struct FrameDigests {
    /// Number of the frame in the data set.
    pub frame: usize,
    /// Segment of the map.
    #[serde(default)]
    pub segment: MapSegment,
    /// Digest of all stages.
    pub digest: String,
    /// Digest of the decoded input.
    pub input_digest: String,
    /// Digest of the disparity.
    pub stereo_digest: String,
    /// Digest of the matches.
    pub scene_flow_digest: String,
    /// Digest of the camera's motion.
    pub egomotion_digest: String,
    /// Digest of the tracks.
    pub tracking_digest: String,
    /// Digest of the static map.
    pub static_map_digest: String,
    /// Digests of the objects: `id:digest` with `;` between two, or `-`.
    pub objects_digest: String,
    /// Share of pixels with a disparity.
    #[serde(default)]
    pub stereo_density: f64,
    /// Mean disparity of these pixels, px.
    #[serde(default)]
    pub disparity_mean_px: Option<f64>,
    /// Blocks in use.
    #[serde(default)]
    pub blocks_used: u32,
}

/// Reads the digests of every row, up to the bound of a table's rows.
///
/// # Errors
/// A column is missing, or a row cannot be read.
pub fn read_frame_digests(table: impl Read) -> Result<Vec<FrameDigests>, csv::Error> {
    csv::Reader::from_reader(table).deserialize().take(TABLE_TEXT.lines).collect()
}
