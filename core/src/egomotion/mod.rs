//! Motion from matches: of the camera, or of the object that the matches lie on (StereoScan,
//! section III-B).
//!
//! Each match's point in the previous camera follows from its disparity. Three matches drawn at
//! random give a hypothesis by Gauss-Newton on the reprojection error of four coordinates (u and v
//! in both current images); the one with most inliers is refined on them, with inliers chosen anew
//! twice. Drawing stops as soon as one clean hypothesis is likely enough. The refinement gives
//! matches robust weights (Geman, McClure: *Statistical Methods for Tomographic Image
//! Reconstruction*, 1987), because an inlier may be two pixels off. Matches far from the middle
//! column weigh less: what rectification leaves of the lenses' errors grows steeply there.
//!
//! [`Estimator`] owns the scratch memory and estimates any set of matches; [`Egomotion`] tracks the
//! camera and repeats its last motion where the estimate fails; a camera that moves slowly is also
//! compared with an older frame (`anchor`). [`icp`] estimates motion from depth
//! only.
//!
//! **Memory.** 36 bytes per match, and 140 per point of the anchor.
//!
//! **Time.** Hypotheses times matches, in single precision and without branches; the rest is small
//! compared with it.
//!
//! **What can go wrong.** [`MotionStatus`] names it. A motion without enough inliers, or whose
//! refinement did not converge, is never returned. Sums run in the order of the matches, so that
//! other orders give other last bits.
//!
//! ```
//! use dynvox_core::{
//!     Capacity,
//!     egomotion::{EgomotionConfig, Estimator, MotionHypotheses, MotionStatus},
//!     geometry::StereoRig, memory::Carver, random::Random,
//! };
//!
//! let capacity = Capacity { matches: 50, ..Capacity::TINY };
//! let mut slab = vec![0; Estimator::bytes(&capacity) + 64];
//! let lead = slab.as_ptr().align_offset(64);
//! let mut carver = Carver::new(&mut slab[lead..], Estimator::bytes(&capacity)).unwrap();
//! let mut estimator = Estimator::new_in(&capacity, &mut carver);
//! let rig =
//!     StereoRig { focal_px: 700.0, center_u_px: 600.0, center_v_px: 180.0, baseline_m: 0.54 };
//! let mut random = Random::new(1);
//! let hypotheses = MotionHypotheses::from_draws(&mut random);
//! let estimate = estimator.estimate(&EgomotionConfig::default(), &rig, [], hypotheses);
//! assert_eq!(estimate.status, MotionStatus::TooFewMatches);
//! assert!(estimate.t_current_previous.is_none());
//! ```

mod anchor;
mod config;
mod covariance;
mod estimate;
pub mod icp;
mod normal_equations;
mod points;
mod predicted_turn;
mod synchrony;
mod track;
mod weights;

pub(crate) use anchor::{Anchor, SlowFrame};
pub use config::EgomotionConfig;
pub use covariance::MotionCovariance;
pub use estimate::{Estimator, MotionEstimate, MotionHypotheses, MotionStatus};
pub(crate) use predicted_turn::{AGREE_SIGMAS, PredictedTurn, Turned};
pub use synchrony::RightAhead;
pub use track::{Egomotion, MAX_REFERENCE_FRAMES, TimedMatches, WeakDirections};

#[cfg(test)]
mod tests;
