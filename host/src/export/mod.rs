//! Files that other programs read: trajectories and the mesh.

mod ply;
#[cfg(test)]
mod tests;
mod trajectory;

pub use ply::{Mesh, PlyWriter};
pub use trajectory::{write_kitti, write_numbered, write_tum};
