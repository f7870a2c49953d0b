//! Inertial unit of the street's camera, as the settings have it.

use serde::{Deserialize, Serialize};

/// Inertial unit of the street's camera.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct StreetUnit {
    /// Samples a second, Hz; 0 for no unit.
    pub rate_hz: f64,
    /// White noise of turn rates, rad/s/sqrt(Hz).
    pub turn_noise: f64,
    /// White noise of forces, m/s2/sqrt(Hz).
    pub force_noise: f64,
    /// Bias of every turn rate, rad/s.
    pub turn_bias_rad_s: f64,
    /// Bias of every force, m/s2.
    pub force_bias_m_s2: f64,
    /// Time by which the unit's clock is ahead of the cameras', s.
    pub clock_offset_s: f64,
    /// Time without samples, once in two seconds, s.
    pub gap_s: f64,
    /// Fault of the unit.
    pub fault: UnitFault,
}

impl StreetUnit {
    /// The first problem of the figures, in one sentence; the keys are those of a section of the
    /// settings.
    pub fn problem(&self, section: &str) -> Option<String> {
        let figures = [
            ("rate_hz", self.rate_hz, 0.0, 2_000.0),
            ("turn_noise", self.turn_noise, 0.0, 1.0),
            ("force_noise", self.force_noise, 0.0, 10.0),
            ("turn_bias_rad_s", self.turn_bias_rad_s, -1.0, 1.0),
            ("force_bias_m_s2", self.force_bias_m_s2, -5.0, 5.0),
            ("clock_offset_s", self.clock_offset_s, -1.0, 1.0),
            ("gap_s", self.gap_s, 0.0, 1.0),
        ];
        figures.into_iter().find(|(_, value, low, high)| !(low..=high).contains(&value)).map(
            |(name, value, low, high)| {
                format!("{section}.inertial.{name} is {value}; it must be {low} to {high}")
            },
        )
    }
}

/// Fault of a unit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum UnitFault {
    /// None.
    #[default]
    None,
    /// Axes x and y are exchanged.
    Axes,
    /// Turn rates are in degrees a second.
    Degrees,
    /// The reading of the third second repeats for ever.
    Stuck,
    /// Turn rates end at 0.3 rad/s.
    Saturated,
}
