//! Settings of tracks.

/// Overlap by which a detection is compared with a track.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(rename_all = "lowercase")
)]
pub enum Overlap {
    /// Intersection over union of the masks.
    #[default]
    Mask,
    /// Overlap of the boxes (the original).
    Box,
}

/// Association of instances with tracks. Defaults are the original's published ones unless said
/// otherwise.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(default, deny_unknown_fields)
)]
pub struct TracksConfig {
    /// Overlap by which a detection is associated with a track. The original: boxes.
    pub overlap: Overlap,
    /// Overlap times the geometric mean of both scores times the discount for frames missed must be
    /// above this; 0 to 1; 0.1.
    pub association_min: f32,
    /// Frames without a detection over which a track is found again by how far it reached when it
    /// was last seen whole; at most 1000; 0 never; 10. The original: 0.
    pub extent_frames: u16,
    /// Frames after which a track not detected again is forgotten; 1 to 10000; 50.
    pub forget_frames: u16,
}

impl Default for TracksConfig {
    fn default() -> Self {
        Self {
            overlap: Overlap::Mask,
            association_min: 0.1,
            extent_frames: 10,
            forget_frames: 50,
        }
    }
}
