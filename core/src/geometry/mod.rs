//! The stereo rig, rigid motion and projection. Camera axes are KITTI's: x right, y down, z forward.

mod depth;
mod motion;
mod rig;
pub mod scalar;

pub use depth::depth_from_disparity;
pub use motion::{Transform, exp, renormalised};
pub use rig::{RigProblem, StereoRig};
