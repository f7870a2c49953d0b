//! Files as they are defined elsewhere, read and written. Nothing here knows of frames, runs or the
//! map; of a run's files only names are here, for who reads them need not know runs.
//!
//! A reader takes a path and gives numbers, images or poses; what it cannot use is a
//! [`FormatError`] that says what is wrong and what to do. Each takes memory and time within
//! [`bounds`].

mod bayer;
pub mod bounds;
pub mod calibration;
mod capacity;
mod checksum;
mod decode;
mod error;
mod gnss;
mod image;
mod inertial;
mod opencv_xml;
mod pfm;
mod picture;
mod ply;
mod png_numbers;
mod poses;
pub mod rle;
mod rows;
mod rows_of_file;
mod run_files;
mod segments;
#[cfg(test)]
mod tests;
mod text;
mod times;
mod xml;

pub use bayer::BayerPattern;
pub(crate) use bayer::{Sample, demosaiced};
pub use capacity::{CapacityFile, CapacityTable};
pub use checksum::checksum_of;
pub use error::{FormatError, read_bytes_within, read_text, read_text_within};
pub use gnss::{Fix, Fixes, LocalPlane, TimedFix, read_gnss};
pub use image::{Image, luma};
pub use inertial::{
    GRAVITY_M_S2, INERTIAL_FORMATS, InertialFormat, InertialTable, TimedReading, read_inertial,
};
pub use opencv_xml::read_opencv_depth;
pub use pfm::read_pfm;
pub use picture::{
    Decoded, ENDINGS as PICTURE_ENDINGS, Picture, RANGE_PICTURES, SAMPLE_BITS, SampleRange,
    declared_maximum, decode_picture, picture_size, read_picture, significant_bits,
};
pub use ply::{Axes, Mesh, MeshAxes, PlyMesh, PlyVertex, PlyVertices, PlyWriter};
pub use png_numbers::{read_png_deep, read_png_u16, write_png_bytes, write_png_deep};
pub use poses::{
    Trajectory, kitti_line, read_numbered, read_poses, tum_line, tum_row, write_numbered,
};
pub use rows::number_rows;
pub use rows_of_file::rows_of_file;
pub use run_files::{
    BLOCKS_TABLE_FILE, CLOSED_MAP_FILE, CLOSED_TRAJECTORY_FILE, FRAMES_FILE, MAP_FILE, REPORT_FILE,
    SETTINGS_FILE, SUMMARY_FILE, TIMED_CLOSED_TRAJECTORY_FILE, TIMED_TRAJECTORY_FILE, TRACKS_FILE,
    TRAJECTORY_FILE, TRUE_TRAJECTORY_FILE,
};
pub use segments::{SEGMENT_GAP_M, ShownSegment, shown_pose};
pub(crate) use times::parse_date;
pub use times::{TimeTable, TimeUnit, parse_seconds, read_stamped_names, read_times};
