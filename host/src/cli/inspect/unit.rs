//! An inertial unit, as `dynvox inspect` tells of it.

use crate::input::InertialUnitData;
use serde::Serialize;
use std::path::PathBuf;

/// An inertial unit, as `inspect` tells of it.
#[derive(Serialize)]
pub(super) struct UnitFound {
    path: PathBuf,
    samples: usize,
    rate_hz: f64,
    longest_gap_s: f64,
    /// Distance from the left camera, m.
    distance_m: f64,
}

impl UnitFound {
    pub(super) fn new(unit: &InertialUnitData) -> Self {
        Self {
            path: unit.path.clone(),
            samples: unit.within_frames,
            rate_hz: unit.rate_hz,
            longest_gap_s: unit.longest_gap_s,
            distance_m: unit.t_camera_unit.distance_m(),
        }
    }

    pub(super) fn print(&self) {
        outln!(
            "  inertial unit: {} samples at {:.0} Hz, longest gap {:.3} s, {:.2} m from the left \
             camera",
            self.samples,
            self.rate_hz,
            self.longest_gap_s,
            self.distance_m
        );
    }
}
