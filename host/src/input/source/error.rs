//! What can be wrong with a source of frames. Each message says what, where, and what to do next.

use crate::formats::FormatError;
use std::path::{Path, PathBuf};

/// A data set that cannot be used, or a frame of it.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum InputError {
    /// The path does not exist.
    #[error(
        "there is no data set at {path}. Check the path; `dynvox run` without one maps the \
         synthetic street"
    )]
    Absent {
        /// Path as given.
        path: PathBuf,
    },
    /// No known layout.
    #[error(
        "the layout of {path} is unknown. Known are KITTI odometry (sequences/NN/image_0), KITTI tracking \
         (training/image_02/NNNN), KITTI raw, KITTI-360, Cityscapes, EuRoC and TUM VI \
         (mav0/cam0), two folders of images (left/ and right/, cam0/ and cam1/, infra1/ and \
         infra2/, ...), and one folder of images \
         with calib.txt; --dataset says which one is meant{}",
        hint(below)
    )]
    Layout {
        /// Folder looked at.
        path: PathBuf,
        /// Folders in it that have a known layout.
        below: Vec<PathBuf>,
    },
    /// A file instead of a folder.
    #[error("{path} is a file. {}", file_action(.path))]
    File {
        /// Path as given.
        path: PathBuf,
    },
    /// A folder inside a data set.
    #[error(
        "{path} is a part of the data set {root}. Give {root}; `dynvox inspect {quoted}` says what \
         it holds",
        quoted = crate::terminal::quoted(.root)
    )]
    Within {
        /// Folder looked at.
        path: PathBuf,
        /// The data set around it.
        root: PathBuf,
    },
    /// A part of the layout is missing.
    #[error("{path} is missing. {action}")]
    Part {
        /// File or folder expected.
        path: PathBuf,
        /// Next action.
        action: String,
    },
    /// The sequence does not exist.
    #[error(
        "there is no sequence {sequence} in {root}. It holds {known}; choose one with --sequence"
    )]
    Sequence {
        /// Name asked for.
        sequence: String,
        /// Root of the data set.
        root: PathBuf,
        /// Names there.
        known: String,
    },
    /// Several sequences and no choice.
    #[error("{root} holds several sequences: {known}. Choose one with --sequence")]
    Choice {
        /// Root of the data set.
        root: PathBuf,
        /// Names there.
        known: String,
    },
    /// Images of two cameras that cannot be paired.
    #[error(
        "{left} and {right} cannot be paired: neither their names nor their time stamps pair the images, and there are {} left and \
         {} right ones. Give both images of a pair one name, or one number with a prefix or \
         suffix for the side", counts.0, counts.1
    )]
    Pairs {
        /// The first left image.
        left: PathBuf,
        /// The first right image.
        right: PathBuf,
        /// Images of each side.
        counts: (usize, usize),
    },
    /// Images as the lenses drew them.
    #[error(
        "the images of {path} are raw, and no calibration of their lenses is beside them. Put \
         cam0/sensor.yaml and cam1/sensor.yaml there, or name \
         the files with --calibration, once for each; if the images were rectified, their \
         calibration as calib.txt"
    )]
    Unrectified {
        /// The recording.
        path: PathBuf,
    },
    /// One image a frame, of one camera.
    #[error(
        "{path} holds one image a frame, and it cannot be told whether both cameras are in it. Say so with --side-by-side or \
         --top-bottom, or give the images of the right camera: a stereo mapper needs two"
    )]
    OneCamera {
        /// Folder looked at.
        path: PathBuf,
    },
    /// No image at all.
    #[error("{path} holds no image. PNG, JPEG, PGM, PPM, TIFF and BMP are read, of 8 or 16 bit")]
    Empty {
        /// Folder looked at.
        path: PathBuf,
    },
    /// An image of another size than the first.
    #[error(
        "{path} is {found_width} x {found_height} px, but the sequence began with {width} x \
         {height}. All images must have one size: rectify or crop them alike"
    )]
    Size {
        /// The image.
        path: PathBuf,
        /// Width that was found, px.
        found_width: usize,
        /// Height that was found, px.
        found_height: usize,
        /// Width of the sequence, px.
        width: usize,
        /// Height of the sequence, px.
        height: usize,
    },
    /// An image that cannot be decoded.
    #[error(
        "{path} cannot be read: {reason}. Fetch or convert this image anew, or leave such frames \
         out with --skip-bad-frames"
    )]
    Image {
        /// The image.
        path: PathBuf,
        /// Message of the decoder.
        reason: String,
    },
    /// A table of numbers that does not parse or has too few rows.
    #[error("{path}: {reason}. {action}")]
    Table {
        /// The file.
        path: PathBuf,
        /// Reason, as it completes the message's sentence.
        reason: String,
        /// Next action.
        action: String,
    },
    /// A file that is not what its format demands.
    #[error(transparent)]
    Format(#[from] FormatError),
    /// Masks that cannot be used.
    #[error(
        "the masks {path} cannot be used: {reason}. Correct them, give others with --instances, or \
         run without: --instances none"
    )]
    Masks {
        /// The file or folder.
        path: PathBuf,
        /// Reason, as it completes the message's sentence.
        reason: String,
    },
    /// A mask of ignored pixels that cannot be used.
    #[error("the mask of ignored pixels {path} cannot be used: {reason}")]
    IgnoreMask {
        /// The file.
        path: PathBuf,
        /// Reason, and what to do.
        reason: String,
    },
    /// A network that cannot be used.
    #[error("the network {path} cannot be used: {reason}")]
    Network {
        /// The file.
        path: PathBuf,
        /// Reason, and what to do.
        reason: String,
    },
    /// Depth that cannot be used.
    #[error(
        "the depth {path} cannot be used: {reason}. Correct it, give another folder with --depth, \
         or have it computed: --depth elas"
    )]
    Depth {
        /// The file or folder.
        path: PathBuf,
        /// Reason, as it completes the message's sentence.
        reason: String,
    },
    /// A recording of ROS that cannot be used.
    #[error("{path} cannot be used: {reason}")]
    Bag {
        /// The file.
        path: PathBuf,
        /// Reason, and what to do.
        reason: String,
    },
    /// A stream that broke.
    #[error(
        "image {image} of the stream cannot be used: {reason}. Let the program that writes it end \
         after an image; with ffmpeg: -f image2pipe -c:v pgm"
    )]
    Stream {
        /// Images before it.
        image: usize,
        /// Reason, as it completes the message's sentence.
        reason: String,
    },
    /// A frame beyond the last.
    #[error("the source ends after {frames} frames. Ask for an earlier one")]
    PastEnd {
        /// Frames in all.
        frames: usize,
    },
    /// A synthetic world refuses its configuration.
    #[error(
        "the synthetic world cannot be built: {reason}. Change its keys with --set \
         <key>=<value>"
    )]
    Street {
        /// Reason, as it completes the message's sentence.
        reason: String,
    },
    /// A scale outside (0, 1], or one that leaves no image.
    #[error(
        "--scale {scale} cannot be used on {width} x {height} px. Give a number above 0 and up to \
         1 that leaves at least {least} x {least} px"
    )]
    Scale {
        /// Scale asked for.
        scale: f64,
        /// Width before, px.
        width: usize,
        /// Height before, px.
        height: usize,
        /// Least side left, px.
        least: usize,
    },
}

