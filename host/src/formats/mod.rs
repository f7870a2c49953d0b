//! Files as they are defined elsewhere, read and written. Nothing here knows of frames, runs or the map.
//!
//! A reader takes a path and gives numbers, images or poses; what it cannot use is a [`FormatError`] that says what is wrong and what to do.
//! Readers of images are told the size that is expected where a header could ask for any amount of memory.

pub mod calibration;
mod error;
mod image;
mod opencv_xml;
mod pfm;
mod ply;
mod poses;
pub mod rle;
mod rows;
#[cfg(test)]
mod tests;

pub use error::{FormatError, read_text};
pub use image::{Decoded, Image, luma, png_size, read_png, read_png_deep, read_png_u16};
pub use opencv_xml::read_opencv_depth;
pub use pfm::read_pfm;
pub use ply::{Mesh, PlyWriter};
pub use poses::{Trajectory, read_poses, write_kitti, write_numbered, write_tum};
pub use rows::read_times;
