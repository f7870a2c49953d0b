//! Inertial unit: turn rates and specific forces between frames, as a prior of the camera's turn.
//!
//! A unit is an aid, never a source: poses come from images. Without samples nothing changes, to
//! the bit.

mod sample;
mod unit;

pub use sample::{INERTIAL_SAMPLES_PER_FRAME, InertialSample};
pub use unit::InertialUnit;
