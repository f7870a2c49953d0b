//! Messages about recordings, files and requests.

use super::{io, path, text};
use crate::{
    formats::FormatError,
    input::InputError,
    request::{Reference, RequestError},
    synth::SynthError,
};
use std::io::ErrorKind;

/// Errors of reading: recordings, files and what is asked of a run.
pub(super) fn all() -> Vec<(&'static str, Vec<String>)> {
    vec![
        ("A recording cannot be used", of_recordings()),
        (
            "A file cannot be used",
            sentences!(FormatError; hands_on [];
                FormatError::Read { .. } => FormatError::Read {
                    path: path("calib.txt"), source: io(ErrorKind::PermissionDenied)
                },
                FormatError::Content { .. } => FormatError::Content {
                    path: path("calib.txt"),
                    reason: text("baseline_m is missing"),
                    action: text("Write the four numbers of the rig"),
                },
            ),
        ),
        (
            "A request cannot be met",
            sentences!(RequestError; hands_on [RequestError::Input(_), RequestError::Refused(_)];
                RequestError::Invalid(_) => RequestError::Invalid(text(
                    "--bits must be 8 to 16. Give another number"
                )),
                RequestError::NoFrames { .. } => RequestError::NoFrames { start: 90, len: 40 },
                RequestError::NoReference { .. } => RequestError::NoReference {
                    reference: Reference::Lidar, frames: 40, delay: 0
                },
                RequestError::ImageSize { .. } => RequestError::ImageSize {
                    width: 1242,
                    height: 375,
                    profile: text("tiny"),
                    fits_width: 320,
                    fits_height: 192,
                    action: text("Give a larger --profile"),
                },
                RequestError::Window { .. } => RequestError::Window {
                    prune_lag: 200, history_frames: 64, profile: text("tiny")
                },
                RequestError::Config { .. } => RequestError::Config {
                    problems: text("volume.far_m must be above volume.near_m")
                },
            ),
        ),
        (
            "A synthetic world cannot be written",
            sentences!(SynthError; hands_on [];
                SynthError::Config(_) => SynthError::Config(
                    text("street.rate_hz must be a positive number")
                ),
                SynthError::NotEmpty(_) => SynthError::NotEmpty(path("street")),
                SynthError::Write { .. } => SynthError::Write {
                    path: path("street/calib.txt"), source: io(ErrorKind::StorageFull)
                },
            ),
        ),
    ]
}

fn of_recordings() -> Vec<String> {
    sentences!(InputError; hands_on [InputError::Format(_)];
        InputError::Absent { .. } => InputError::Absent { path: path("drive") },
        InputError::Layout { .. } => InputError::Layout { path: path("drive"), below: Vec::new() },
        InputError::File { .. } => InputError::File { path: path("drive.zip") },
        InputError::Within { .. } => InputError::Within {
            path: path("drive/image_0"), root: path("drive")
        },
        InputError::Part { .. } => InputError::Part {
            path: path("drive/calib.txt"), action: text("Put the calibration there")
        },
        InputError::Sequence { .. } => InputError::Sequence {
            sequence: text("11"), root: path("kitti"), known: text("00, 05")
        },
        InputError::Choice { .. } => InputError::Choice {
            root: path("kitti"), known: text("00, 05")
        },
        InputError::Pairs { .. } => InputError::Pairs {
            left: path("left"), right: path("right"), counts: (40, 39)
        },
        InputError::Unrectified { .. } => InputError::Unrectified { path: path("drive") },
        InputError::OneCamera { .. } => InputError::OneCamera { path: path("drive") },
        InputError::Empty { .. } => InputError::Empty { path: path("drive/left") },
        InputError::Size { .. } => InputError::Size {
            path: path("left/000007.png"), found_width: 640, found_height: 480, width: 752,
            height: 480
        },
        InputError::Image { .. } => InputError::Image {
            path: path("left/000007.png"), reason: text("the file ends early")
        },
        InputError::Table { .. } => InputError::Table {
            path: path("times.txt"),
            reason: text("line 3 is not a number"),
            action: text("Correct the line"),
        },
        InputError::Masks { .. } => InputError::Masks {
            path: path("masks/000007.png"), reason: text("the file ends early")
        },
        InputError::IgnoreMask { .. } => InputError::IgnoreMask {
            path: path("bonnet.png"),
            reason: text("it has no white pixel. Paint what is to be ignored with 255"),
        },
        InputError::Network { .. } => InputError::Network {
            path: path("yolo.onnx"), reason: text("its file ends early. Export it anew")
        },
        InputError::Depth { .. } => InputError::Depth {
            path: path("depth/000007.png"), reason: text("the file ends early")
        },
        InputError::Bag { .. } => InputError::Bag {
            path: path("drive.bag"), reason: text("it has no index. Write one with `rosbag reindex`")
        },
        InputError::Stream { .. } => InputError::Stream {
            image: 7, reason: text("the stream ends within it")
        },
        InputError::PastEnd { .. } => InputError::PastEnd { frames: 40 },
        InputError::Street { .. } => InputError::Street {
            reason: text("street.rate_hz must be a positive number")
        },
        InputError::Scale { .. } => InputError::Scale {
            scale: 0.01, width: 752, height: 480, least: 64
        },
    )
}
