//! Why a run ends early, in sentences.

use super::{FolderError, ResumeError};
use crate::input::InputError;
use crate::observe::Reference;
use crate::run::store::StoreError;
use dynvox_core::memory::SlabError;
use dynvox_core::{NewError, StepError};

/// Why a run ended early.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// The data set, or a frame of it.
    #[error(transparent)]
    Dataset(#[from] InputError),
    /// The run folder.
    #[error(transparent)]
    Folder(#[from] FolderError),
    /// No frame is left of the data set.
    #[error("--start {start} leaves none of the {len} frames. Give a smaller --start")]
    NoFrames {
        /// First frame asked for.
        start: usize,
        /// Frames there are.
        len: usize,
    },
    /// Nothing to hold the map against.
    #[error("--evaluate {} finds nothing in the {frames} frames: {}", .reference.name(), missing(*.reference, *.frames, *.delay))]
    NoReference {
        /// What was asked for.
        reference: Reference,
        /// Frames of the run.
        frames: usize,
        /// Frames an evaluation waits.
        delay: usize,
    },
    /// The images are larger than the profile's.
    #[error("images of {width} x {height} px do not fit profile {profile}, which takes {fits_width} x {fits_height}. {action}")]
    ImageSize {
        /// Image width, px.
        width: usize,
        /// Image height, px.
        height: usize,
        /// Name of the profile.
        profile: String,
        /// Widest image, px.
        fits_width: usize,
        /// Highest image, px.
        fits_height: usize,
        /// What to do.
        action: String,
    },
    /// The pruning window is longer than the profile's history.
    #[error(
        "volume.prune_lag is {prune_lag} frames; profile {profile} remembers {history_frames}. Give more bytes with --memory or a larger --profile, or \
         --set volume.prune_lag={history_frames}"
    )]
    Window {
        /// Frames asked for.
        prune_lag: u32,
        /// Frames the profile's history holds.
        history_frames: usize,
        /// Name of the profile.
        profile: String,
    },
    /// The configuration.
    #[error("the configuration cannot be used: {problems}. Correct it with --set key=value or in the --config file")]
    Config {
        /// All problems.
        problems: String,
    },
    /// The machine has no room for the slab.
    #[error("this machine has no {bytes} bytes for the slab of {profile}. Give fewer with --memory; `dynvox budget` shows what they hold")]
    NoMemory {
        /// Bytes of the slab.
        bytes: usize,
        /// Name of the profile.
        profile: String,
    },
    /// The core refuses the slab.
    #[error("the core refuses the slab of profile {profile}: {reason}. This is a bug of dynvox: please report it")]
    Slab {
        /// Name of the profile.
        profile: String,
        /// What the core says.
        reason: String,
    },
    /// The core refuses a frame.
    #[error("frame {frame} was refused: {reason}. End before it with --frames, or skip it with --start")]
    Step {
        /// Number of the frame.
        frame: usize,
        /// What the core says.
        reason: String,
    },
    /// The block file.
    #[error("blocks that leave the pool cannot be kept: {0}. Free the disk, or run with --no-stream")]
    Store(StoreError),
    /// The block file of a run that goes on.
    #[error(transparent)]
    Reopen(StoreError),
    /// A stopped run that cannot go on.
    #[error(transparent)]
    Resume(#[from] ResumeError),
    /// A strict run's map was harmed.
    #[error("frame {frame} harms the map: {cause}. Without --strict the run goes on and counts it")]
    Strict {
        /// Number of the frame.
        frame: usize,
        /// What happened.
        cause: String,
    },
    /// The process holds more memory than it may.
    #[error(
        "at frame {frame} the process holds {rss_bytes} bytes, more than the {limit_bytes} it may. Allow more with --rss-limit-mib, or choose a \
         smaller --memory"
    )]
    Resident {
        /// Number of the frame.
        frame: usize,
        /// Resident bytes.
        rss_bytes: u64,
        /// The ceiling.
        limit_bytes: u64,
    },
    /// The threads cannot be started.
    #[error("{count} threads cannot be started: {source}. Give fewer --threads")]
    Threads {
        /// Threads asked for.
        count: usize,
        /// What the machine says.
        source: rayon::ThreadPoolBuildError,
    },
}

/// What a reference lacks, and what to do.
fn missing(reference: Reference, frames: usize, delay: usize) -> String {
    match reference {
        _ if delay >= frames => format!("--evaluation-delay {delay} is beyond the last of them. Give a smaller one, or more --frames"),
        Reference::Lidar => {
            "no scan beside the images. KITTI keeps them in velodyne/ (`dynvox inspect` tells where); fetch them, or take the frames \
             that have one"
                .to_owned()
        }
        Reference::Exact => "only the synthetic street has exact depth. Give --evaluate lidar".to_owned(),
    }
}

/// What the core says of a slab, as an error.
pub(super) fn refused(profile: &str, error: NewError) -> RunError {
    let reason = match error {
        NewError::Slab(SlabError::TooSmall { missing }) => format!("it lacks {missing} bytes"),
        NewError::Config(problem) => return RunError::Config { problems: problem.to_string() },
        other => other.to_string(),
    };
    RunError::Slab { profile: profile.to_owned(), reason }
}

/// What the core says of a frame, in words.
pub(super) fn step_reason(error: StepError) -> String {
    match error {
        StepError::SizesDiffer => "its images differ in size".to_owned(),
        StepError::RawSizeDiffers { width, height } => {
            format!("its images are not of {width} x {height} px, the size the calibration is for")
        }
        StepError::SizeChanged => "its images have another size than those before".to_owned(),
        StepError::PoseNotFinite => "its pose holds numbers that are none".to_owned(),
        StepError::PoseNotRotation => "the quaternion of its pose does not have length 1".to_owned(),
        StepError::TooLarge { width, height } => format!("its images are larger than {width} x {height} px"),
        StepError::TooSmall { width, height } => format!("its images are smaller than {width} x {height} px"),
        other => other.to_string(),
    }
}
