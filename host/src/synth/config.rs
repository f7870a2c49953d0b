//! The street's parameters and all their defaults.

use dynvox_core::settings::{Problems, check};
use serde::{Deserialize, Serialize};

use super::inertial_unit::StreetUnit;
use super::lens::{RigError, StreetLens};

/// The synthetic street's appearance, its traffic and its cameras.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct StreetConfig {
    /// Chooses the street: houses, cars, trees, bends, noise.
    pub seed: u64,
    /// Image width, px.
    pub width: u32,
    /// Image height, px.
    pub height: u32,
    /// Frames a writer or a run takes; the street itself is endless.
    pub frames: u32,
    /// Frames a second, Hz.
    pub rate_hz: f64,
    /// Focal length, px; 0.58 of the width, as KITTI's, when absent.
    pub focal_px: Option<f64>,
    /// Distance between the cameras, m.
    pub baseline_m: f64,
    /// Speed of the camera along the street, m/s. The camera never brakes: scripted cars in its
    /// lane must be faster or leave it.
    pub speed_m_s: f64,
    /// True if the street bends; it is straight otherwise.
    pub curvature: bool,
    /// Steepest rise of the street, rise over run: it goes up and down once in 60 m; 0 is
    /// level.
    pub hills: f64,
    /// Scale of the camera's pitch, roll and bounce; 0 is a rail.
    pub shake: f64,
    /// Fastest turn to the sides, degrees/s: the camera looks to one side and the other once in two
    /// seconds; 0 looks ahead.
    pub sway_deg_s: f64,
    /// Noise of one colour channel at mid grey, grey levels (1 sigma): half the variance is read
    /// noise, half shot noise; 0 is off.
    pub noise_sigma: f64,
    /// Difference in brightness of the right camera, as a share of the light.
    pub gain_difference: f64,
    /// Share of parking spaces that are taken.
    pub parked_density: f64,
    /// The lens of both cameras. With one, images come raw; depth, masks and poses stay those of
    /// the ideal rig they are rectified to.
    pub lens: StreetLens,
    /// Misalignment of the right camera relative to its calibration.
    pub rig_error: RigError,
    /// Inertial unit of the camera.
    pub inertial: Option<StreetUnit>,
    /// Traffic on the street.
    pub traffic: Traffic,
}

impl Default for StreetConfig {
    fn default() -> Self {
        Self {
            seed: 1,
            width: 640,
            height: 192,
            frames: 120,
            rate_hz: 10.0,
            focal_px: None,
            baseline_m: 0.54,
            speed_m_s: 9.0,
            curvature: true,
            hills: 0.0,
            shake: 1.0,
            sway_deg_s: 0.0,
            noise_sigma: 1.6,
            gain_difference: 0.03,
            parked_density: 0.6,
            lens: StreetLens::Ideal,
            rig_error: RigError::default(),
            inertial: None,
            traffic: Traffic::default(),
        }
    }
}

impl StreetConfig {
    /// Returns the street without traffic: parked cars only.
    pub fn static_street() -> Self {
        Self { traffic: Traffic::None, ..Self::default() }
    }

    /// Focal length in use, px.
    pub fn focal_px(&self) -> f64 {
        self.focal_px.unwrap_or(0.58 * f64::from(self.width))
    }

    /// The first problem of the figures, in one sentence.
    pub fn problem(&self) -> Option<String> {
        let mut problems = Problems::new();
        check(Self::CHECKS, self, &mut problems);
        let unit = || self.inertial.and_then(|unit| unit.problem("street"));
        problems.first().map(ToString::to_string).or_else(unit).or_else(|| self.traffic.problem())
    }
}

/// Traffic on the street besides the camera.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "mode", rename_all = "snake_case")]
pub enum Traffic {
    /// A static street with parked cars.
    None,
    /// Scripted cars and a thin endless flow.
    Moving(MovingTraffic),
}

impl Default for Traffic {
    fn default() -> Self {
        Self::Moving(MovingTraffic::default())
    }
}

impl Traffic {
    fn problem(&self) -> Option<String> {
        let Self::Moving(moving) = self else { return None };
        // 60 m/s is 216 km/h: faster cars leave the rendered span within a frame or two.
        if moving.cars.iter().any(|car| !(0.0..=60.0).contains(&car.profile.speed_m_s())) {
            return Some("a speed in street.traffic lies outside 0 to 60 m/s".to_owned());
        }
        // A rate of zero would never reach the speed.
        moving.cars.iter().find_map(|car| match car.profile {
            SpeedProfile::Starting { acceleration_m_s2: rate, .. }
            | SpeedProfile::Stopping { deceleration_m_s2: rate, .. }
                if !(rate.is_finite() && rate > 0.0) =>
            {
                Some(format!(
                    "an acceleration in street.traffic is {rate}; it must be a positive \
                              number of m/s²"
                ))
            }
            _ if !car.start_m.is_finite() => Some(
                "a start_m in street.traffic is not a \
                number"
                    .to_owned(),
            ),
            _ => None,
        })
    }
}

