//! Counts of one frame's scene flow.

use super::camera::FeatureCount;

/// Result of a frame's scene flow.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum FlowStatus {
    /// Matches against the previous frame were looked for.
    #[default]
    Matched,
    /// There is no previous frame, or it had another size: no matches.
    First,
    /// One camera delivered its previous image again, bit for bit, and the other did not: no
    /// matches.
    Frozen,
    /// Both cameras delivered their previous images again, bit for bit: matches were looked for and
    /// say that the camera stands. It does, or the images are old ones.
    Repeated,
    /// The images differ in size or exceed the capacity: nothing was done, and the next frame is a
    /// first one.
    Refused,
}

/// Counts of one pass.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct PassCount {
    /// Circles that closed.
    pub closed: u32,
    /// Closed circles dropped because the list was full.
    pub dropped: u32,
    /// Kept ones without support in their neighbourhood.
    pub unsupported: u32,
    /// Descriptors that were compared with one.
    pub compared: u64,
}

/// One frame's scene flow.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub struct FlowReport {
    /// Result of the frame.
    pub status: FlowStatus,
    /// Features of the left image.
    pub left: FeatureCount,
    /// Features of the right image.
    pub right: FeatureCount,
    /// The sparse pass. Its unsupported matches stay in `sparse()`.
    pub sparse: PassCount,
    /// The dense pass.
    pub dense: PassCount,
    /// Supported matches whose patch was lost below the pixel.
    pub unrefined: u32,
    /// Matches in `refined()`.
    pub refined: u32,
    /// Matches in `bucketed()`.
    pub bucketed: u32,
}
