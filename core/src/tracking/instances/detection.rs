//! Detections, as the caller hands them in.

use super::Class;
use crate::digest::Digest;

/// Most detections a capacity can ask for.
pub const MAX_DETECTIONS: usize = 64;

/// An instance a detector found in the left image.
///
/// ```
/// use dynvox_core::tracking::{Class, Detection};
///
/// let mask = [1; 60 * 40]; // every pixel of the box
/// let car = Detection { class: Class::Car, score: 0.9, left: 100, top: 30, width: 60, height: 40, mask: &mask };
/// assert_eq!(car.digest(), Detection { ..car }.digest());
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Detection<'a> {
    /// The class the detector gives it.
    pub class: Class,
    /// Confidence of the detector; 0 to 1.
    pub score: f32,
    /// First column of the box, px; may lie outside the image.
    pub left: i32,
    /// First row of the box, px; may lie outside the image.
    pub top: i32,
    /// Columns of the box, px.
    pub width: u32,
    /// Rows of the box, px.
    pub height: u32,
    /// The mask, row by row within the box; a pixel belongs to it unless it is 0.
    pub mask: &'a [u8],
}

impl Detection<'_> {
    /// Digest of all its fields.
    pub fn digest(&self) -> u64 {
        let mut digest = Digest::default();
        digest.u64(u64::from(self.score.to_bits()) << 32 | u64::from(self.class.code()));
        digest.u64(u64::from(self.left as u32) << 32 | u64::from(self.top as u32));
        digest.u64(u64::from(self.width) << 32 | u64::from(self.height));
        digest.bytes(self.mask);
        digest.finish()
    }
}

/// Counts of a frame's detections. Each detection is counted once.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct DetectionCount {
    /// Handed in.
    pub given: u32,
    /// Accepted.
    pub accepted: u32,
    /// Score not a number in 0..=1.
    pub bad_score: u32,
    /// Box empty, too large or wholly outside the image.
    pub bad_box: u32,
    /// Mask shorter than its box, or without a pixel in the image.
    pub bad_mask: u32,
    /// Class that is left to the static map.
    pub ignored: u32,
    /// Box not larger than the least area to be reconstructed, even if its mask is unusable or does
    /// not fit.
    pub too_small: u32,
    /// Number of these that are tracked only.
    pub tracked_only: u32,
    /// More than the capacity: lowest scores.
    pub over_capacity: u32,
    /// The mask store was full.
    pub mask_store_full: u32,
    /// Nothing left under masks of higher score.
    pub covered: u32,
}

impl DetectionCount {
    /// Detections that should have been used and were not.
    pub fn refused(&self) -> u32 {
        self.bad_score + self.bad_box + self.bad_mask + self.over_capacity + self.mask_store_full
    }
}
