//! Motion from matches.

mod config;
mod estimate;
mod normal;
mod points;
mod track;

pub use config::EgomotionConfig;
pub use estimate::{Estimator, MotionEstimate, MotionStatus};
pub use track::Egomotion;

#[cfg(test)]
mod clip;
#[cfg(test)]
mod tests;
