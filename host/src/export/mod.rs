//! What a run leaves behind: trajectories, the mesh, tables, the summary and the report.

mod folder;
mod frames;
mod ply;
pub mod report;
mod summary;
#[cfg(test)]
mod tests;
mod trajectory;

pub use folder::{FolderError, RunFolder};
pub use frames::write_frames;
pub use ply::{Mesh, PlyWriter};
pub use summary::Summary;
pub use trajectory::{write_kitti, write_tum};
