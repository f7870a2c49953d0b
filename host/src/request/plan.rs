//! A request that is ready to run.

use super::{Request, RequestError, check_bounds};
use crate::input::{FrameSource, PositionFix, StopRequest};
use crate::live::LiveView;
use crate::request::FrameNumbers;
use dynvox_core::geometry::Transform;
use dynvox_core::{Capacity, Config, MotionSource};

/// A request whose data set is open and whose bounds and settings are known.
pub struct Plan {
    /// Request that was resolved.
    pub request: Request,
    /// The frames, with masks, depth and faults.
    pub dataset: Box<dyn FrameSource>,
    /// Numbers of the frames to take.
    pub frames: FrameNumbers,
    /// Given poses of these frames; `None` where the mapper estimates them.
    pub poses: Option<Vec<Transform>>,
    /// Positions of frames that something else measured, in the frames' order.
    pub fixes: Vec<PositionFix>,
    /// Name of the bounds.
    pub profile: String,
    /// The bounds.
    pub capacity: Capacity,
    /// The mapper's configuration.
    pub config: Config,
    /// The settings as a file.
    pub config_toml: String,
    /// Threads at work.
    pub threads: usize,
    /// Resident memory above which the run ends, bytes.
    pub rss_limit_bytes: u64,
    /// Doubts about the images.
    pub warnings: Vec<String>,
    /// Asks the run to end.
    pub stop: StopRequest,
    /// Show progress on standard error.
    pub progress: bool,
    /// Page that shows the run while it drives, if one does.
    pub live: Option<LiveView>,
}

impl Plan {
    /// Source of the camera's motion: `stereo`, `icp` or `file`.
    pub fn motion_source(&self) -> &'static str {
        match (&self.poses, self.config.mapper.egomotion) {
            (Some(_), _) => "file",
            (None, MotionSource::Stereo) => "stereo",
            (None, MotionSource::Icp) => "icp",
        }
    }

    /// Checks that the images fit bounds and settings and have the reference asked for, before any
    /// memory is taken.
    ///
    /// # Errors
    /// Something does not fit; the message says what to change.
    pub fn check(&self) -> Result<(), RequestError> {
        let (listed, delay) = (self.frames.listed(), self.request.evaluation.delay);
        if let Some(reference) = self.request.evaluation.reference
            && reference.positions(self.dataset.as_ref(), listed, delay).is_empty()
        {
            return Err(RequestError::NoReference { reference, frames: listed.len(), delay });
        }
        check_bounds(self.dataset.size(), (&self.profile, &self.capacity), &self.config)
    }
}

impl std::fmt::Debug for Plan {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Plan")
            .field("request", &self.request)
            .field("dataset", &self.dataset.name())
            .field("frames", &self.frames.count())
            .finish_non_exhaustive()
    }
}
