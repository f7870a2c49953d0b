//! The stereo rig, rigid motion and projection. Camera axes are KITTI's: x right, y down, z forward.

mod correction;
mod depth;
mod rig;
pub mod scalar;
mod transform;

pub use correction::{ColumnCorrection, DisparityCorrection};
pub use depth::depth_from_disparity;
pub use rig::{DEPTH_MIN_M, DISPARITY_MIN_PX, RigProblem, StereoObservation, StereoRig};
pub use transform::Transform;
