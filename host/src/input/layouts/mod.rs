//! Recordings, by how they lie on the disk: KITTI odometry, tracking and raw, KITTI-360,
//! Cityscapes, EuRoC and TUM VI, any folders of images; and the synthetic street.

use serde::{Deserialize, Serialize};

mod camera_folders;
mod cityscapes;
mod euroc;
mod folder;
mod kitti;
mod kitti_raw;
mod labels;
mod lidar;
mod names;
mod open;
mod pairing;
#[cfg(test)]
mod raw_tests;
mod sequence;
mod stacked;
mod street;
#[cfg(test)]
mod tests;

pub use open::{Found, Layout, OpenOptions, open, sequences_at, survey};
pub(super) use pairing::nearest_stamps;
pub use sequence::Sequence;
pub use stacked::Stacking;
pub use street::StreetFrames;

/// Which camera pair of KITTI odometry to use.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum CameraPair {
    /// The grey pair where it is there, else the colour pair.
    #[default]
    Auto,
    /// `image_0` and `image_1`.
    Grey,
    /// `image_2` and `image_3`: matched in grey, fused in colour.
    Colour,
}