/// Suggests folders to look in instead.
fn hint(below: &[PathBuf]) -> String {
    let shown: Vec<String> = below.iter().map(|path| path.display().to_string()).collect();
    if shown.is_empty() {
        String::new()
    } else {
        format!(". Below it, these look like data sets: {}", shown.join(", "))
    }
}

/// A failed read of a folder.
pub fn read_failed(path: &Path) -> impl FnOnce(std::io::Error) -> InputError + '_ {
    |source| FormatError::read(path)(source).into()
}

impl InputError {
    /// Returns true if no later frame can be read either.
    pub fn ends_source(&self) -> bool {
        matches!(self, Self::PastEnd { .. } | Self::Stream { .. })
    }

    /// An image of the sequence that cannot be used.
    pub fn image(error: FormatError) -> Self {
        match error {
            FormatError::Content { path, reason, .. } => Self::Image { path, reason },
            other => Self::Format(other),
        }
    }

    /// A recording of ROS that cannot be used; the reason says what to do.
    pub fn bag(path: &Path, reason: impl Into<String>) -> Self {
        Self::Bag { path: path.to_path_buf(), reason: reason.into() }
    }

    /// Masks that cannot be used.
    pub fn masks(path: &Path, reason: impl Into<String>) -> Self {
        Self::Masks { path: path.to_path_buf(), reason: reason.into() }
    }

    /// Converts a format's error to one about masks.
    pub fn masks_format(error: FormatError) -> Self {
        match error {
            FormatError::Content { path, reason, .. } => Self::Masks { path, reason },
            other => Self::Format(other),
        }
    }

    /// A network that cannot be used; the reason says what to do.
    pub fn network(path: &Path, reason: impl Into<String>) -> Self {
        Self::Network { path: path.to_path_buf(), reason: reason.into() }
    }

    /// Depth that cannot be used.
    pub fn depth(path: &Path, reason: impl Into<String>) -> Self {
        Self::Depth { path: path.to_path_buf(), reason: reason.into() }
    }

    /// Converts a format's error to one about depth.
    pub fn depth_format(error: FormatError) -> Self {
        match error {
            FormatError::Content { path, reason, .. } => Self::Depth { path, reason },
            other => Self::Format(other),
        }
    }
}

/// Endings of files that hold a video.
const VIDEO_ENDINGS: [&str; 8] = ["mp4", "avi", "mov", "mkv", "m4v", "webm", "mjpeg", "h264"];

/// The next step where a file is given instead of a folder.
fn file_action(path: &Path) -> String {
    let ending = path.extension().map(|ending| ending.to_string_lossy().to_lowercase());
    match ending.as_deref() {
        Some(ending) if VIDEO_ENDINGS.contains(&ending) => {
            "It is a video: write its images with `mkdir frames && ffmpeg -i VIDEO \
             frames/%06d.png`, and map them with `dynvox run frames --side-by-side --calibration \
             FILE`"
                .to_owned()
        }
        Some("svo" | "svo2") => {
            "It is a recording of ZED's own format: export its pairs as images \
                                 with ZED's tools, and give their folder"
                .to_owned()
        }
        Some("zip" | "tar" | "gz" | "tgz" | "7z") => {
            "It is an archive: unpack it, and give the folder of the data set".to_owned()
        }
        _ => "Give the folder of the data set".to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_that_are_no_folder_say_what_makes_one_of_them() {
        let message = |name: &str| InputError::File { path: PathBuf::from(name) }.to_string();
        assert!(message("drive.MP4").contains("ffmpeg -i VIDEO frames/%06d.png"));
        assert!(message("a.svo2").contains("export its pairs"));
        assert!(message("kitti.zip").contains("unpack it"));
        assert!(message("notes.txt").ends_with("Give the folder of the data set"));
    }
}
