//! Rows of the settings of tracking.

use super::{Overlap, TrackingConfig};
use crate::settings::{
    Range, Relation, Rule, Setting,
    Value::{Bool, Choice, F32, U8, U16, U32},
    choices, rules,
};

choices! { Overlap { "mask" = Mask, "box" = Box } }

/// Largest area of a box that can be asked for, px.
const AREA: Range = Range::Within(0.0, 1_048_576.0);
/// Range of numbers of matches.
const MATCHES: Range = Range::Within(6.0, 1000.0);
/// Range of numbers of frames that confirm a state.
const FRAMES: Range = Range::Within(1.0, 100.0);

type Row = Setting<TrackingConfig>;

impl TrackingConfig {
    /// One row per setting.
    pub const SETTINGS: &'static [Row] = &[
        Row::user("tracking.dynamic", "", |c| Bool(&mut c.dynamic)).text(
            "Objects that may move are kept out of the static map. Without, everything goes into \
             one map (the paper's robust odometry baseline).",
        ),
        Row::user("tracking.frame_interval_s", "s", |c| F32(&mut c.frame_interval_s))
            .range(Range::POSITIVE)
            .text("Time between two frames; a run sets it by its data set."),
        Row::user("tracking.instances.score_min", "", |c| F32(&mut c.instances.score_min))
            .range(Range::SHARE)
            .text("Least score of a detection; others are ignored."),
        Row::user("tracking.instances.area_min_px", "px", |c| {
            U32(&mut c.instances.area_min_px)
        })
        .range(AREA)
        .text(
            "A detection's box must be larger than this to be reconstructed, and to be kept out of \
             the static map in every state, at an image width of 1242; at other widths in \
             proportion to the width squared.",
        ),
        Row::user("tracking.instances.track_area_min_px", "px", |c| {
            U32(&mut c.instances.track_area_min_px)
        })
        .range(AREA)
        .published("as `area_min_px`")
        .text(
            "A detection's box must be larger than this to be tracked, and kept out of the static \
             map once it is known to move. The default is what 18 matches take, 7 px apart.",
        ),
        Row::expert("tracking.tracks.overlap", "", |c| Choice(&mut c.tracks.overlap))
            .published("box")
            .text(
                "Intersection over union by which a detection is associated with a track: that of \
                 masks or of boxes.",
            ),
        Row::expert("tracking.tracks.association_min", "", |c| F32(&mut c.tracks.association_min))
            .range(Range::SHARE)
            .text(
                "Overlap times the geometric mean of both scores times the discount for frames \
                 missed must be above this.",
            ),
        Row::expert("tracking.tracks.extent_frames", "frames", |c| U16(&mut c.tracks.extent_frames))
            .range(Range::Within(0.0, 1000.0))
            .published("0")
            .text(
                "Frames without a detection over which a track is found again by how far it \
                 reached when it was last seen whole; 0 never.",
            ),
        Row::user("tracking.tracks.forget_frames", "frames", |c| U16(&mut c.tracks.forget_frames))
            .range(Range::Within(1.0, 10_000.0))
            .text("Frames after which a track not detected again is forgotten."),
        Row::expert("tracking.matches.large_share", "", |c| F32(&mut c.matches.large_share))
            .range(Range::SHARE)
            .published("1")
            .text(
                "Share of the image beyond which an object of unknown state is kept out of the \
                 camera's egomotion.",
            ),
        Row::expert("tracking.motion.matches_min", "", |c| U16(&mut c.motion.matches_min))
            .range(MATCHES)
            .published("18")
            .text("Fewest matches for a first motion."),
        Row::expert("tracking.motion.matches_again", "", |c| U16(&mut c.motion.matches_again))
            .range(MATCHES)
            .published("18")
            .text("Fewest matches once a motion is known."),
        Row::expert("tracking.motion.samples", "", |c| U16(&mut c.motion.samples))
            .range(Range::Within(1.0, 10_000.0))
            .published("500")
            .text("Most hypotheses."),
        Row::user("tracking.motion.speed_m_s", "m/s", |c| F32(&mut c.motion.speed_m_s))
            .range(Range::POSITIVE)
            .text("Speed of an object when first detected, one sigma."),
        Row::user("tracking.motion.bias_px", "px", |c| F32(&mut c.motion.bias_px))
            .range(Range::NOT_NEGATIVE)
            .text(
                "By how much all disparities may be too small. To a moving camera a static object \
                 then seems to move, by twice this share of its disparity of the speed it passes \
                 by.",
            ),
        Row::user("tracking.motion.lens_px", "px", |c| F32(&mut c.motion.lens_px))
            .range(Range::NOT_NEGATIVE)
            .text(
                "By how much disparities may be too small at the left and right edge of the \
                 picture, by the lens distortion that rectification left. It grows with the fourth \
                 power of the distance from the middle. The default is that of KITTI's colour \
                 cameras, as parked cars 30 m away show.",
            ),
        Row::user("tracking.motion.camera_rad", "rad", |c| F32(&mut c.motion.camera_rad))
            .range(Range::NOT_NEGATIVE)
            .text(
                "Error of the camera's own rotation per frame, one sigma: at a distance it looks \
                 like speed.",
            ),
        Row::user("tracking.state.dynamic_m_s", "m/s", |c| F32(&mut c.state.dynamic_m_s))
            .range(Range::POSITIVE)
            .relation(&Relation {
                holds: |c| c.state.dynamic_m_s >= c.state.static_m_s,
                rule: "must be at least tracking.state.static_m_s",
            })
            .published("5.5 (0.55 m a frame), in its experiments 2")
            .text("An object that is certainly faster is dynamic."),
        Row::expert("tracking.state.static_m_s", "m/s", |c| F32(&mut c.state.static_m_s))
            .range(Range::POSITIVE)
            .text(
                "An object that is possibly slower than this, and likely slower than `slow_m_s`, \
                 is static.",
            ),
        Row::user("tracking.state.slow_m_s", "m/s", |c| F32(&mut c.state.slow_m_s))
            .range(Range::POSITIVE)
            .relation(&Relation {
                holds: |c| c.state.slow_m_s >= c.state.static_m_s,
                rule: "must be at least tracking.state.static_m_s",
            })
            .text(
                "An object that is not known to move is static only if it is likely slower than \
                 this: slower than a pedestrian. A dynamic object becomes static only if it is \
                 likely slower than `dynamic_m_s`.",
            ),
        Row::expert("tracking.state.confirm_frames", "frames", |c| U8(&mut c.state.confirm_frames))
            .range(FRAMES)
            .published("1")
            .text("Consecutive frames that confirm an uncertain object as dynamic."),
        Row::expert("tracking.state.confirm_static_frames", "frames", |c| {
            U8(&mut c.state.confirm_static_frames)
        })
        .range(FRAMES)
        .published("1")
        .text(
            "Consecutive frames that confirm an uncertain object as static: after 2 the filter has \
             averaged over several frames.",
        ),
        Row::expert("tracking.state.dynamic_frames", "frames", |c| U8(&mut c.state.dynamic_frames))
            .range(Range::Within(0.0, 255.0))
            .published("1, in its experiments 2")
            .text(
                "Frames without a motion over which a dynamic object stays dynamic: the filter \
                 predicts its motion.",
            ),
    ];

    pub(crate) const CHECKS: &'static [Rule<Self>] =
        &rules::<_, { Self::SETTINGS.len() }>(Self::SETTINGS);
}
