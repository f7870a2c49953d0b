//! Settings of instances: which detections are accepted, and how far their masks are scaled.

/// Scale of the mask under which nothing enters the static map, 1/1000.
const DELETE_PERMILLE: u32 = 1200;
/// Boxes below this many times the least area, 1/1000, are scaled twice.
const SMALL_PERMILLE: u64 = 1375;
/// Image width to which areas in px refer.
const REFERENCE_WIDTH: u64 = 1242;

/// Acceptance of detections. Defaults are the original's published ones unless said otherwise.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(default, deny_unknown_fields)
)]
pub struct InstancesConfig {
    /// Scores below are ignored; 0 to 1; 0.
    pub score_min: f32,
    /// A detection's box must be larger than this to be reconstructed, and to be kept out of the
    /// static map in every state, px at an image width of 1242, at other widths in proportion to
    /// the width squared; 2025.
    pub area_min_px: u32,
    /// It must be larger than this to be tracked, and kept out of the static map once it is known
    /// to move; 900: the 18 matches a first motion takes, 7 px apart. The original: as
    /// `area_min_px`.
    pub track_area_min_px: u32,
}

impl Default for InstancesConfig {
    fn default() -> Self {
        Self { score_min: 0.0, area_min_px: 2025, track_area_min_px: 900 }
    }
}

impl InstancesConfig {
    /// Returns true if a box of `area_px` in an image of that width can be reconstructed: strictly
    /// larger than the least area.
    pub fn is_reconstructable(&self, area_px: i64, width: usize) -> bool {
        area_px as u64 * REFERENCE_WIDTH * REFERENCE_WIDTH > least(self.area_min_px, width)
    }

    /// Returns true if so many pixels are enough to be tracked.
    pub fn is_trackable(&self, area_px: i64, width: usize) -> bool {
        area_px as u64 * REFERENCE_WIDTH * REFERENCE_WIDTH > least(self.track_area_min_px, width)
    }

    /// Returns the scale of a box's delete mask, 1/1000.
    pub(crate) fn delete_permille(&self, area_px: i64, width: usize) -> u32 {
        let least = least(self.area_min_px, width);
        let is_small =
            area_px as u64 * REFERENCE_WIDTH * REFERENCE_WIDTH * 1000 < least * SMALL_PERMILLE;
        let once = DELETE_PERMILLE;
        if is_small { once * once / 1000 } else { once }
    }
}

/// An area at the reference width times that width squared, in an image of another width.
fn least(area_px: u32, width: usize) -> u64 {
    u64::from(area_px) * (width as u64) * (width as u64)
}
