//! Settings of the scene flow.

use crate::settings::{
    Problems, Range, Rule, Setting,
    Value::{Bool, U8, U16, U32},
    check, rules,
};

/// Most features of an image by default: as many as the presets of [`crate::Capacity`] have memory
/// for.
pub(crate) const MAX_FEATURES: usize = 20_000;

/// Settings of the scene flow. Defaults are DynSLAM's, with sub-pixel refinement and no more
/// features than motion gains by; [`SceneFlowConfig::SETTINGS`] has the ranges.
///
/// ```
/// use dynvox_core::scene_flow::SceneFlowConfig;
///
/// let config = SceneFlowConfig { features_max: 2_000, ..SceneFlowConfig::default() };
/// let mut problems = dynvox_core::Problems::new();
/// config.validate(&mut problems);
/// assert!(problems.is_empty());
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(default, deny_unknown_fields)
)]
pub struct SceneFlowConfig {
    /// Smallest filter response of a feature, grey levels times filter weights.
    pub response_min: u16,
    /// Most features of an image.
    pub features_max: u32,
    /// Farthest that a feature moves between two frames or two cameras, px in each direction.
    pub search_radius_px: u16,
    /// Most rows by which two stereo partners differ.
    pub stereo_tolerance_px: u8,
    /// Fewest neighbours that must support a match.
    pub support_min: u8,
    /// Refinement of matches below the pixel.
    pub refine: bool,
    /// Most matches selected per cell.
    pub bucket_matches: u8,
}

impl Default for SceneFlowConfig {
    fn default() -> Self {
        Self {
            response_min: 100,
            features_max: MAX_FEATURES as u32,
            search_radius_px: 200,
            stereo_tolerance_px: 2,
            support_min: 4,
            refine: true,
            bucket_matches: 15,
        }
    }
}

type Row = Setting<SceneFlowConfig>;

impl SceneFlowConfig {
    /// One row per setting.
    pub const SETTINGS: &'static [Row] = &[
        Row::expert("scene_flow.response_min", "", |c| U16(&mut c.response_min))
            .range(Range::Within(1.0, 2000.0))
            .published("50, which finds a third more features and no better motion")
            .text("Smallest filter response of a feature, grey levels times filter weights."),
        Row::user("scene_flow.features_max", "", |c| U32(&mut c.features_max))
            .range(Range::Within(100.0, 1e6))
            .published("all")
            .text(
                "Most features of an image; of more, the strongest of each part of the image are \
                 used, and no more than the capacity holds \
                 ([decision 48](decisions/0048-the-strongest-of-each-cell.md)).",
            ),
        Row::user("scene_flow.search_radius_px", "px", |c| U16(&mut c.search_radius_px))
            .range(Range::Within(16.0, 500.0))
            .text("Farthest that a feature moves between two frames or two cameras, each way."),
        Row::user("scene_flow.stereo_tolerance_px", "px", |c| U8(&mut c.stereo_tolerance_px))
            .range(Range::Within(0.0, 8.0))
            .text("Most rows by which two stereo partners differ."),
        Row::expert("scene_flow.support_min", "", |c| U8(&mut c.support_min))
            .range(Range::Within(0.0, 8.0))
            .text("Fewest neighbours that must support a match; 0 keeps all."),
        Row::expert("scene_flow.refine", "", |c| Bool(&mut c.refine))
            .published("false")
            .text("Refinement of matches below the pixel."),
        Row::expert("scene_flow.bucket_matches", "", |c| U8(&mut c.bucket_matches))
            .range(Range::Within(1.0, 64.0))
            .text("Most matches selected for egomotion per cell of 50 px."),
    ];

    pub(crate) const CHECKS: &'static [Rule<Self>] =
        &rules::<_, { Self::SETTINGS.len() }>(Self::SETTINGS);

    /// Notes everything wrong with the settings.
    pub fn validate(&self, problems: &mut Problems) {
        check(Self::CHECKS, self, problems);
    }
}
