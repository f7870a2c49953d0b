//! The stereo rig, rigid motion and projection. Camera axes are KITTI's: x right, y down, z forward.

mod depth;
mod rig;
pub mod scalar;
mod transform;

pub use depth::depth_from_disparity;
pub use rig::{RigProblem, StereoRig};
pub use transform::Transform;
