//! Rows of the settings of motion segmentation.

use super::SegmentationConfig;
use crate::settings::{
    Range, Rule, Setting,
    Value::{Bool, F32, U8, U16},
    rules,
};

type Row = Setting<SegmentationConfig>;

impl SegmentationConfig {
    /// One row per setting.
    pub const SETTINGS: &'static [Row] = &[
        Row::user("segmentation.enabled", "", |c| Bool(&mut c.enabled))
            .text("Moving objects are searched for by their motion."),
        Row::expert("segmentation.noise_px", "px", |c| F32(&mut c.noise_px))
            .range(Range::POSITIVE)
            .text("Error of a match coordinate, one sigma."),
        Row::expert("segmentation.disparity_noise_px", "px", |c| {
            F32(&mut c.disparity_noise_px)
        })
        .range(Range::POSITIVE)
        .text("Error of a disparity, one sigma."),
        Row::expert("segmentation.camera_m", "m", |c| F32(&mut c.camera_m))
            .range(Range::NOT_NEGATIVE)
            .text("Error of the camera's translation in a frame, one sigma."),
        Row::expert("segmentation.camera_rad", "rad", |c| {
            F32(&mut c.camera_rad)
        })
        .range(Range::NOT_NEGATIVE)
        .text("Error of the camera's rotation in a frame, one sigma."),
        Row::expert("segmentation.candidate_chi_square", "", |c| {
            F32(&mut c.candidate_chi_square)
        })
        .range(Range::POSITIVE)
        .text(
            "Squared Mahalanobis distance from the static prediction beyond which a match is a \
             candidate. The default is chi-square, 3 degrees of freedom, 0.1 %.",
        ),
        Row::user("segmentation.far_m", "m", |c| F32(&mut c.far_m))
            .range(Range::POSITIVE)
            .text("Farthest depth searched."),
        Row::expert("segmentation.members_min", "", |c| {
            U16(&mut c.members_min)
        })
        .range(Range::Within(3.0, 1000.0))
        .text("Fewest members of a group."),
        Row::expert("segmentation.far_members_min", "", |c| {
            U16(&mut c.far_members_min)
        })
        .range(Range::Within(3.0, 1000.0))
        .text("Fewest members of a group beyond `sparse_from_m`."),
        Row::expert("segmentation.sparse_from_m", "m", |c| {
            F32(&mut c.sparse_from_m)
        })
        .range(Range::NOT_NEGATIVE)
        .text("Depth from which on groups are smaller."),
        Row::expert("segmentation.candidate_share_min", "", |c| {
            F32(&mut c.candidate_share_min)
        })
        .range(Range::SHARE)
        .text("Least share of candidates among all matches within a group's box."),
        Row::expert("segmentation.motion_min_m", "m", |c| {
            F32(&mut c.motion_min_m)
        })
        .range(Range::NOT_NEGATIVE)
        .text(
            "Least motion of a group in a frame; 0.0008 m for each square metre of squared depth \
             comes on top.",
        ),
        Row::expert("segmentation.confirm_frames", "frames", |c| {
            U8(&mut c.confirm_frames)
        })
        .range(Range::Within(1.0, 3.0))
        .text(
            "Of the last three frames, in how many a group's motion must agree before it is an \
             object.",
        ),
        Row::expert("segmentation.predict_frames", "frames", |c| {
            U8(&mut c.predict_frames)
        })
        .range(Range::Within(0.0, 10.0))
        .text("Frames without a group over which an object's mask is predicted."),
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
