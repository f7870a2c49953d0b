//! Rows of the settings of a town.

use super::config::TownConfig;
use dynvox_core::settings::{
    Range, Rule, Setting,
    Value::{Bool, F64, Number, U32},
    rules,
};

type Row = Setting<TownConfig>;

impl TownConfig {
    /// One row per setting.
    pub const SETTINGS: &'static [Row] = &[
        Row::user("town.blocks", "blocks", |c| U32(&mut c.blocks))
            .range(Range::Within(1.0, 16.0))
            .text(
                "Blocks along each side of the loop: it is about 240 m long with one, and 256 m \
                 longer with each more.",
            ),
        Row::user("town.laps", "laps", |c| F64(&mut c.laps))
            .range(Range::Within(0.01, 100.0))
            .text("Laps of the recording."),
        Row::user("town.recording", "", |c| U32(&mut c.recording)).text(
            "Number of the recording: chooses parked cars, traffic, noise and the camera's small \
             motions; houses, trees and signs stay.",
        ),
        Row::user("town.reverse", "", |c| Bool(&mut c.reverse))
            .text("The loop driven the other way round, in the lane on the other side."),
        Row::user("town.lane_shift_m", "m", |c| F64(&mut c.lane_shift_m))
            .range(Range::Within(-1.0, 3.5))
            .text("Shift of the camera to the left of its lane's middle."),
        Row::user("town.sun_turn_deg", "degrees", |c| F64(&mut c.sun_turn_deg))
            .range(Range::Within(-360.0, 360.0))
            .text("Turn of the sun about the vertical."),
        Row::user("town.twins", "", |_| Number(None)).text(
            "Houses that look the same: `none`; `streets` (opposite sides of the loop, half a turn \
             apart); `houses` (all of them, wall to wall).",
        ),
    ];

    pub(super) const CHECKS: &'static [Rule<Self>] =
        &rules::<_, { Self::SETTINGS.len() }>(Self::SETTINGS);
}
