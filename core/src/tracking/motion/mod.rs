//! Motions of objects over ground, one object at a time: estimated from its matches, filtered over
//! frames, and classified.
//!
//! 1. [`MotionFrame::estimate`] removes the outliers among an object's matches and updates its
//!    [`MotionFilter`] by the rest;
//! 2. [`MotionEvidence::new`] tells the speed, with the errors of matches and camera;
//! 3. [`MotionHysteresis::update`] classifies the object by it.
//!
//! # Motion over ground
//!
//! Relative to an object the camera moves as well: `t_current_previous` estimated from the object's
//! matches alone maps its points from the previous camera to the current one. What remains after
//! the camera's own motion is the object's over ground, between the frames:
//!
//! `motion_world = t_world_camera(now) * t_current_previous(object) * t_world_camera(before)^-1`
//!
//! and the object's frame moves by it:
//! `t_world_object(now) = motion_world * t_world_object(before)`. For a static object both
//! `t_current_previous` agree and the motion is the identity, which it is set to once the state is
//! static. The speed is that of the object's centre: how far a motion moves the camera's position,
//! as the original takes it, grows with the distance and the slightest rotation.

mod camera;
mod config;
mod estimate;
mod filter;
mod hysteresis;
mod motion_evidence;
mod state;
#[cfg(test)]
mod tests;

pub use camera::CameraMotion;
pub use config::{MotionConfig, StateConfig};
pub(super) use estimate::{GuidedSearch, MotionFrame, ObjectMotion};
pub(super) use filter::{FilterView, MotionFilter, Observation};
pub(super) use hysteresis::MotionHysteresis;
pub(super) use motion_evidence::MotionEvidence;
pub use state::MotionState;