/// Moving traffic: a script and a flow.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct MovingTraffic {
    /// Mean distance between oncoming cars, m; 0 for none.
    pub oncoming_gap_m: f64,
    /// Mean distance between overtaking cars, m; 0 for none.
    pub overtaking_gap_m: f64,
    /// Cars with a script of their own.
    pub cars: Vec<ScriptedCar>,
}

impl Default for MovingTraffic {
    fn default() -> Self {
        let car = |kind, lane, to_lane, start_m, profile| ScriptedCar {
            kind,
            lane,
            to_lane,
            start_m,
            profile,
        };
        Self {
            oncoming_gap_m: 70.0,
            // One car of each behaviour that a tracker has to tell apart: constant, starting,
            // stopping.
            overtaking_gap_m: 90.0,
            cars: vec![
                car(
                    CarKind::Hatchback,
                    Lane::Ego,
                    None,
                    40.0,
                    SpeedProfile::Constant { speed_m_s: 12.0 },
                ),
                car(
                    CarKind::Saloon,
                    Lane::ParkedRight,
                    Some(Lane::Ego),
                    80.0,
                    SpeedProfile::Starting { frame: 45, speed_m_s: 11.0, acceleration_m_s2: 2.2 },
                ),
                car(
                    CarKind::Estate,
                    Lane::Ego,
                    Some(Lane::ParkedRight),
                    95.0,
                    SpeedProfile::Stopping { frame: 70, speed_m_s: 8.0, deceleration_m_s2: 2.0 },
                ),
            ],
        }
    }
}

/// One car with a script.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ScriptedCar {
    /// Body of the car.
    pub kind: CarKind,
    /// Lane at frame 0.
    pub lane: Lane,
    /// Lane the car changes to: at once when it starts driving, just before it stands when it
    /// stops. It has the direction of `lane`.
    #[serde(default)]
    pub to_lane: Option<Lane>,
    /// Distance ahead of the camera's start at frame 0, m along the street.
    pub start_m: f64,
    /// Speed over time.
    pub profile: SpeedProfile,
}

/// Speed over time; oncoming lanes drive towards the camera's start.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "profile", rename_all = "snake_case", deny_unknown_fields)]
pub enum SpeedProfile {
    /// Constant speed.
    Constant {
        /// Speed, m/s.
        speed_m_s: f64,
    },
    /// A car that stands until a frame, then gathers speed.
    Starting {
        /// First frame at which the brakes are off.
        frame: u32,
        /// Speed in the end, m/s.
        speed_m_s: f64,
        /// Acceleration, m/s².
        acceleration_m_s2: f64,
    },
    /// Drives until a frame, then slows to a stand.
    Stopping {
        /// First frame at which it brakes.
        frame: u32,
        /// Speed before, m/s.
        speed_m_s: f64,
        /// Deceleration, m/s².
        deceleration_m_s2: f64,
    },
}

impl SpeedProfile {
    fn speed_m_s(&self) -> f64 {
        match *self {
            Self::Constant { speed_m_s }
            | Self::Starting { speed_m_s, .. }
            | Self::Stopping { speed_m_s, .. } => speed_m_s,
        }
    }
}

/// A strip of the street.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Lane {
    /// The camera's own lane.
    Ego,
    /// The lane to its left, same direction.
    Overtaking,
    /// The lane beyond, against the camera.
    Oncoming,
    /// The parking strip on the camera's side.
    ParkedRight,
    /// The parking strip on the other side.
    ParkedLeft,
}

/// The bodies there are.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum CarKind {
    /// A small car with a steep tail.
    Hatchback,
    /// Three boxes: bonnet, cabin, boot.
    Saloon,
    /// A long roof and a steep tail.
    Estate,
    /// High and upright.
    Offroad,
    /// A delivery van; its class is van, all others are cars.
    Van,
}

impl CarKind {
    /// All bodies.
    pub const ALL: [Self; 5] =
        [Self::Hatchback, Self::Saloon, Self::Estate, Self::Offroad, Self::Van];

    /// Class name in the files' vocabulary.
    pub const fn class(self) -> &'static str {
        match self {
            Self::Van => "van",
            _ => "car",
        }
    }
}
