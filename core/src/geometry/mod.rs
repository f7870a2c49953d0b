//! The stereo rig, rigid motion and projection. Camera axes are KITTI's: x right, y down, z
//! forward.

mod correction;
mod depth;
mod ground_plane;
pub(crate) mod histogram;
mod oriented_box;
mod rig;
mod row_correction;
pub mod scalar;
mod segment;
mod shares;
mod transform;

pub use correction::DisparityCorrection;
pub(crate) use correction::{PixelCorrection, ROW_SQUARE_MEAN};
pub(crate) use depth::DepthRange;
pub use depth::depth_from_disparity;
pub use ground_plane::GroundPlane;
pub(crate) use oriented_box::OrientedBox;
pub(crate) use rig::StereoObservation;
pub use rig::{DEPTH_MIN_M, DISPARITY_MIN_PX, RigProblem, StereoRig};
pub use row_correction::RowCorrection;
pub(crate) use row_correction::RowShift;
pub use segment::MapSegment;
pub(crate) use shares::Shares;
pub use transform::Transform;
