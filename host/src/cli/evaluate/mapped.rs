//! Frames of a data set with true poses, mapped one after the other.

use crate::input::InstanceMask;
use crate::request::Plan;
use crate::run::{Threads, stereo_frame};
use anyhow::bail;
use dynvox_core::geometry::Transform;
use dynvox_core::memory::SLAB_ALIGN;
use dynvox_core::{Mapper, Report, StereoFrame};

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
    let mut slab = vec![0; plan.capacity.bytes() + SLAB_ALIGN];
    let mut mapper = Mapper::new(&plan.capacity, &plan.config, &mut slab)?;
    let threads = Threads::new(plan.threads)?;
    for (_, index) in plan.frames.from_position(0) {
        let images = plan.dataset.frame(index)?;
        let detections: Vec<_> =
            images.masks.instances.iter().map(InstanceMask::detection).collect();
        let (Some(frame), Some(true_pose)) = (stereo_frame(&images, &detections), truth.get(index))
        else {
            bail!("frame {index} has no images or no true pose. Choose other frames with --frames");
        };
        let frame = StereoFrame { time_ns: plan.dataset.stamp_ns(index), ..frame };
        // A frame whose time stamp goes back is refused, and nothing is mapped of it.
        let Ok(report) = threads.run(|| mapper.step(&frame, &threads)) else { continue };
        visit(&report, true_pose);
    }
    Ok(())
}
