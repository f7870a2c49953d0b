//! Frames of a plan, one after the other, for those who write no run folder.

use super::error::{RunError, refused};
use super::{inertial_samples, read_ahead, stereo_frame};
use crate::input::InstanceMask;
use crate::request::Plan;
use crate::slab::HostSlab;
use dynvox_core::{Mapper, StereoFrame};

/// Makes the mapper of a plan, in memory that is its own, and hands it on.
///
/// # Errors
/// The plan cannot be run, memory is short, or `consume` fails.
pub fn with_mapper<T>(
    plan: &Plan,
    consume: impl FnOnce(&mut Mapper<'_>) -> Result<T, RunError>,
) -> Result<T, RunError> {
    plan.check()?;
    let mut slab = slab_of(plan)?;
    let mut mapper = Mapper::new(&plan.capacity, &plan.config, slab.bytes_mut())
        .map_err(|error| refused(&plan.profile, error))?;
    consume(&mut mapper)
}

/// Memory for the mapper of a plan.
pub(super) fn slab_of(plan: &Plan) -> Result<HostSlab, RunError> {
    let bytes = plan.capacity.bytes();
    HostSlab::map(bytes).ok_or_else(|| RunError::NoMemory { bytes, profile: plan.profile.clone() })
}

/// Hands on each frame of a plan with its index in the data set, decoded ahead.
///
/// # Errors
/// A frame cannot be read, has no images, or `visit` fails.
pub fn each_frame(
    plan: &Plan,
    mut visit: impl FnMut(usize, &StereoFrame<'_>) -> Result<(), RunError>,
) -> Result<(), RunError> {
    read_ahead(plan.dataset.as_ref(), plan.frames.from_position(0), false, |read| {
        let mut before_ns = None;
        for frame in read {
            let images = frame.images?;
            let detections: Vec<_> =
                images.masks.instances.iter().map(InstanceMask::detection).collect();
            let stereo = stereo_frame(&images, &detections).ok_or_else(|| RunError::Step {
                frame: frame.index,
                reason: "an image is empty".to_owned(),
            })?;
            let inertial = inertial_samples(plan.dataset.as_ref(), before_ns, frame.stamp_ns);
            visit(frame.index, &StereoFrame { time_ns: frame.stamp_ns, inertial, ..stereo })?;
            before_ns = frame.stamp_ns;
        }
        Ok(())
    })
}
