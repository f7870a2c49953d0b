//! What to run: the frames, the bounds, the settings.

use super::disk_store::Streaming;
use super::{CheckpointPlan, ExportOptions, RunError, RunFolder};
use crate::evaluate::quantile::median;
use crate::input::{FrameSource, StopRequest};
use crate::observe::{Reference, ReferencePlan, Setup};
use dynvox_core::MotionSource;
use dynvox_core::geometry::Transform;
use dynvox_core::{Capacity, Config};
use std::path::PathBuf;

/// Bytes the host may use in addition to the slab, by default: the synthetic street, objects'
/// meshes, the index of the block file.
const HOST_BYTES: u64 = 256 << 20;
/// The same for each pixel of an image: frames read ahead, their depth and masks, pictures of the
/// report.
const HOST_BYTES_PER_PIXEL: u64 = 64;

/// Bytes a run may take in all unless it is told otherwise.
pub fn resident_limit_bytes(capacity: &Capacity, (width, height): (usize, usize)) -> u64 {
    capacity.bytes() as u64 + HOST_BYTES + HOST_BYTES_PER_PIXEL * (width * height) as u64
}

/// What to run.
pub struct Plan {
    /// The frames.
    pub dataset: Box<dyn FrameSource>,
    /// Which of them to take.
    pub frames: FrameNumbers,
    /// Whether frames that cannot be read or mapped are left out; otherwise the run ends before the
    /// first of them.
    pub skip_bad_frames: bool,
    /// Asks the run to end.
    pub stop: StopRequest,
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
    /// What it leaves behind for other programs.
    pub export: ExportOptions,
    /// Whether the run fails at the first frame that affects the map.
    pub strict: bool,
    /// Resident memory above which the run fails.
    pub rss_limit_bytes: u64,
    /// What the map is evaluated against, frame by frame, where that is asked for.
    pub evaluate: Option<Reference>,
    /// Frames after which the map is evaluated against a frame's reference, from the frame's pose.
    pub evaluation_delay: usize,
    /// Folder that every frame's instances are saved to, if they are.
    pub save_instances: Option<PathBuf>,
    /// Folder that what the finished map shows at every frame's pose is saved to, if it is.
    pub save_map_disparity: Option<PathBuf>,
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
            frames: self.frames.count(),
            capacity: &self.capacity,
            config: &self.config,
            folder: folder.path().to_path_buf(),
            motion_source: match (&self.poses, self.config.mapper.egomotion) {
                (Some(_), _) => "file",
                (None, MotionSource::Stereo) => "stereo",
                (None, MotionSource::Icp) => "icp",
            },
            save_instances: self.save_instances.as_deref(),
            save_map_disparity: self.save_map_disparity.as_deref(),
            axes: self.export.axes,
            record: self.export.record,
            reference: match self.evaluate {
                Some(reference) => ReferencePlan::all(
                    dataset,
                    self.frames.listed(),
                    reference,
                    self.evaluation_delay,
                ),
                None => ReferencePlan::sampled(dataset, self.frames.listed()),
            },
        }
    }

    /// Refuses what cannot run, before any memory is taken.
    pub(super) fn check(&self) -> Result<(), RunError> {
        let (width, height) = self.dataset.size();
        if let Some(reference) = self.evaluate
            && ReferencePlan::all(
                self.dataset.as_ref(),
                self.frames.listed(),
                reference,
                self.evaluation_delay,
            )
            .is_none()
        {
            return Err(RunError::NoReference {
                reference,
                frames: self.frames.listed().len(),
                delay: self.evaluation_delay,
            });
        }
        check_bounds((width, height), (&self.profile, &self.capacity), &self.config)
    }
}

