//! Poses of the camera.

use dynvox_core::MotionSource;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;
use std::str::FromStr;

/// Source of the camera's poses.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Poses {
    /// The mapper estimates them, as the setting `mapper.egomotion` says.
    #[default]
    Estimated,
    /// A file of KITTI or TUM.
    File(PathBuf),
}

/// A source of the camera's motion by name.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Egomotion {
    /// Estimated by the mapper.
    Source(MotionSource),
    /// A file of poses.
    File(PathBuf),
}

impl FromStr for Egomotion {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text.split_once(':') {
            None if text == "stereo" => Ok(Self::Source(MotionSource::Stereo)),
            None if text == "icp" => Ok(Self::Source(MotionSource::Icp)),
            Some(("file", path)) if !path.is_empty() => Ok(Self::File(path.into())),
            _ => Err("one of stereo, icp, file:POSES".to_owned()),
        }
    }
}
