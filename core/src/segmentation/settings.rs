//! Rows of the settings of motion segmentation.

use super::SegmentationConfig;
use crate::settings::{
    Range, Rule, Setting,
    Value::{Bool, F32, U8},
    rules,
};

type Row = Setting<SegmentationConfig>;

impl SegmentationConfig {
    /// One row per setting.
    pub const SETTINGS: &'static [Row] = &[
        Row::user("segmentation.enabled", "", |c| Bool(&mut c.enabled))
            .text("Moving objects are searched for by their motion."),
        Row::user("segmentation.far_m", "m", |c| F32(&mut c.far_m))
            .range(Range::POSITIVE)
            .text("Farthest depth searched."),
        Row::expert("segmentation.erase_frames", "frames", |c| {
            U8(&mut c.erase_frames)
        })
        .range(Range::Within(0.0, 30.0))
        .text(
            "Frames before an object was known to move, over which what it left in the static map \
             is erased; 0 is off.",
        ),
    ];

    pub(crate) const CHECKS: &'static [Rule<Self>] =
        &rules::<_, { Self::SETTINGS.len() }>(Self::SETTINGS);
}
