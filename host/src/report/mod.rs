//! What a run leaves behind: tables, the summary and the page; and two runs compared by what they left.

pub mod chart;
pub mod compare;
mod csv;
pub mod html;
mod summary;

pub use csv::{write_frames, write_lidar, write_tracks, write_tracks_truth};
pub use summary::Summary;
