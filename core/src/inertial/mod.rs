//! Inertial unit: turn rates and specific forces between frames, as a prior of the camera's turn.
//!
//! A unit is an aid, never a source: poses come from images. Turn rates are integrated over the
//! time between two frames (midpoint rule) and compared with the turns that images show. What they
//! differ by tells the bias of the rates and the offset of the clocks. A unit whose turns agree is
//! trusted: poses that images cannot give turn by it, its turn is the first hypothesis of the next
//! motion, and a motion of the images that contradicts it is refused. A unit that contradicts the
//! images is doubted, by name, and not used until it agrees again. Forces give the vertical, and
//! once it is known the way of a camera in the dark.
//!
//! Without a unit, or without samples or times, nothing changes, to the bit.
//!
//! Memory: 3 KiB in the mapper itself. Time: a rotation a sample, at most
//! [`INERTIAL_SAMPLES_PER_FRAME`] twice a frame. Decision 74 has the rules.

mod agreement;
mod covariance;
mod errors;
mod gravity;
mod integral;
mod prior;
mod recent;
mod report;
mod sample;
#[cfg(test)]
mod tests;
mod turn;
mod unit;
mod vertical;

pub use agreement::InertialDoubt;
pub(crate) use prior::InertialPrior;
pub use report::InertialReport;
pub use sample::{INERTIAL_SAMPLES_PER_FRAME, InertialSample};
pub(crate) use turn::MeasuredMotion;
pub use unit::InertialUnit;
pub use vertical::Vertical;
