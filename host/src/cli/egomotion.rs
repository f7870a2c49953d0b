//! `--egomotion`.

use crate::input::{self, FrameSource, InputError};
use crate::request::Settings;
use dynvox_core::MotionSource;
use dynvox_core::geometry::Transform;
use std::path::PathBuf;
use std::str::FromStr;

/// The source of the camera's motion on the command line.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum EgomotionChoice {
    /// Matches over two stereo pairs.
    Stereo,
    /// Depth against the map.
    Icp,
    /// A file of poses.
    File(PathBuf),
}

impl FromStr for EgomotionChoice {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text.split_once(':') {
            None if text == "stereo" => Ok(Self::Stereo),
            None if text == "icp" => Ok(Self::Icp),
            Some(("file", path)) if !path.is_empty() => Ok(Self::File(path.into())),
            _ => Err("one of stereo, icp, file:POSES".to_owned()),
        }
    }
}

impl EgomotionChoice {
    /// Applies it to the settings, and reads the poses of the chosen frames where they come from a
    /// file.
    pub fn apply(
        &self,
        settings: &mut Settings,
        dataset: &dyn FrameSource,
        indices: &[usize],
    ) -> Result<Option<Vec<Transform>>, InputError> {
        match self {
            Self::Stereo => settings.set_motion_source(MotionSource::Stereo),
            Self::Icp => settings.set_motion_source(MotionSource::Icp),
            Self::File(path) => return input::read_given_poses(path, dataset, indices).map(Some),
        }
        Ok(None)
    }
}
