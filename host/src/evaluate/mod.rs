//! How good a run was, where the truth is known.

pub mod exact;
pub mod lidar;
pub mod objects;
pub mod stereo;
pub mod surfaces;
pub mod swept;
pub mod trajectory;
