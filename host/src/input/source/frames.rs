//! A source of frames, and what is known of it before a frame is read.

use super::{
    AvailableMasks, InertialUnitData, InputError, LidarScan, OwnUnit, StereoImages, StreamState,
};
use crate::formats::Image;
use crate::formats::calibration::FittedGeometry;
use dynvox_core::geometry::{StereoRig, Transform};
use dynvox_core::rectify::Rectification;
use std::sync::Arc;

/// Facts about a source that hold for all its frames.
#[derive(Clone, Debug)]
pub struct SourceInfo {
    /// Short name, fit for a folder: `kitti-odometry-06`.
    pub name: String,
    /// Frames in all; 0 of a stream, whose end is unknown.
    pub frames: usize,
    /// Width and height of every image as it is mapped, px.
    pub size: (usize, usize),
    /// Width and height of the images as they are stored, before any scaling, px: masks in files
    /// have this size.
    pub full_size: (usize, usize),
    /// Rig of all frames.
    pub rig: StereoRig,
    /// Rectification by the mapper; `None` if images come rectified. With one, `size` and `rig` are
    /// those of the rectified pair, and a frame's images are raw.
    pub rectification: Option<Rectification>,
    /// Masks that come with the data set.
    pub masks: AvailableMasks,
    /// True `t_world_camera` of every frame's left camera, if known.
    pub truth: Option<Vec<Transform>>,
    /// Inertial unit of the recording, as its layout knows of it.
    pub own_unit: Option<OwnUnit>,
    /// Inertial unit in use.
    pub inertial: Option<Arc<InertialUnitData>>,
    /// Assumptions and omissions, as sentences.
    pub notes: Vec<String>,
    /// Pixels of the rectified left image that are not used in any frame, 255; the others are 0.
    pub ignored: Option<Arc<Image<u8>>>,
}

impl SourceInfo {
    /// Facts about frames of cameras without masks, truth or notes.
    pub fn new(name: String, frames: usize, geometry: &FittedGeometry) -> Self {
        Self {
            name,
            frames,
            size: geometry.size,
            full_size: geometry.size,
            rig: geometry.rig,
            rectification: geometry.rectification,
            masks: AvailableMasks::Absent,
            truth: None,
            own_unit: None,
            inertial: None,
            notes: Vec::new(),
            ignored: None,
        }
    }
}

/// Facts about one frame that are known before it is read.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FrameInfo {
    /// Name of the left image without its ending, if it is a file: masks in files have the same.
    pub stem: Option<String>,
    /// Time of the frame, ns since any moment that stays the same; `None` if nothing tells.
    pub stamp_ns: Option<u64>,
    /// Time of the frame, s: by its stamp, else by an assumed rate.
    pub time_s: f64,
}

/// A list of stereo pairs with one rig. Sources and what is laid over them implement the first six
/// methods; the others look facts up.
pub trait FrameSource: Send + Sync {
    /// Facts about all frames.
    fn info(&self) -> &SourceInfo;

    /// Facts about a frame. Those of a frame beyond the last are none, or go on as before.
    fn frame_info(&self, index: usize) -> FrameInfo;

    /// Decodes or renders a frame.
    ///
    /// # Errors
    /// There is no such frame, or it cannot be read.
    fn frame(&self, index: usize) -> Result<StereoImages, InputError>;

    /// State of a stream: frames come once, in order, and their number shows only when asking for
    /// one beyond the last is answered by [`InputError::PastEnd`]. `None` for a recording.
    fn stream(&self) -> Option<StreamState>;

    /// Tells whether there is a LiDAR scan for a frame.
    fn has_lidar(&self, index: usize) -> bool;

    /// Reads the scan of a frame, if there is one. Nothing is read of it before.
    ///
    /// # Errors
    /// The scan cannot be read.
    fn lidar(&self, index: usize) -> Result<Option<LidarScan>, InputError>;

    /// Short name, fit for a folder.
    fn name(&self) -> &str {
        &self.info().name
    }

    /// Frames in all; 0 of a stream.
    fn len(&self) -> usize {
        self.info().frames
    }

    /// Tells whether it is known that there is no frame.
    fn is_empty(&self) -> bool {
        self.len() == 0 && self.stream().is_none()
    }

    /// Width and height of every image as it is mapped, px.
    fn size(&self) -> (usize, usize) {
        self.info().size
    }

    /// Width and height of the images as they are stored, px.
    fn full_size(&self) -> (usize, usize) {
        self.info().full_size
    }

    /// Name of a frame's left image without its ending.
    fn stem(&self, index: usize) -> Option<String> {
        self.frame_info(index).stem
    }

    /// Masks that come with the data set.
    fn masks(&self) -> AvailableMasks {
        self.info().masks.clone()
    }

    /// Rig of all frames.
    fn rig(&self) -> StereoRig {
        self.info().rig
    }

    /// Rectification by the mapper; `None` if images come rectified.
    fn rectification(&self) -> Option<&Rectification> {
        self.info().rectification.as_ref()
    }

    /// Time of a frame, ns; `None` if nothing tells.
    fn stamp_ns(&self, index: usize) -> Option<u64> {
        self.frame_info(index).stamp_ns
    }

    /// Time of a frame, s.
    fn time_s(&self, index: usize) -> f64 {
        self.frame_info(index).time_s
    }

    /// Tells whether frames come with exact depth ([`StereoImages::exact`]).
    fn has_exact_depth(&self) -> bool {
        self.info().masks == AvailableMasks::Exact
    }

    /// True `t_world_camera` of every frame's left camera, if known.
    fn truth(&self) -> Option<&[Transform]> {
        self.info().truth.as_deref()
    }

    /// Assumptions and omissions, as sentences.
    fn notes(&self) -> &[String] {
        &self.info().notes
    }
}
