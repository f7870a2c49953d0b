//! The voxel-hashed map (Section III-E of the paper; Nießner et al., *Real-time 3D Reconstruction at Scale using Voxel Hashing*, 2013).
//!
//! Space is a lattice of points `voxel_size_m` apart; lattice point (i, j, k) lies at `voxel_size_m * (i, j, k)` in the map's frame.
//! 8 x 8 x 8 of them are a block. Each point keeps a signed distance, how often it was seen and, where the profile has it, a colour.
//! A depth image is fused in three steps: blocks within the truncation of its surface are made (allocation), every visible block is
//! updated by integer averages (fusion), and on demand the map is looked at from a pose (raycast) or turned into triangles
//! (marching cubes).

mod block;
mod config;
mod index;
mod sampler;

pub use block::{BLOCK_SIDE, BLOCK_VOXELS, BlockCoord, Blocks};
pub use config::{CLASS_COUNT, ObservationWeight, VolumeConfig};
pub use index::BlockIndex;
pub use sampler::{Sampler, VoxelSample};
