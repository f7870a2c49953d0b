//! Why a run ends early, in sentences.

use super::{FolderError, ResumeError};
use crate::input::InputError;
use crate::observe::ObserveError;
use crate::owned::Overlap;
use crate::request::RequestError;
use crate::run::store::StoreError;
use dynvox_core::memory::SlabError;
use dynvox_core::{NewError, StepError};
use std::path::PathBuf;

/// Reason why a run ended early.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// The data set, or a frame of it.
    #[error(transparent)]
    Dataset(#[from] InputError),
    /// The run folder.
    #[error(transparent)]
    Folder(#[from] FolderError),
    /// The request.
    #[error(transparent)]
    Request(#[from] RequestError),
    /// A folder to save to is there already.
    #[error("{path} exists. Give another {option}, or remove it")]
    SavedExists {
        /// The folder.
        path: PathBuf,
        /// The option that names it.
        option: &'static str,
    },
    /// An output and an input that overlap.
    #[error(transparent)]
    Overlap(#[from] Overlap),
    /// Places of an old map that cannot be used.
    #[error(
        "{path} cannot be used: {reason}. Map the old recording with --keyframes 1000 and name the \
         folder of that run"
    )]
    Places {
        /// The file.
        path: PathBuf,
        /// The reason.
        reason: String,
    },
    /// Blocks of an old map that cannot be used.
    #[error(
        "{path} cannot be used: {reason}. Map the old recording with --keyframes 1000 \
         --keep-blocks and name the folder of that run"
    )]
    OldBlocks {
        /// The file.
        path: PathBuf,
        /// The reason.
        reason: String,
    },
    /// No memory for the slab.
    #[error(
        "the slab of {profile} needs {bytes} bytes, and this machine does not have them. Give \
         fewer with --memory; `dynvox budget` shows what fits into them"
    )]
    NoMemory {
        /// Bytes of the slab.
        bytes: usize,
        /// Name of the profile.
        profile: String,
    },
    /// The core refuses the slab.
    #[error(
        "the core refuses the slab of profile {profile}: {reason}. This is a bug of dynvox: please \
         report it"
    )]
    Slab {
        /// Name of the profile.
        profile: String,
        /// The core's reason.
        reason: String,
    },
    /// The core refuses a frame.
    #[error(
        "frame {frame} was refused: {reason}. Leave such frames out with --skip-bad-frames, or end \
         before it with --frames"
    )]
    Step {
        /// Number of the frame.
        frame: usize,
        /// The core's reason.
        reason: String,
    },
    /// The block file.
    #[error("evicted blocks cannot be stored: {0}. Free disk space, or run with --no-stream")]
    Store(StoreError),
    /// The block file of a resumed run.
    #[error(transparent)]
    Reopen(StoreError),
    /// An interrupted run that cannot be resumed.
    #[error(transparent)]
    Resume(#[from] ResumeError),
    /// A frame of a strict run affected the map.
    #[error(
        "frame {frame}: map affected: {cause}. Without --strict the run continues and counts it"
    )]
    Strict {
        /// Number of the frame.
        frame: usize,
        /// The cause.
        cause: String,
    },
    /// A signal asked for the end.
    #[error("the run was stopped by {} after {frames} frames. Run it again, or map so many frames \
             with --frames {frames}", signal_name(*.signal))]
    Signal {
        /// The signal's number.
        signal: usize,
        /// Frames mapped.
        frames: usize,
    },
    /// The process uses more memory than allowed.
    #[error(
        "at frame {frame} the process uses {rss_bytes} bytes, more than the {limit_bytes} allowed. \
         Allow more with --rss-limit-mib, or choose a smaller --memory"
    )]
    Resident {
        /// Number of the frame.
        frame: usize,
        /// Resident bytes.
        rss_bytes: u64,
        /// The ceiling.
        limit_bytes: u64,
    },
    /// The process comes close to the limit on its address space.
    #[error(
        "at frame {frame} the process uses {used_bytes} of the {limit_bytes} bytes of address space \
         that `ulimit -v` allows, and its results need the rest. Allow more, or choose a smaller \
         --memory or fewer --threads"
    )]
    AddressSpace {
        /// Number of the frame.
        frame: usize,
        /// Bytes in use.
        used_bytes: u64,
        /// The limit.
        limit_bytes: u64,
    },
    /// An observer.
    #[error(transparent)]
    Observe(#[from] ObserveError),
    /// The threads cannot be started.
    #[error("{count} threads cannot be started: {source}. Give fewer --threads")]
    Threads {
        /// Threads asked for.
        count: usize,
        /// The system's error.
        source: rayon::ThreadPoolBuildError,
    },
}

impl RunError {
    /// Returns true if the error is about one frame, without which the run may go on.
    pub(super) fn is_of_one_frame(&self) -> bool {
        match self {
            Self::Dataset(error) => !error.ends_source(),
            Self::Step { .. } => true,
            _ => false,
        }
    }
}

/// `SIGINT` for 2.
fn signal_name(signal: usize) -> String {
    match signal {
        1 => "SIGHUP".to_owned(),
        2 => "SIGINT".to_owned(),
        15 => "SIGTERM".to_owned(),
        other => format!("signal {other}"),
    }
}

/// The core's refusal of a slab, as an error.
pub(super) fn refused(profile: &str, error: NewError) -> RunError {
    let reason = match error {
        NewError::Slab(SlabError::TooSmall { missing }) => format!("it lacks {missing} bytes"),
        NewError::Config(problem) => {
            return RequestError::Config { problems: problem.to_string() }.into();
        }
        other => other.to_string(),
    };
    RunError::Slab { profile: profile.to_owned(), reason }
}

/// The core's refusal of a frame, as an error.
pub(super) fn failed_step(frame: usize, error: StepError) -> RunError {
    RunError::Step { frame, reason: step_reason(error) }
}

/// The core's refusal of a frame, in words.
pub fn step_reason(error: StepError) -> String {
    match error {
        StepError::SizesDiffer => "its images differ in size".to_owned(),
        StepError::RawSizeDiffers { width, height } => {
            format!("its images are not of {width} x {height} px, the size the calibration is for")
        }
        StepError::SizeChanged => "its images have another size than those before".to_owned(),
        StepError::PoseNotRotation => {
            "the quaternion of its pose does not have length 1".to_owned()
        }
        StepError::PoseNotFinite => "its pose is not finite".to_owned(),
        StepError::PoseBeyondMap => {
            "its pose lies beyond the map: give poses relative to the first one".to_owned()
        }
        StepError::TooLarge { width, height } => {
            format!("its images are larger than {width} x {height} px")
        }
        StepError::TooSmall { width, height } => {
            format!("its images are smaller than {width} x {height} px")
        }
        other => other.to_string(),
    }
}
