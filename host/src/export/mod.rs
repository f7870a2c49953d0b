//! What a run leaves behind: trajectories, the mesh, tables, the summary and the report.

mod folder;
mod frames;
mod lidar;
mod ply;
mod portrait;
pub mod report;
mod summary;
#[cfg(test)]
mod tests;
mod tracks;
mod trajectory;

pub use folder::{FolderError, RunFolder, write_whole};
pub use frames::write_frames;
pub use lidar::write_lidar;
pub use ply::{Mesh, PlyWriter};
pub use portrait::portrait;
pub use summary::Summary;
pub use tracks::{state_name, write_tracks, write_tracks_truth};
pub use trajectory::{write_kitti, write_numbered, write_tum};
