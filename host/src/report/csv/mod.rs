//! Tables of a run.

mod frames;
mod reference;
mod tracks;

pub use frames::write_frames;
pub use reference::write_lidar;
pub use tracks::{write_tracks, write_tracks_truth};
