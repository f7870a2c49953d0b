//! Rows of the settings of rooms and yards.

use super::config::RoomConfig;
use dynvox_core::settings::{
    Range, Rule, Setting,
    Value::{F64, Number, U32},
    rules,
};

/// Range of images' sides, px.
const SIDE: Range = Range::Within(32.0, 8192.0);

type Row = Setting<RoomConfig>;

impl RoomConfig {
    /// One row per setting.
    pub const SETTINGS: &'static [Row] = &[
        Row::user("room.seed", "", |c| Number(Some(c.seed as f64)))
            .text("Chooses sizes, walls, furniture, people, path and noise of a room or yard."),
        Row::user("room.width", "px", |c| U32(&mut c.width)).range(SIDE).text("Image width."),
        Row::user("room.height", "px", |c| U32(&mut c.height)).range(SIDE).text("Image height."),
        Row::user("room.frames", "frames", |c| U32(&mut c.frames))
            .text("Frames that a writer or a run takes; the path has no end."),
        Row::user("room.rate_hz", "Hz", |c| F64(&mut c.rate_hz))
            .range(Range::POSITIVE)
            .text("Frames a second."),
        Row::expert("room.focal_px", "px", |c| Number(c.focal_px))
            .range(Range::POSITIVE)
            .text("Focal length; 0.6 of the width when absent."),
        Row::user("room.baseline_m", "m", |c| F64(&mut c.baseline_m))
            .range(Range::POSITIVE)
            .text("Distance between the cameras."),
        Row::user("room.path", "", |_| Number(None)).text(
            "Path of the camera: `handheld` and `drone` go round and round, `corridor` along one \
             and back, `stand` and `turn` stay in place.",
        ),
        Row::user("room.speed_m_s", "m/s", |c| F64(&mut c.speed_m_s))
            .range(Range::Within(0.05, 10.0))
            .text("Mean speed along the path."),
        Row::user("room.turn_deg_s", "degrees/s", |c| F64(&mut c.turn_deg_s))
            .range(Range::Within(0.0, 250.0))
            .text(
                "Fastest turn to the sides: the camera looks to one side and the other once in \
                 four seconds; 0 looks ahead.",
            ),
        Row::expert("room.shake", "", |c| F64(&mut c.shake))
            .range(Range::Within(0.0, 5.0))
            .text("Strength of the hand's bob, sway and tremor; 0 is none."),
        Row::user("room.people", "", |c| U32(&mut c.people))
            .range(Range::Within(0.0, 4.0))
            .text("People who walk about."),
        Row::user("room.bare_walls", "", |c| F64(&mut c.bare_walls))
            .range(Range::SHARE)
            .text("Share of walls without texture."),
        Row::expert("room.shutter_s", "s", |c| F64(&mut c.shutter_s))
            .range(Range::Within(0.0, 0.1))
            .text(
                "Time for which the shutter is open: what moves in it is blurred; 0 is an \
                 instant. Rendering takes five times as long with it.",
            ),
        Row::expert("room.light_swing", "", |c| F64(&mut c.light_swing))
            .range(Range::Within(0.0, 0.9))
            .text("Change of the light: its share above and below the mean, once in 6 s."),
        Row::expert("room.noise_sigma", "grey levels", |c| F64(&mut c.noise_sigma))
            .range(Range::Within(0.0, 50.0))
            .text("Noise of one colour channel at mid grey, one sigma; 0 is off."),
        Row::expert("room.gain_difference", "", |c| F64(&mut c.gain_difference))
            .range(Range::Within(-0.5, 0.5))
            .text("Brightness of the right camera above that of the left, share of the light."),
        Row::expert("room.lens.model", "", |_| Number(None))
            .text("Lens of the cameras, with the keys of `street.lens`: with one, pairs are raw."),
        Row::expert("room.rig_error.disparity_offset_px", "px", |c| {
            F64(&mut c.rig_error.disparity_offset_px)
        })
        .range(Range::Within(-20.0, 20.0))
        .text(
            "Shift of right images to the right; the other keys are those of `street.rig_error`.",
        ),
        Row::expert("room.inertial", "", |_| Number(None)).text(
            "Inertial unit of the camera, with the keys of \
             [your inertial unit](inertial.md#the-synthetic-street).",
        ),
    ];

    pub(super) const CHECKS: &'static [Rule<Self>] =
        &rules::<_, { Self::SETTINGS.len() }>(Self::SETTINGS);
}
