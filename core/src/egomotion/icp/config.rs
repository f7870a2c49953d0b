//! Settings of the depth tracker.

use crate::settings::{
    Problems, Range, Rule, Setting,
    Value::{F32, U8},
    check, rules,
};

/// Most levels of the pyramid.
pub const MAX_LEVELS: u8 = 4;

/// Settings of the depth tracker. [`IcpConfig::SETTINGS`] has their ranges.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(default, deny_unknown_fields)
)]
pub struct IcpConfig {
    /// Levels of the pyramid, the finest at half the image's size.
    pub levels: u8,
    /// Most steps of a level.
    pub steps: u8,
    /// Distance up to which a point is paired with the map on the finest level, m.
    pub distance_m: f32,
    /// Noise of a disparity, px.
    pub noise_px: f32,
    /// Least share of the points in view of the map that must be paired in the end.
    pub pairs_min: f32,
    /// Largest motion between two frames, m.
    pub step_max_m: f32,
}

impl Default for IcpConfig {
    fn default() -> Self {
        Self {
            levels: 3,
            steps: 10,
            distance_m: 0.1,
            noise_px: 0.0,
            pairs_min: 0.25,
            step_max_m: 2.0,
        }
    }
}

type Row = Setting<IcpConfig>;

impl IcpConfig {
    /// One row per setting.
    pub const SETTINGS: &'static [Row] = &[
        Row::expert("icp.levels", "", |c| U8(&mut c.levels))
            .range(Range::Within(1.0, MAX_LEVELS as f32))
            .text("Levels of the pyramid, the finest at half the image's size."),
        Row::expert("icp.steps", "", |c| U8(&mut c.steps))
            .range(Range::Within(1.0, 50.0))
            .text("Most steps of a level."),
        Row::user("icp.distance_m", "m", |c| F32(&mut c.distance_m)).range(Range::POSITIVE).text(
            "Distance up to which a point is paired with the map on the finest level; it doubles \
             with every coarser one. The default is InfiniTAM's.",
        ),
        Row::user("icp.noise_px", "px", |c| F32(&mut c.noise_px)).range(Range::NOT_NEGATIVE).text(
            "Noise of a disparity: a point may be off by three times what that is in depth, and \
             weighs by it. 0 as in InfiniTAM, which was made for cameras of another kind. With 0.3 \
             it follows the synthetic street, and slides on a real one.",
        ),
        Row::expert("icp.pairs_min", "", |c| F32(&mut c.pairs_min))
            .range(Range::SHARE)
            .text("Least share of the points in view of the map that must be paired in the end."),
        Row::user("icp.step_max_m", "m", |c| F32(&mut c.step_max_m))
            .range(Range::POSITIVE)
            .text("Largest motion between two frames."),
    ];

    pub(crate) const CHECKS: &'static [Rule<Self>] =
        &rules::<_, { Self::SETTINGS.len() }>(Self::SETTINGS);

    /// Notes everything wrong with the settings.
    pub fn validate(&self, problems: &mut Problems) {
        check(Self::CHECKS, self, problems);
    }
}
