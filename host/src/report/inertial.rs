//! The inertial unit in a run's summary.

use crate::evaluate::inertial::UnitFindings;
use serde::Serialize;

/// Figures of a unit. A key is absent where its value is unknown.
#[derive(Debug, Serialize)]
pub struct InertialSummary {
    samples: usize,
    /// Frames without a sample since the one before.
    frames_without: usize,
    longest_gap_s: f64,
    /// Intervals from frame to frame whose turns were compared with those of the images.
    intervals: usize,
    /// Difference of these turns with clock offset and bias taken out, degrees, root mean square.
    #[serde(skip_serializing_if = "Option::is_none")]
    turn_difference_deg: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    turn_bias_rad_s: Option<[f64; 3]>,
    /// Time by which the unit's clock is ahead of the cameras', ms.
    #[serde(skip_serializing_if = "Option::is_none")]
    clock_offset_ms: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    clock_offset_sigma_ms: Option<f64>,
    /// Unit vector that points up in the world of the poses.
    #[serde(skip_serializing_if = "Option::is_none")]
    up: Option<[f64; 3]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    up_sigma_deg: Option<f64>,
    /// Fault of the unit, with the next action.
    #[serde(skip_serializing_if = "Option::is_none")]
    doubt: Option<String>,
}

impl InertialSummary {
    /// The figures of some findings.
    pub fn new(found: &UnitFindings) -> Self {
        let (agreement, doubt) = (found.agreement.as_ref(), found.doubt.as_ref());
        let clock = found.clock_ms();
        Self {
            samples: found.samples,
            frames_without: found.frames_without,
            longest_gap_s: found.longest_gap_s,
            intervals: agreement.map_or(0, |agreement| agreement.intervals),
            turn_difference_deg: agreement.map(|agreement| agreement.difference_deg),
            turn_bias_rad_s: agreement
                .filter(|_| doubt.is_none())
                .map(|_| found.last.turn_bias.map(f64::from)),
            clock_offset_ms: clock.map(|[offset_ms, _]| offset_ms),
            clock_offset_sigma_ms: clock.map(|[_, sigma_ms]| sigma_ms),
            up: found.vertical.map(|vertical| vertical.up_world.map(f64::from)),
            up_sigma_deg: found.vertical.map(|vertical| vertical.sigma_rad.to_degrees().into()),
            doubt: doubt.map(|doubt| doubt.sentence()),
        }
    }
}
