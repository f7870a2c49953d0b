//! What to run: the frames, the bounds, the settings.

use super::disk_store::Streaming;
use super::{CheckpointPlan, RunError, RunFolder};
use crate::evaluate::quantile::median;
use crate::input::FrameSource;
use crate::observe::{Reference, ReferencePlan, Setup};
use dynvox_core::MotionSource;
use dynvox_core::geometry::Transform;
use dynvox_core::{Capacity, Config};

/// Bytes the host may use in addition to the slab, by default: decoded images, the synthetic street, a row per frame, pictures for the
/// report, the index of the block file.
pub const HOST_OVERHEAD_BYTES: u64 = 256 << 20;

/// What to run.
pub struct Plan {
    /// The frames.
    pub dataset: Box<dyn FrameSource>,
    /// Numbers of the frames to take.
    pub indices: Vec<usize>,
    /// Poses of these frames to take in place of the camera's own motion.
    pub poses: Option<Vec<Transform>>,
    /// Name of the profile.
    pub profile: String,
    /// Its bounds.
    pub capacity: Capacity,
    /// The mapper's configuration.
    pub config: Config,
    /// The same as a file.
    pub config_toml: String,
    /// Threads at work.
    pub threads: usize,
    /// How evicted blocks are stored; they are lost when absent.
    pub streaming: Option<Streaming>,
    /// When checkpoints are written.
    pub checkpoints: Option<CheckpointPlan>,
    /// Whether the run fails at the first frame that affects the map.
    pub strict: bool,
    /// Resident memory above which the run fails.
    pub rss_limit_bytes: u64,
    /// What the map is evaluated against, frame by frame, where that is asked for.
    pub evaluate: Option<Reference>,
    /// Frames after which the map is evaluated against a frame's reference, from the frame's pose.
    pub evaluation_delay: usize,
    /// What is doubtful about the images.
    pub warnings: Vec<String>,
    /// Whether to show no progress.
    pub quiet: bool,
}

impl Plan {
    /// What observers know of the run.
    pub(super) fn setup(&self, folder: &RunFolder) -> Setup<'_> {
        let dataset = self.dataset.as_ref();
        Setup {
            dataset,
            indices: &self.indices,
            capacity: &self.capacity,
            config: &self.config,
            folder: folder.path().to_path_buf(),
            motion_source: match (&self.poses, self.config.mapper.egomotion) {
                (Some(_), _) => "file",
                (None, MotionSource::Stereo) => "stereo",
                (None, MotionSource::Icp) => "icp",
            },
            reference: match self.evaluate {
                Some(reference) => ReferencePlan::all(dataset, &self.indices, reference, self.evaluation_delay),
                None => ReferencePlan::sampled(dataset, &self.indices),
            },
        }
    }

    /// Refuses what cannot run, before any memory is taken.
    pub(super) fn check(&self) -> Result<(), RunError> {
        let (width, height) = self.dataset.size();
        if let Some(reference) = self.evaluate
            && ReferencePlan::all(self.dataset.as_ref(), &self.indices, reference, self.evaluation_delay).is_none()
        {
            return Err(RunError::NoReference { reference, frames: self.indices.len(), delay: self.evaluation_delay });
        }
        let fits = |capacity: &Capacity| width <= capacity.image_width && height <= capacity.image_height;
        if !fits(&self.capacity) {
            let scale = (self.capacity.image_width as f64 / width as f64).min(self.capacity.image_height as f64 / height as f64);
            let scale = (scale * 100.0).floor() / 100.0;
            let larger = Capacity::PROFILES.iter().find(|(_, capacity)| fits(capacity));
            return Err(RunError::ImageSize {
                width,
                height,
                profile: self.profile.clone(),
                fits_width: self.capacity.image_width,
                fits_height: self.capacity.image_height,
                action: match larger {
                    Some((name, _)) => format!("Choose --profile {name}, or shrink the images with --scale {scale}"),
                    None => format!("Shrink the images with --scale {scale}"),
                },
            });
        }
        let problems = self.config.validate();
        let (prune_lag, history_frames) = (self.config.volume.prune_lag, self.capacity.history_frames);
        if problems.is_empty() && self.config.volume.prune_weight > 0 && prune_lag as usize > history_frames {
            return Err(RunError::Window { prune_lag, history_frames, profile: self.profile.clone() });
        }
        if problems.is_empty() {
            return Ok(());
        }
        let problems: Vec<String> = problems.iter().map(|problem| format!("{} {}", problem.key, problem.rule)).collect();
        Err(RunError::Config { problems: problems.join("; ") })
    }
}

/// The frames a run takes: from `start`, every `stride`-th, at most `frames`.
pub fn frame_indices(len: usize, start: usize, stride: usize, frames: Option<usize>) -> Result<Vec<usize>, RunError> {
    let indices: Vec<usize> = (start..len).step_by(stride.max(1)).take(frames.unwrap_or(usize::MAX)).collect();
    if indices.is_empty() { Err(RunError::NoFrames { start, len }) } else { Ok(indices) }
}

/// Median time between two of the frames, s; `None` where there is only one.
pub fn frame_interval_s(dataset: &dyn FrameSource, indices: &[usize]) -> Option<f64> {
    median(indices.windows(2).map(|pair| dataset.time_s(pair[1]) - dataset.time_s(pair[0])))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_taken_from_start_by_stride_up_to_a_number() {
        assert_eq!(frame_indices(10, 2, 3, None).unwrap(), [2, 5, 8]);
        assert_eq!(frame_indices(10, 0, 1, Some(2)).unwrap(), [0, 1]);
        assert!(frame_indices(10, 10, 1, None).unwrap_err().to_string().contains("leaves none of the 10 frames"));
    }
}
