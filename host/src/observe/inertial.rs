//! The inertial unit of a run against the camera's path.

use super::{Finished, FrameContext, ObserveError, ObservedRun, Observer};
use crate::evaluate::inertial::{FramePose, UnitFindings};
use dynvox_core::PoseOrigin;
use serde::{Deserialize, Serialize};

/// Keeps times and poses of all frames where the source has a unit.
#[derive(Debug, Default, Serialize, Deserialize)]
pub struct InertialObserver {
    frames: Vec<FramePose>,
}

impl Observer for InertialObserver {
    type Section = Option<UnitFindings>;

    fn frame(
        &mut self,
        run: &ObservedRun<'_>,
        frame: &mut FrameContext<'_, '_>,
    ) -> Result<(), ObserveError> {
        let stamp_ns = frame.row.stamp_ns.and_then(|ns| i64::try_from(ns).ok());
        let (Some(time_ns), Some(_)) = (stamp_ns, &run.plan.dataset.info().inertial) else {
            return Ok(());
        };
        let report = &frame.row.report;
        self.frames.push(FramePose {
            time_ns,
            segment: report.segment,
            t_world_camera: report.t_world_camera,
            is_measured: report.pose != PoseOrigin::Extrapolated,
        });
        Ok(())
    }

    fn finish(
        self,
        run: &ObservedRun<'_>,
        _: &Finished,
    ) -> Result<Option<UnitFindings>, ObserveError> {
        let unit = run.plan.dataset.info().inertial.as_deref();
        Ok(unit.map(|unit| UnitFindings::new(unit, &self.frames)))
    }
}
