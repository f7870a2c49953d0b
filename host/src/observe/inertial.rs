//! The inertial unit of a run.

use super::{Finished, FrameContext, ObserveError, ObservedRun, Observer};
use crate::evaluate::inertial::{FramePose, UnitFindings, UnitRecord};
use dynvox_core::PoseOrigin;
use serde::{Deserialize, Serialize};

/// Keeps the mapper's reports of the unit where the source has one.
#[derive(Debug, Default, Serialize, Deserialize)]
pub struct InertialObserver {
    record: UnitRecord,
}

impl InertialObserver {
    /// Direction that points up in the world of the first camera; `None` of a doubted unit.
    pub fn up_world(&self) -> Option<[f32; 3]> {
        self.record.up_world()
    }
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
        let pose = FramePose {
            time_ns,
            segment: report.segment,
            t_world_camera: report.t_world_camera,
            is_measured: report.pose != PoseOrigin::Extrapolated,
        };
        self.record.add(&pose, report.inertial.as_ref());
        Ok(())
    }

    fn finish(
        self,
        run: &ObservedRun<'_>,
        _: &Finished,
    ) -> Result<Option<UnitFindings>, ObserveError> {
        let unit = run.plan.dataset.info().inertial.as_deref();
        Ok(unit.map(|unit| self.record.findings(unit)))
    }
}
