//! An inertial unit against the camera's path: whether both tell of the same turns, by how much
//! their clocks are apart, which bias the unit has, and which way is up.
//!
//! Nothing here goes into the map. Turns of the camera from frame to frame are compared with the
//! unit's turn rates integrated over the same time; the clock offset is that at which they agree
//! best. What a wrong mounting, degrees for radians, a stuck or a saturated sensor would explain
//! better is named as a doubt.

mod agreement;
mod doubt;
mod fit;
#[cfg(test)]
mod tests;
mod turns;
mod vertical;

pub use agreement::UnitAgreement;
pub use doubt::UnitDoubt;
pub use vertical::Vertical;

use crate::input::InertialUnitData;
use dynvox_core::geometry::{MapSegment, Transform};
use serde::{Deserialize, Serialize};

/// Pose of a frame with its time.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct FramePose {
    /// Time of the frame, ns.
    pub time_ns: i64,
    /// Segment of the map that the pose is in.
    pub segment: MapSegment,
    /// Camera to world.
    pub t_world_camera: Transform,
    /// True if the pose was found in the images.
    pub is_measured: bool,
}

/// Findings about a unit.
#[derive(Clone, Debug, PartialEq)]
pub struct UnitFindings {
    /// Samples between the first and the last frame.
    pub samples: usize,
    /// Frames without a sample since the one before.
    pub frames_without: usize,
    /// Longest time between two samples, s.
    pub longest_gap_s: f64,
    /// Turns of the unit against those of the camera; `None` where too few could be compared.
    pub agreement: Option<UnitAgreement>,
    /// Direction that points up; `None` where it is not known, or the unit is doubted.
    pub vertical: Option<Vertical>,
}

impl UnitFindings {
    /// Compares a unit with the path of its camera.
    pub fn new(unit: &InertialUnitData, frames: &[FramePose]) -> Self {
        let agreement = UnitAgreement::new(unit, frames);
        let is_doubted = agreement.as_ref().is_none_or(|found| found.doubt.is_some());
        let offset_ns = agreement.as_ref().and_then(|found| found.clock_offset_ms);
        let offset_ns = (offset_ns.unwrap_or(0.0) * 1e6) as i64;
        let vertical = Vertical::new(unit, frames, offset_ns).filter(|_| !is_doubted);
        let without = frames.windows(2).filter(|pair| {
            let [before, now] = [pair[0].time_ns, pair[1].time_ns].map(|ns| ns.max(0) as u64);
            unit.between(Some(before), now).is_empty()
        });
        Self {
            samples: unit.within_frames,
            frames_without: without.count(),
            longest_gap_s: unit.longest_gap_s,
            agreement,
            vertical,
        }
    }

    /// A line about the unit.
    pub fn sentence(&self) -> String {
        let mut parts = vec![format!("{} samples", self.samples)];
        if self.frames_without > 0 {
            let without = self.frames_without;
            let gap_s = self.longest_gap_s;
            parts.push(format!("{without} frames without (longest gap {gap_s:.2} s)"));
        }
        match &self.agreement {
            None => parts.push("too few turns to compare with the images".to_owned()),
            Some(agreement) => parts.push(agreement.sentence()),
        }
        parts.extend(self.vertical.as_ref().map(Vertical::sentence));
        parts.join("; ")
    }

    /// True if the unit is doubted.
    pub fn is_doubted(&self) -> bool {
        self.agreement.as_ref().is_some_and(|agreement| agreement.doubt.is_some())
    }
}
