//! Parameters of rooms and yards, and all their defaults.

use dynvox_core::settings::{Problems, check};
use serde::{Deserialize, Serialize};

use crate::synth::inertial_unit::StreetUnit;
use crate::synth::lens::{RigError, StreetLens};

/// Kind of room: under a ceiling or in the open.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum RoomKind {
    /// A furnished room; a corridor where the path is one.
    #[default]
    Room,
    /// A yard between houses, hedges and fences.
    Yard,
}

/// Path of the camera.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RoomPath {
    /// In a hand that walks round and round, with the bob and sway of steps.
    #[default]
    Handheld,
    /// On a drone that tilts as it gathers speed, round and round.
    Drone,
    /// In a hand that stands.
    Stand,
    /// In a hand that stands and turns from one side to the other.
    Turn,
    /// In a hand that walks along a corridor and back.
    Corridor,
}

/// A synthetic room or yard: its looks, its people and its cameras.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RoomConfig {
    /// Chooses sizes, walls, furniture, people, path and noise.
    pub seed: u64,
    /// Image width, px.
    pub width: u32,
    /// Image height, px.
    pub height: u32,
    /// Frames a writer or a run takes; the path has no end.
    pub frames: u32,
    /// Frames a second, Hz.
    pub rate_hz: f64,
    /// Focal length, px; 0.6 of the width when absent.
    pub focal_px: Option<f64>,
    /// Distance between the cameras, m.
    pub baseline_m: f64,
    /// Path of the camera.
    pub path: RoomPath,
    /// Mean speed along the path, m/s.
    pub speed_m_s: f64,
    /// Fastest turn to the sides, degrees/s: the camera looks to one side and the other once in
    /// four seconds; 0 looks ahead.
    pub turn_deg_s: f64,
    /// Strength of the hand's bob, sway and tremor; 1 is a hand, 0 is none.
    pub shake: f64,
    /// People who walk about.
    pub people: u32,
    /// Share of walls without texture.
    pub bare_walls: f64,
    /// Time for which the shutter is open, s: what moves in it is blurred; 0 is an instant.
    pub shutter_s: f64,
    /// Change of the light: its share above and below the mean, once up and down in 6 s.
    pub light_swing: f64,
    /// Noise of one colour channel at mid grey, grey levels (1 sigma).
    pub noise_sigma: f64,
    /// Difference in brightness of the right camera, as a share of the light.
    pub gain_difference: f64,
    /// The lens of both cameras. With one, images come raw; depth, masks and poses stay those of
    /// the ideal rig they are rectified to.
    pub lens: StreetLens,
    /// Misalignment of the right camera relative to its calibration.
    pub rig_error: RigError,
    /// Inertial unit of the camera.
    pub inertial: Option<StreetUnit>,
}

impl Default for RoomConfig {
    fn default() -> Self {
        Self {
            seed: 1,
            width: 640,
            height: 400,
            frames: 200,
            rate_hz: 20.0,
            focal_px: None,
            baseline_m: 0.08,
            path: RoomPath::default(),
            speed_m_s: 0.8,
            turn_deg_s: 40.0,
            shake: 1.0,
            people: 1,
            bare_walls: 0.25,
            shutter_s: 0.0,
            light_swing: 0.0,
            noise_sigma: 1.6,
            gain_difference: 0.01,
            lens: StreetLens::Ideal,
            rig_error: RigError::default(),
            inertial: None,
        }
    }
}

impl RoomConfig {
    /// Focal length in use, px.
    pub fn focal_px(&self) -> f64 {
        self.focal_px.unwrap_or(0.6 * f64::from(self.width))
    }

    /// The first problem of the figures, in one sentence.
    pub fn problem(&self) -> Option<String> {
        let mut problems = Problems::new();
        check(Self::CHECKS, self, &mut problems);
        let unit = || self.inertial.and_then(|unit| unit.problem("room"));
        problems.first().map(ToString::to_string).or_else(unit)
    }
}
