//! Parameters of a town and their defaults. Camera, size of images, noise, seed and parked cars are
//! those of the street.

use dynvox_core::settings::{Problems, check};
use serde::{Deserialize, Serialize};

/// Houses of a town that look the same.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum TownTwins {
    /// Each house is one of its kind.
    #[default]
    None,
    /// Opposite sides of the loop are the same, houses, trees and furniture, half a turn apart:
    /// the camera sees the same street twice in a lap.
    Streets,
    /// All houses of the town are the same one, wall to wall.
    Houses,
}

/// A town's blocks and drives.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct TownConfig {
    /// Blocks along each side of the loop: it is about 240 m long with one, and 256 m longer with
    /// each more.
    pub blocks: u32,
    /// Laps of the recording.
    pub laps: f64,
    /// Number of the recording: chooses parked cars, traffic, noise and the camera's small motions.
    pub recording: u32,
    /// True if the loop is driven the other way round, in the lane on the other side.
    pub reverse: bool,
    /// Shift of the camera to the left of its lane's middle, m.
    pub lane_shift_m: f64,
    /// Turn of the sun about the vertical, degrees.
    pub sun_turn_deg: f64,
    /// Houses that look the same.
    pub twins: TownTwins,
}

impl Default for TownConfig {
    fn default() -> Self {
        Self {
            blocks: 1,
            laps: 2.0,
            recording: 0,
            reverse: false,
            lane_shift_m: 0.0,
            sun_turn_deg: 0.0,
            twins: TownTwins::None,
        }
    }
}

impl TownConfig {
    /// The first problem of the figures, in one sentence.
    pub fn problem(&self) -> Option<String> {
        let mut problems = Problems::new();
        check(Self::CHECKS, self, &mut problems);
        problems.first().map(ToString::to_string)
    }
}
