//! Settings of the scene flow.

use crate::problem::{Problems, require};

/// Most features of an image by default: as many as the presets of [`crate::Capacity`] have memory
/// for.
pub(crate) const FEATURES_MAX: usize = 20_000;

/// Settings of the scene flow. Defaults are DynSLAM's, with sub-pixel refinement and no more
/// features than motion gains by.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(default, deny_unknown_fields)
)]
pub struct SceneFlowConfig {
    /// Smallest filter response of a feature, grey levels times filter weights; 1..=2000. DynSLAM:
    /// 50, which finds a third more features and no better motion.
    pub response_min: u16,
    /// Most features of an image, 100..=1,000,000; of more the strongest are used, and no more than
    /// the capacity holds. 20,000 (docs/decisions/0048-the-strongest-of-each-cell.md); DynSLAM:
    /// all.
    pub features_max: u32,
    /// Farthest a feature moves between two frames or two cameras, px in each direction; 16..=500.
    /// DynSLAM: 200.
    pub search_radius_px: u16,
    /// Rows two stereo partners may differ by; 0..=8. DynSLAM: 2.
    pub stereo_tolerance_px: u8,
    /// Disparity neighbours may differ by and still support each other, px; above 0. DynSLAM: 5.
    pub disparity_tolerance_px: f32,
    /// Flow neighbours may differ by, in each direction, and still support each other, px; above 0.
    /// DynSLAM: 5.
    pub flow_tolerance_px: f32,
    /// Neighbours that must support a match; 0 keeps all; 0..=8. DynSLAM: 4.
    pub support_min: u8,
    /// Whether matches are refined below the pixel. DynSLAM: no.
    pub refine: bool,
    /// Side of the cells from which matches are selected for egomotion, px; 16..=500. DynSLAM: 50.
    pub bucket_px: u16,
    /// Matches selected per cell; 1..=64. DynSLAM: 15.
    pub bucket_matches: u8,
}

impl Default for SceneFlowConfig {
    fn default() -> Self {
        Self {
            response_min: 100,
            features_max: FEATURES_MAX as u32,
            search_radius_px: 200,
            stereo_tolerance_px: 2,
            disparity_tolerance_px: 5.0,
            flow_tolerance_px: 5.0,
            support_min: 4,
            refine: true,
            bucket_px: 50,
            bucket_matches: 15,
        }
    }
}

impl SceneFlowConfig {
    /// Notes what is wrong with the settings.
    pub fn validate(&self, problems: &mut Problems) {
        let positive = |value: f32| value.is_finite() && value > 0.0;
        require(
            problems,
            (1..=2000).contains(&self.response_min),
            "scene_flow.response_min",
            "must be in 1..=2000",
        );
        require(
            problems,
            (100..=1_000_000).contains(&self.features_max),
            "scene_flow.features_max",
            "must be in 100..=1000000",
        );
        require(
            problems,
            (16..=500).contains(&self.search_radius_px),
            "scene_flow.search_radius_px",
            "must be in 16..=500",
        );
        require(
            problems,
            self.stereo_tolerance_px <= 8,
            "scene_flow.stereo_tolerance_px",
            "must be in 0..=8",
        );
        require(
            problems,
            positive(self.disparity_tolerance_px),
            "scene_flow.disparity_tolerance_px",
            "must be above 0",
        );
        require(
            problems,
            positive(self.flow_tolerance_px),
            "scene_flow.flow_tolerance_px",
            "must be above 0",
        );
        require(problems, self.support_min <= 8, "scene_flow.support_min", "must be in 0..=8");
        require(
            problems,
            (16..=500).contains(&self.bucket_px),
            "scene_flow.bucket_px",
            "must be in 16..=500",
        );
        require(
            problems,
            (1..=64).contains(&self.bucket_matches),
            "scene_flow.bucket_matches",
            "must be in 1..=64",
        );
    }
}
