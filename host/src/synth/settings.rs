//! Rows of the settings of the street.

use super::{MovingTraffic, StreetConfig, Traffic};
use dynvox_core::settings::{
    Range, Relation, Rule, Setting,
    Value::{Bool, F64, Number, U32},
    rules,
};

/// Range of images' sides, px.
const SIDE: Range = Range::Within(32.0, 8192.0);
/// Range of shifts of the right images, px.
const SHIFT: Range = Range::Within(-20.0, 20.0);
/// Range of turns of the right camera, degrees.
const TURN: Range = Range::Within(-10.0, 10.0);

/// A number of the moving traffic, if there is any.
fn traffic(config: &StreetConfig, number: fn(&MovingTraffic) -> f64) -> Option<f64> {
    match &config.traffic {
        Traffic::None => None,
        Traffic::Moving(moving) => Some(number(moving)),
    }
}

/// Tells whether a distance between cars is none, or wide enough for them.
fn is_gap(gap_m: Option<f64>) -> bool {
    gap_m.is_none_or(|gap_m| gap_m == 0.0 || (30.0..=1e6).contains(&gap_m))
}

type Row = Setting<StreetConfig>;

impl StreetConfig {
    /// One row per setting.
    pub const SETTINGS: &'static [Row] = &[
        Row::user("street.seed", "", |c| Number(Some(c.seed as f64)))
            .text("Chooses the street: houses, cars, trees, bends, noise."),
        Row::user("street.width", "px", |c| U32(&mut c.width)).range(SIDE).text("Image width."),
        Row::user("street.height", "px", |c| U32(&mut c.height)).range(SIDE).text("Image height."),
        Row::user("street.frames", "frames", |c| U32(&mut c.frames))
            .text("Frames that a writer or a run takes; the street itself is endless."),
        Row::user("street.rate_hz", "Hz", |c| F64(&mut c.rate_hz))
            .range(Range::POSITIVE)
            .text("Frames a second."),
        Row::expert("street.focal_px", "px", |c| Number(c.focal_px))
            .range(Range::POSITIVE)
            .text("Focal length; 0.58 of the width, as KITTI's, when absent."),
        Row::expert("street.baseline_m", "m", |c| F64(&mut c.baseline_m))
            .range(Range::POSITIVE)
            .text("Distance between the cameras."),
        Row::user("street.speed_m_s", "m/s", |c| F64(&mut c.speed_m_s))
            .range(Range::Within(0.0, 60.0))
            .text(
                "Speed of the camera along the street. The camera never brakes: scripted cars in \
                 its lane must be faster or leave it.",
            ),
        Row::expert("street.curvature", "", |c| Bool(&mut c.curvature))
            .text("A street that bends; straight on otherwise."),
        Row::expert("street.hills", "", |c| F64(&mut c.hills)).range(Range::Within(0.0, 0.3)).text(
            "Steepest rise of the street, rise over run: it goes up and down once in 60 m; 0 is \
             level.",
        ),
        Row::expert("street.shake", "", |c| F64(&mut c.shake))
            .range(Range::Within(0.0, 5.0))
            .text("Scale of the camera's pitch, roll and bounce; 0 is a rail."),
        Row::expert("street.sway_deg_s", "degrees/s", |c| F64(&mut c.sway_deg_s))
            .range(Range::Within(0.0, 250.0))
            .text(
                "Fastest turn of the camera to the sides: it looks to one side and the other once \
                 in two seconds; 0 looks ahead.",
            ),
        Row::expert("street.noise_sigma", "grey levels", |c| F64(&mut c.noise_sigma))
            .range(Range::Within(0.0, 50.0))
            .text(
                "Noise of one colour channel at mid grey, one sigma: half the variance is read \
                 noise, half shot noise; 0 is off.",
            ),
        Row::expert("street.gain_difference", "", |c| F64(&mut c.gain_difference))
            .range(Range::Within(-0.5, 0.5))
            .text("Brightness of the right camera above that of the left, share of the light."),
        Row::expert("street.parked_density", "", |c| F64(&mut c.parked_density))
            .range(Range::SHARE)
            .text("Share of parking spaces that are taken."),
        Row::expert("street.lens.model", "", |_| Number(None)).text(
            "Lens of the cameras: `ideal` (rectified pinholes); `radial_tangential`, \
             `equidistant`, `double_sphere` or `extended_unified` with that model's parameters: \
             then pairs are raw.",
        ),
        Row::expert("street.rig_error.disparity_offset_px", "px", |c| {
            F64(&mut c.rig_error.disparity_offset_px)
        })
        .range(SHIFT)
        .text("Shift of right images to the right: what must be added to disparities."),
        Row::expert("street.rig_error.vertical_shift_px", "px", |c| {
            F64(&mut c.rig_error.vertical_shift_px)
        })
        .range(SHIFT)
        .text("Shift of right images down."),
        Row::expert("street.rig_error.roll_deg", "degrees", |c| F64(&mut c.rig_error.roll_deg))
            .range(TURN)
            .text("Clockwise rotation of right images about the principal point."),
        Row::expert("street.rig_error.pitch_deg", "degrees", |c| F64(&mut c.rig_error.pitch_deg))
            .range(TURN)
            .text("Upward pitch of the right camera."),
        Row::expert("street.inertial", "", |_| Number(None)).text(
            "Inertial unit of the camera, with the keys of \
             [your inertial unit](inertial.md#the-synthetic-street): rate_hz (0: no unit), \
             turn_noise, force_noise, turn_bias_rad_s, force_bias_m_s2, clock_offset_s, gap_s, fault.",
        ),
        Row::user("street.traffic.mode", "", |_| Number(None)).text(
            "Traffic besides the camera: `moving` (scripted cars and a thin endless flow) or \
             `none` (parked cars only).",
        ),
        Row::expert("street.traffic.oncoming_gap_m", "m", |c| {
            Number(traffic(c, |moving| moving.oncoming_gap_m))
        })
        .relation(&Relation {
            holds: |c| is_gap(traffic(c, |moving| moving.oncoming_gap_m)),
            rule: "must be 0 (no such cars) or at least 30",
        })
        .text("Mean distance between oncoming cars; 0 for none."),
        Row::expert("street.traffic.overtaking_gap_m", "m", |c| {
            Number(traffic(c, |moving| moving.overtaking_gap_m))
        })
        .relation(&Relation {
            holds: |c| is_gap(traffic(c, |moving| moving.overtaking_gap_m)),
            rule: "must be 0 (no such cars) or at least 30",
        })
        .text("Mean distance between overtaking cars; 0 for none."),
        Row::expert("street.traffic.cars", "", |_| Number(None))
            .text("Cars with a script of their own."),
    ];

    pub(super) const CHECKS: &'static [Rule<Self>] =
        &rules::<_, { Self::SETTINGS.len() }>(Self::SETTINGS);
}
