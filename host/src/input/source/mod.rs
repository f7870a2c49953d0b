//! What a source of frames is, what a frame holds, and what can be wrong with either.

mod depth;
mod error;
mod fixes;
mod frames;
mod given_poses;
mod inertial;
mod lidar;
mod masks;
mod overlay;
mod scaled;
mod stacking;
mod stop;
mod truth;

pub use depth::{DepthRefusals, GivenDepth, Quantity, to_disparity};
pub use error::{InputError, read_failed};
pub use fixes::{PositionFix, read_position_fixes};
pub use frames::{FrameInfo, FrameSource, SourceInfo};
pub use given_poses::read_given_poses;
pub use inertial::{InertialUnitData, OwnUnit, UnitSamples};
pub use lidar::LidarScan;
pub use masks::{
    FrameMasks, InstanceMask, MAX_BYTES, MAX_MASKS, MaskRefusals, bounding_boxes, union,
};
pub use overlay::{Overlay, OverlaySource, with_inertial_unit};
pub use scaled::Scaled;
pub use stacking::Stacking;
pub use stop::StopRequest;
pub use truth::{ObjectsTruth, TrueObject};

use crate::formats::{Decoded, Image};
use std::path::PathBuf;
use std::sync::Arc;

/// Frames a second assumed of images without times.
pub const ASSUMED_HZ: f64 = 10.0;

/// One stereo pair, decoded.
#[derive(Clone, Debug)]
pub struct StereoImages {
    /// Left grey image.
    pub left: Image<u8>,
    /// Right grey image, of the same size.
    pub right: Image<u8>,
    /// Left image in colour, where the data set has it: the same camera as `left`.
    pub colour: Option<Image<[u8; 3]>>,
    /// Disparity from elsewhere; the core matches the pair where it is absent.
    pub depth: Option<GivenDepth>,
    /// Exact values of a rendered frame.
    pub exact: Option<ExactFrame>,
    /// Ground truth of the objects, where known.
    pub objects: Option<ObjectsTruth>,
    /// Instance masks of the left image; empty until a source of masks is laid over this one.
    pub masks: FrameMasks,
    /// Pixels of the rectified left image that are not used, 255, in all frames alike; the others
    /// are 0.
    pub ignored: Option<Arc<Image<u8>>>,
}

impl StereoImages {
    /// A decoded pair, with nothing beside its pictures.
    pub(super) fn of_pair([left, right]: [Decoded; 2]) -> Self {
        Self {
            left: left.grey,
            right: right.grey,
            colour: left.colour,
            depth: None,
            exact: None,
            objects: None,
            masks: FrameMasks::default(),
            ignored: None,
        }
    }
}

/// Requires both images of a pair, left and right at the paths, to have the sequence's size.
pub(super) fn require_size(
    pair: &[Decoded; 2],
    (width, height): (usize, usize),
    path: impl Fn(usize) -> PathBuf,
) -> Result<(), InputError> {
    for (side, image) in pair.iter().enumerate() {
        let (found_width, found_height) = (image.grey.width(), image.grey.height());
        if (found_width, found_height) != (width, height) {
            return Err(InputError::Size {
                path: path(side),
                found_width,
                found_height,
                width,
                height,
            });
        }
    }
    Ok(())
}

/// Exact values of a frame, from its renderer.
#[derive(Clone, Debug)]
pub struct ExactFrame {
    /// Depth of the left pixels, m; 0 or infinite where unknown.
    pub depth_m: Image<f32>,
    /// True for pixels of objects that move in this frame.
    pub moving: Image<bool>,
    /// Instance at each left pixel: k is an instance of class `classes[k - 1]`, 0 is none.
    pub instances: Image<u8>,
    /// Class names of the instances.
    pub classes: Vec<&'static str>,
}

/// Masks that a data set brings along.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum AvailableMasks {
    /// None.
    Absent,
    /// Instance PNGs in a folder beside the images.
    Folder(PathBuf),
    /// Exact ones, from the renderer.
    Exact,
}

/// Facts about a stream, known while it is read.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct StreamState {
    /// Frames that came while the mapper was busy, and were dropped.
    pub dropped: u64,
}
