//! Tracks: objects over time. A frame's instances are associated with tracks, whose motions follow
//! from the matches of their instances.

mod association;
mod config;
mod image_velocity;
mod motions;
mod occlusion;
#[cfg(test)]
mod tests;
mod track;
mod tracked;

pub use association::TrackCount;
pub(super) use association::{AssociationInput, TrackTable};
pub use config::{Overlap, TracksConfig};
pub(super) use image_velocity::measure_image_velocities;
pub(super) use motions::{MotionInput, TrackMotions};
pub(crate) use track::Track;
pub use tracked::InstanceAt;
pub(super) use tracked::TrackedInstances;
