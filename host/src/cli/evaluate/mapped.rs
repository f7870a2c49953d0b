//! Frames of a data set with true poses, mapped one after the other.

use crate::request::Plan;
use crate::run::{RunError, Threads, each_frame, with_mapper};
use anyhow::bail;
use dynvox_core::Report;
use dynvox_core::geometry::Transform;

/// Maps the frames of a plan and hands on each report with the frame's true pose.
///
/// # Errors
/// The data set has no true poses, or a frame cannot be read.
pub fn each_report(plan: &Plan, mut visit: impl FnMut(&Report, &Transform)) -> anyhow::Result<()> {
    let Some(truth) = plan.dataset.truth() else {
        bail!(
            "{} has no true poses. Give a data set that has, or none for the synthetic street",
            plan.dataset.name()
        );
    };
    let threads = Threads::new(plan.threads)?;
    with_mapper(plan, |mapper| {
        each_frame(plan, |index, frame| {
            let true_pose = truth.get(index).ok_or_else(|| RunError::Step {
                frame: index,
                reason: "it has no true pose. Choose other frames with --frames".to_owned(),
            })?;
            // A frame whose time stamp goes back is refused, and nothing is mapped of it.
            if let Ok(report) = threads.run(|| mapper.step(frame, &threads)) {
                visit(&report, true_pose);
            }
            Ok(())
        })
    })?;
    Ok(())
}