/// Refuses bounds and settings that images of a size cannot be mapped with.
///
/// # Errors
/// What does not fit, and what to change.
pub fn check_bounds(
    (width, height): (usize, usize),
    (profile, bounds): (&str, &Capacity),
    config: &Config,
) -> Result<(), RunError> {
    let fits =
        |capacity: &Capacity| width <= capacity.image_width && height <= capacity.image_height;
    if !fits(bounds) {
        let scale = (bounds.image_width as f64 / width as f64)
            .min(bounds.image_height as f64 / height as f64);
        let scale = (scale * 100.0).floor() / 100.0;
        let larger = Capacity::PROFILES.iter().find(|(_, capacity)| fits(capacity));
        return Err(RunError::ImageSize {
            width,
            height,
            profile: profile.to_owned(),
            fits_width: bounds.image_width,
            fits_height: bounds.image_height,
            action: match larger {
                Some((name, _)) => {
                    format!("Choose --profile {name}, or shrink the images with --scale {scale}")
                }
                None => format!("Shrink the images with --scale {scale}"),
            },
        });
    }
    let problems = config.validate();
    let (prune_lag, history_frames) = (config.volume.prune_lag, bounds.history_frames);
    if problems.is_empty() && config.volume.prunes() && prune_lag as usize > history_frames {
        return Err(RunError::Window { prune_lag, history_frames, profile: profile.to_owned() });
    }
    if problems.is_empty() {
        return Ok(());
    }
    let problems: Vec<String> =
        problems.iter().map(|problem| format!("{} {}", problem.key, problem.rule)).collect();
    Err(RunError::Config { problems: problems.join("; ") })
}

/// The frames a run takes, by their numbers in the source.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum FrameNumbers {
    /// These.
    Listed(Vec<usize>),
    /// Of a source without a known end: from `start`, every `stride`-th, at most `most`.
    Open {
        /// The first.
        start: usize,
        /// From one to the next.
        stride: usize,
        /// How many at most.
        most: usize,
    },
}

impl FrameNumbers {
    /// From `start`, every `stride`-th, at most `frames`.
    ///
    /// # Errors
    /// Nothing is left of the source.
    pub fn of(
        source: &dyn FrameSource,
        start: usize,
        stride: usize,
        frames: Option<usize>,
    ) -> Result<Self, RunError> {
        let (stride, most) = (stride.max(1), frames.unwrap_or(usize::MAX));
        if source.stream().is_some() {
            return Ok(Self::Open { start, stride, most });
        }
        let len = source.len();
        let listed: Vec<usize> = (start..len).step_by(stride).take(most).collect();
        if listed.is_empty() {
            Err(RunError::NoFrames { start, len })
        } else {
            Ok(Self::Listed(listed))
        }
    }

    /// All of them; empty where the end is unknown.
    pub fn listed(&self) -> &[usize] {
        match self {
            Self::Listed(listed) => listed,
            Self::Open { .. } => &[],
        }
    }

    /// How many; `None` where the end is unknown.
    pub fn count(&self) -> Option<usize> {
        match self {
            Self::Listed(listed) => Some(listed.len()),
            Self::Open { .. } => None,
        }
    }

    /// Positions and numbers from a position on.
    pub fn from_position(
        &self,
        first: usize,
    ) -> Box<dyn Iterator<Item = (usize, usize)> + Send + '_> {
        match self {
            Self::Listed(listed) => Box::new(listed.iter().copied().enumerate().skip(first)),
            &Self::Open { start, stride, most } => Box::new(
                (0..most)
                    .map_while(move |at| Some((at, at.checked_mul(stride)?.checked_add(start)?))),
            ),
        }
    }

    /// The position of a frame.
    pub fn position_of(&self, index: usize) -> Option<usize> {
        self.listed().binary_search(&index).ok()
    }
}

/// Median time between two of the frames, s; `None` where there is only one.
pub fn frame_interval_s(source: &dyn FrameSource, frames: &FrameNumbers) -> Option<f64> {
    match frames {
        FrameNumbers::Listed(listed) => {
            median(listed.windows(2).map(|pair| source.time_s(pair[1]) - source.time_s(pair[0])))
        }
        &FrameNumbers::Open { stride, .. } => Some(source.time_s(stride) - source.time_s(0)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::input::StreetFrames;
    use crate::synth::StreetConfig;

    #[test]
    fn frames_are_taken_from_start_by_stride_up_to_a_number() {
        let street =
            StreetFrames::new(StreetConfig { frames: 10, ..StreetConfig::default() }).unwrap();
        let of = |start, stride, frames| FrameNumbers::of(&street, start, stride, frames);
        assert_eq!(of(2, 3, None).unwrap().listed(), [2, 5, 8]);
        assert_eq!(of(0, 1, Some(2)).unwrap().listed(), [0, 1]);
        assert!(of(10, 1, None).unwrap_err().to_string().contains("leaves none of the 10 frames"));
        let open = FrameNumbers::Open { start: 4, stride: 2, most: 3 };
        assert_eq!(open.from_position(0).collect::<Vec<_>>(), [(0, 4), (1, 6), (2, 8)]);
        assert_eq!((open.count(), open.listed().len()), (None, 0));
    }
}
