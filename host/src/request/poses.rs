//! Poses of the camera.

use serde::{Deserialize, Serialize};
use std::path::PathBuf;

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
