//! Errors of requests, as sentences.

use super::Reference;
use crate::input::InputError;
use crate::input::diagnosis::RefusedInput;

/// Reason that a request cannot be run. Each message ends in the next action.
#[derive(Debug, thiserror::Error)]
pub enum RequestError {
    /// The data set.
    #[error(transparent)]
    Input(#[from] InputError),
    /// The images would give a meaningless map.
    #[error(transparent)]
    Refused(#[from] RefusedInput),
    /// A part of the request is not what it can be, or contradicts another.
    #[error("{0}")]
    Invalid(String),
    /// No frame is left of the data set.
    #[error("--start {start} leaves none of the {len} frames. Give a smaller --start")]
    NoFrames {
        /// First frame asked for.
        start: usize,
        /// Frames there are.
        len: usize,
    },
    /// No reference for the evaluation.
    #[error("--evaluate {} finds nothing in the {frames} frames: \
             {}", .reference.name(), missing(*.reference, *.frames, *.delay))]
    NoReference {
        /// Reference asked for.
        reference: Reference,
        /// Frames of the run.
        frames: usize,
        /// Frames after which the map is evaluated.
        delay: usize,
    },
    /// The images are larger than the profile's.
    #[error(
        "images of {width} x {height} px do not fit profile {profile}, which takes {fits_width} x \
         {fits_height}. {action}"
    )]
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
        /// Next action.
        action: String,
    },
    /// The pruning window is longer than the profile's history.
    #[error(
        "volume.prune_lag is {prune_lag} frames; profile {profile} has a history of \
         {history_frames}. Give more bytes with --memory or a larger --profile, or \
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
    #[error(
        "the configuration cannot be used: {problems}. Correct it with --set key=value or in the \
         --config file"
    )]
    Config {
        /// All problems.
        problems: String,
    },
}

impl RequestError {
    /// A part that is not what it can be.
    pub(super) fn invalid(sentence: &str) -> Self {
        Self::Invalid(sentence.to_owned())
    }
}

/// Says why there is no reference, and what to do.
fn missing(reference: Reference, frames: usize, delay: usize) -> String {
    match reference {
        // First: with any reference nothing is left to compare.
        _ if delay >= frames => format!(
            "--evaluation-delay {delay} reaches beyond the last of \
            them. Give a smaller delay, or more --frames"
        ),
        Reference::Lidar => {
            "there are no scans. KITTI keeps them in velodyne/ (`dynvox inspect` shows where); \
             download them, or choose frames that have one"
                .to_owned()
        }
        Reference::Exact => "only the synthetic street has exact depth. Give --evaluate \
                             lidar"
            .to_owned(),
    }
}
