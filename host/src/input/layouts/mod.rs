//! Recordings, by how they lie on the disk: KITTI odometry, tracking and raw, KITTI-360,
//! Cityscapes, EuRoC and TUM VI, Virtual KITTI 2, Spring, DrivingStereo, Argoverse 2, any folders
//! of images; and the synthetic street.

pub(super) mod argoverse;
mod camera_folders;
pub(super) mod cityscapes;
pub(super) mod driving_stereo;
pub(super) mod euroc;
pub(super) mod folder;
pub(super) mod kitti;
pub(super) mod kitti_raw;
mod labels;
mod lidar;
mod names;
mod pairing;
#[cfg(test)]
mod raw_tests;
mod sequence;
pub(super) mod spring;
mod street;
mod tables;
#[cfg(test)]
mod tests;
mod trees;
mod units;
pub(super) mod vkitti;

pub(super) use pairing::nearest_stamps;
pub use sequence::Sequence;
pub use street::StreetFrames;
